// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <Eigen/Cholesky>

#include "math/dense/cholesky.h"
#include "math/dense/products.h"
#include "math/random.h"
#include "planning/plan_problem.h"
#include "solve/row_products.h"
#include "truetriad/base/triad.h"

// Exact optimal design: which poses, of a list of candidates, determine the parameters best.
// Fedorov, Theory of Optimal Experiments, 1972; Atkinson, Donev and Tobias 2007, ch. 12.

namespace truetriad {
namespace {

// Chosen: exchange stops at a local optimum, so the best of 12 starts is taken.
constexpr int kStarts = 12;
// Chosen: the most rounds. Each round adapts the weights to the σ of the previous round.
constexpr int kWeightRounds = 8;
// Chosen: number of rounds without a better program after which the weights count as settled.
constexpr int kIdleRounds = 3;
// Chosen: number of starts of the search for a plan with one pose fewer: a quarter of kStarts, to
// save time.
constexpr int kSparingStarts = 3;
// Prior σ of every parameter in units of the signal. It only bounds undetermined parameters.
constexpr double kAnything = 10.0;
// Finest turn, 1 deg: no operator turns a unit more finely by hand.
constexpr double kFinestTurnRad = kRadPerDeg;
// Candidates evaluated at once: their rows, about 200 with 60 unknowns, fit into the cache.
constexpr std::size_t kAtOnce = 24;
// A guard: usually kLeastGain or kLeastRefinement ends the sweeps.
constexpr int kMostSweeps = 10;
// A new pose must have a gain that is larger, by this share, than that of the pose that it
// replaces. Smaller differences are rounding, and with them the sweeps would never end.
constexpr double kLeastGain = 1e-6;
// The same share for turns off the grid, which would else go on with ever smaller gains.
constexpr double kLeastRefinement = 1e-4;

// Poses, with the information rows of each.
struct Candidates {
  std::vector<ProgramPose> poses;
  std::vector<InformationRows> rows;
};

struct Program : Candidates {
  Eigen::MatrixXd weights;  // of the cost that the program minimises
  double score = 0.0;       // less is better
};

// A design of information M (positive definite) with room for one more pose. Its cost is
//
//   weights W empty   D: -log det M
//   else              A: tr(W M^-1), a weighted sum of variances
class Vacancy {
 public:
  Vacancy(const Eigen::MatrixXd& information, const Eigen::MatrixXd& weights)
      : covariance_(Cholesky(information).Inverse()) {
    if (weights.size() > 0) weighted_ = Times(Times(covariance_, weights), covariance_);
  }

  struct Choice {
    std::size_t candidate = 0;
    double gain = -1.0;
  };

  // The candidate with the largest gain, the decrease of the cost when it is added. With P = M^-1
  // and rows B of a candidate, the gain is
  //   D: log det(I + B P B^T)      A: tr((I + B P B^T)^-1 B P W P B^T)
  Choice Best(const std::vector<InformationRows>& candidates) const {
    using Small =
        Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxPoseRows, kMaxPoseRows>;
    Choice best;
    StackedRows stacked, by_covariance, by_weighted;
    Eigen::Index at = 0;
    for (std::size_t c = 0; c < candidates.size(); ++c) {
      const InformationRows& rows = candidates[c];
      if (c % kAtOnce == 0) {
        // One matrix product serves several candidates.
        const std::size_t end = std::min(c + kAtOnce, candidates.size());
        Eigen::Index count = 0;
        for (std::size_t k = c; k < end; ++k) count += candidates[k].rows();
        stacked.resize(count, covariance_.cols());
        at = 0;
        for (std::size_t k = c; k < end; at += candidates[k++].rows()) {
          stacked.middleRows(at, candidates[k].rows()) = candidates[k];
        }
        by_covariance.noalias() = stacked * covariance_;
        if (weighted_.size() > 0) by_weighted.noalias() = stacked * weighted_;
        at = 0;
      }
      Small sum = by_covariance.middleRows(at, rows.rows()) * rows.transpose();
      sum.diagonal().array() += 1.0;
      const Eigen::LLT<Small> factor(sum);
      double gain = 0.0;
      if (weighted_.size() > 0) {
        const Small weighted = by_weighted.middleRows(at, rows.rows()) * rows.transpose();
        gain = factor.solve(weighted).trace();
      } else {
        gain = 2.0 * factor.matrixLLT().diagonal().array().log().sum();
      }
      // If gains differ only by rounding, the first candidate wins, so that all machines agree.
      if (gain > best.gain * (1.0 + kLeastGain)) best = {c, gain};
      at += rows.rows();
    }
    return best;
  }

 private:
  Eigen::MatrixXd covariance_;  // P
  Eigen::MatrixXd weighted_;    // P W P; empty for D
};

// All poses of the grid, temperature by temperature; if no sensor measures the heading, one pose
// for each direction of up.
std::vector<ProgramPose> DistinctPoses(const PlanGrid& grid, bool has_heading) {
  std::vector<ProgramPose> poses;
  const auto up = [](const Eigen::Quaterniond& q) {
    return Eigen::Vector3d(q.conjugate() * Eigen::Vector3d::UnitZ());
  };
  for (const Eigen::Quaterniond& attitude : grid.attitudes) {
    const bool seen =
        !has_heading && std::any_of(poses.begin(), poses.end(), [&](const ProgramPose& pose) {
          return (up(pose.world_from_body) - up(attitude)).norm() < 1e-9;
        });
    if (!seen) poses.push_back({attitude, std::nullopt, ""});
  }
  if (grid.temperatures_degc.empty()) return poses;
  std::vector<ProgramPose> at_temperatures;
  for (const double temperature : grid.temperatures_degc) {
    for (ProgramPose pose : poses) {
      pose.temperature_degc = temperature;
      at_temperatures.push_back(pose);
    }
  }
  return at_temperatures;
}

// Searches for a program from several starts, one of which is greedy. From each, exchanges poses of
// the grid, then, if allowed, moves them off the grid. If σ are wanted, finds the number of poses
// by bisection.
class PlanSearch {
 public:
  PlanSearch(const PlanProblem& problem, const PlanOptions& options)
      : problem_(problem),
        options_(options),
        base_(problem.known()),
        least_(std::min(problem.LeastPoses(), options.max_poses)) {
    grid_.poses = DistinctPoses(options.grid, problem.has_heading());
    grid_.rows = problem.Rows(grid_.poses);
    base_.diagonal().array() += 1.0 / (kAnything * kAnything);
    // The target of each σ: the wanted σ or, without one, the largest that counts as observable.
    targets_.resize(std::ssize(problem.quantities()));
    for (Eigen::Index q = 0; q < targets_.size(); ++q) {
      const PlanQuantity& quantity = problem.quantities()[static_cast<std::size_t>(q)];
      const auto found = options.wanted.find(quantity.group);
      is_wanted_.push_back(found != options.wanted.end());
      targets_[q] =
          is_wanted_.back() ? found->second : options.calibrate.observable_sigma * quantity.typical;
    }
  }

  // The program that the options ask for, in no particular order.
  std::vector<ProgramPose> Find() const {
    int count = options_.poses;
    if (count == 0) count = Fewest().value_or(options_.max_poses);
    std::vector<Program> programs = BestPrograms(count);
    // Fewest() used only a few starts. The refined programs of all starts may need fewer poses.
    while (options_.poses == 0 && count > least_ && programs.front().score <= kReached) {
      std::vector<Program> fewer = BestPrograms(count - 1);
      if (fewer.front().score > kReached) break;
      programs = std::move(fewer);
      --count;
    }
    for (const Program& program : programs) {
      if (problem_.Rehearse(program.poses)) return program.poses;
    }
    return programs.front().poses;
  }

  // The fewest poses with which the score is at most 1; unset: more than max_poses are needed. If
  // no σ is wanted: the number of poses that the model needs.
  std::optional<int> Fewest() const {
    if (!wants()) return least_;
    const auto reaches = [&](int count, int starts) {
      return Programs(count, starts).front().score <= kReached;
    };
    int low = least_ - 1, high = least_;  // `low` poses are too few, `high` are perhaps enough
    while (!reaches(high, 1)) {
      if (high == options_.max_poses) return std::nullopt;
      low = high;
      high = std::min(2 * high, options_.max_poses);
    }
    while (high - low > 1) {
      const int middle = (low + high) / 2;
      (reaches(middle, 1) ? high : low) = middle;
    }
    // Another start may find what the first one missed.
    while (high > least_ && reaches(high - 1, kSparingStarts)) --high;
    return high;
  }

 private:
  bool wants() const { return !options_.wanted.empty(); }

  static void SortByScore(std::vector<Program>* programs) {
    std::stable_sort(programs->begin(), programs->end(), [](const Program& a, const Program& b) {
      return a.score < b.score;
    });
  }

  // `information` plus that of the program's poses except the pose number `without`.
  static Eigen::MatrixXd Sum(Eigen::MatrixXd information,
                             const Program& program,
                             std::optional<std::size_t> without = std::nullopt) {
    for (std::size_t k = 0; k < program.rows.size(); ++k) {
      if (k == without) continue;
      information.noalias() += program.rows[k].transpose() * program.rows[k];
    }
    return information;
  }

  // The score (less is better): the largest σ / target if σ are wanted, else the criterion.
  double Score(const Program& program) const {
    if (!wants() && options_.criterion == PlanCriterion::kDeterminant) {
      return -Cholesky(Sum(base_, program)).LogDeterminant();
    }
    const Eigen::VectorXd sigmas = problem_.Sigmas(Sum(problem_.known(), program));
    if (!wants()) return sigmas.array().log().sum();
    return (sigmas.array() / targets_.array()).maxCoeff();
  }

  // Exchanges each pose for the best of the candidates offered(pose). Ends if no exchange increases
  // the gain by more than the share `least_gain`.
  template <class Offered>
  void ExchangeUntilSettled(const Offered& offered, double least_gain, Program* program) const {
    bool improved = true;
    for (int sweep = 0; improved && sweep < kMostSweeps; ++sweep) {
      improved = false;
      for (std::size_t k = 0; k < program->poses.size(); ++k) {
        // The information is summed anew: subtracting that of the pose would leave rounding errors
        // in directions in which only this pose has information.
        const Vacancy vacancy(Sum(base_, *program, k), program->weights);
        const Candidates& candidates = offered(program->poses[k]);
        const Vacancy::Choice best = vacancy.Best(candidates.rows);
        if (best.gain <= vacancy.Best({program->rows[k]}).gain * (1.0 + least_gain)) continue;
        program->poses[k] = candidates.poses[best.candidate];
        program->rows[k] = candidates.rows[best.candidate];
        improved = true;
      }
    }
  }

  void ExchangeOverGrid(const Eigen::MatrixXd& weights, Program* program) const {
    program->weights = weights;
    const auto grid = [this](const ProgramPose&) -> const Candidates& { return grid_; };
    ExchangeUntilSettled(grid, kLeastGain, program);
    program->score = Score(*program);
  }

  // Moves poses off the grid, one at a time, by ever smaller turns about the body axes.
  Program Refined(Program program) const {
    // Half the spacing of the grid's attitudes over SO(3), whose volume is 8 pi^2.
    double step = 0.5 * std::cbrt(8.0 * std::numbers::pi * std::numbers::pi /
                                  static_cast<double>(options_.grid.attitudes.size()));
    for (; step > kFinestTurnRad; step *= 0.5) {
      const auto turned = [&](const ProgramPose& pose) {
        std::vector<ProgramPose> moved(6, pose);
        for (int k = 0; k < 6; ++k) {
          moved[static_cast<std::size_t>(k)].world_from_body =
              pose.world_from_body *
              Eigen::AngleAxisd(k % 2 == 0 ? step : -step, Eigen::Vector3d::Unit(k / 2));
        }
        return Candidates{moved, problem_.Rows(moved)};
      };
      ExchangeUntilSettled(turned, kLeastRefinement, &program);
    }
    program.score = Score(program);
    return program;
  }

  // Weights for the criterion A from the factors of the quantities: tr(W P) = sum of factor * σ^2.
  Eigen::MatrixXd Weights(const Eigen::VectorXd& factors) const {
    Eigen::MatrixXd weights = Eigen::MatrixXd::Zero(base_.rows(), base_.cols());
    for (Eigen::Index q = 0; q < factors.size(); ++q) {
      const Eigen::RowVectorXd row = problem_.quantity_rows().row(q);
      weights.noalias() += factors[q] * row.transpose() * row;
    }
    return weights;
  }

  // Searches for programs, and adapts the weights in each round to the σ of the previous round. If
  // no σ are wanted, the weights become 1/σ^2, whose fixed point minimises the sum of log σ. If σ
  // are wanted, those that are still too large get more weight.
  Program BestFrom(Program program) const {
    if (options_.criterion == PlanCriterion::kDeterminant) {
      ExchangeOverGrid({}, &program);
      return program;
    }
    program.score = Score(program);
    Program best = program;
    Eigen::VectorXd factors = targets_.cwiseAbs2().cwiseInverse();
    int idle = 0;
    for (int round = 0; round < kWeightRounds; ++round) {
      const Eigen::VectorXd sigmas = problem_.Sigmas(Sum(base_, program));
      if (!wants()) factors = sigmas.cwiseAbs2().cwiseInverse();
      for (Eigen::Index q = 0; wants() && round > 0 && q < factors.size(); ++q) {
        if (is_wanted_[static_cast<std::size_t>(q)]) {
          factors[q] *= sigmas[q] / targets_[q] / program.score;
        }
      }
      ExchangeOverGrid(Weights(factors), &program);
      const bool better = program.score < best.score;
      if (better) best = program;
      idle = better ? 0 : idle + 1;
      if (idle == (wants() ? kIdleRounds : 1) || !std::isfinite(program.score)) break;
      if (wants() && options_.poses == 0 && best.score <= kReached) break;  // no σ is too large
    }
    return best;
  }

  // Programs of `count` poses of the grid, one from each of `starts` starts; the best one is first.
  std::vector<Program> Programs(int count, int starts) const {
    Random random(options_.seed);
    std::vector<Program> programs;
    for (int start = 0; start < starts; ++start) {
      Program program;
      for (int k = 0; k < count; ++k) {
        // The greedy start uses D: with few poses, A depends only on the least determined
        // parameters.
        const std::size_t next =
            start == 0
                ? Vacancy(Sum(base_, program), {}).Best(grid_.rows).candidate
                : static_cast<std::size_t>(random.Below(static_cast<int>(grid_.poses.size())));
        program.poses.push_back(grid_.poses[next]);
        program.rows.push_back(grid_.rows[next]);
      }
      programs.push_back(BestFrom(std::move(program)));
    }
    SortByScore(&programs);
    return programs;
  }

  // Programs from all starts, refined if poses may be off the grid; the best one is first.
  std::vector<Program> BestPrograms(int count) const {
    std::vector<Program> programs = Programs(count, kStarts);
    for (Program& program : programs) {
      if (!options_.grid.continuous) break;
      Program refined = Refined(program);
      if (refined.score < program.score) program = std::move(refined);
    }
    SortByScore(&programs);
    return programs;
  }

  const PlanProblem& problem_;
  const PlanOptions& options_;
  Candidates grid_;
  Eigen::MatrixXd base_;  // known information plus a weak prior, so that there is an inverse
  Eigen::VectorXd targets_;
  std::vector<bool> is_wanted_;
  int least_;  // the fewest poses that may be enough for the model
};

// The largest ratio of a σ of the gyroscope to the wanted σ.
double WorstOfGyroscope(const PlanProblem& problem,
                        const PlanOptions& options,
                        const Eigen::VectorXd& sigmas) {
  double worst = 0.0;
  for (std::size_t q = 0; q < problem.quantities().size(); ++q) {
    const std::string& group = problem.quantities()[q].group;
    if (!group.starts_with("gyroscope.") || !options.wanted.contains(group)) continue;
    worst = std::max(worst, sigmas[static_cast<Eigen::Index>(q)] / options.wanted.at(group));
  }
  return worst;
}

}  // namespace

std::optional<int> FewestPoses(const PlanProblem& problem,
                               PlanOptions options,
                               const std::string& group) {
  options.wanted = {{group, options.wanted.at(group)}};
  options.poses = 0;
  return PlanSearch(problem, options).Fewest();
}

Result<std::vector<ProgramPose>> FindPoses(const PoseSet& measured,
                                           const PlanOptions& options,
                                           const PlanProblem& problem) {
  if (!problem.has_gyroscope()) {
    return OrderForOperator(PlanSearch(problem, options).Find(), problem.has_heading());
  }
  // Each round has an eighth more poses than the one before; ten rounds triple their number.
  constexpr int kShareMore = 8;
  PlanOptions without = options;
  without.calibrate.triads[Triad::kGyroscope].enabled = false;
  std::erase_if(without.wanted,
                [](const auto& item) { return item.first.starts_with("gyroscope."); });
  TRUETRIAD_ASSIGN_OR_RETURN(const PlanProblem others, PlanProblem::Create(measured, without));
  while (true) {
    std::vector<ProgramPose> poses = OrderForGyroscope(
        OrderForOperator(PlanSearch(others, without).Find(), others.has_heading()),
        problem.turns());
    const auto count = static_cast<int>(poses.size());
    if (options.poses > 0 || count >= options.max_poses ||
        WorstOfGyroscope(problem, options, problem.Sigmas(problem.Information(poses))) <=
            kReached) {
      return poses;
    }
    without.poses = std::min(count + 1 + count / kShareMore, options.max_poses);
  }
}

}  // namespace truetriad
