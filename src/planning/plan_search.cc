// SPDX-License-Identifier: Apache-2.0
#include "planning/plan_search.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "math/random.h"
#include "start/start.h"
#include "truetriad/base/units.h"

namespace truetriad {
namespace {

// Exchange stops at an optimum that is only the best near its start.
constexpr int kStarts = 12;
// Rounds in which the weights follow the σ they led to.
constexpr int kWeightRounds = 8;
// Weights that led to no better program three times over go in a circle.
constexpr int kIdleRounds = 3;
// Starts from which one pose less is tried.
constexpr int kSparingStarts = 3;
// A hand does not turn a unit more finely than this.
constexpr double kFinestTurnRad = kRadPerDeg;
// A guard: sweeps end by kLeastRefinement.
constexpr int kRefineSweeps = 10;
// Share of what a pose is worth, below which a move is not worth another sweep.
constexpr double kLeastRefinement = 1e-4;

// All poses of the grid; where headings are not seen, one a direction. One temperature after
// another.
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

}  // namespace

PlanSearch::PlanSearch(const PlanProblem& problem, const PlanOptions& options)
    : problem_(problem),
      options_(options),
      candidates_(DistinctPoses(options.grid, problem.has_heading())),
      rows_(problem.Rows(candidates_)),
      base_(problem.Regularised()) {}

Eigen::MatrixXd PlanSearch::Information(const Program& program, bool regularised) const {
  Eigen::MatrixXd information = regularised ? base_ : problem_.known();
  for (const InformationRows& rows : program.rows) information.noalias() += rows.transpose() * rows;
  return information;
}

Eigen::MatrixXd PlanSearch::Weights(const Eigen::VectorXd& factors) const {
  Eigen::MatrixXd weights = Eigen::MatrixXd::Zero(base_.rows(), base_.cols());
  for (Eigen::Index q = 0; q < factors.size(); ++q) {
    const Eigen::RowVectorXd& row = problem_.quantities()[static_cast<std::size_t>(q)].row;
    weights.noalias() += factors[q] * row.transpose() * row;
  }
  return weights;
}

Eigen::VectorXd PlanSearch::Targets(const Wanted& wanted) const {
  Eigen::VectorXd targets(static_cast<Eigen::Index>(problem_.quantities().size()));
  for (Eigen::Index q = 0; q < targets.size(); ++q) {
    const PlanQuantity& quantity = problem_.quantities()[static_cast<std::size_t>(q)];
    const auto found = wanted.find(quantity.group);
    targets[q] = found != wanted.end() ? found->second
                                       : options_.calibrate.observable_sigma * quantity.typical;
  }
  return targets;
}

// Without wanted σ: the criterion itself. With them: the largest σ / wanted.
double PlanSearch::Score(const Program& program, const Wanted& wanted) const {
  if (wanted.empty() && options_.criterion == PlanCriterion::kDeterminant) {
    return DesignCost(Information(program, true), {});
  }
  const Eigen::VectorXd sigmas = problem_.Sigmas(Information(program, false));
  if (wanted.empty()) return sigmas.array().log().sum();
  return (sigmas.array() / Targets(wanted).array()).maxCoeff();
}

void PlanSearch::SortByScore(std::vector<Program>* programs) {
  std::stable_sort(programs->begin(), programs->end(), [](const Program& a, const Program& b) {
    return a.score < b.score;
  });
}

std::size_t PlanSearch::LeastCount() const {
  std::vector<ProgramPose> poses;
  while (!CheckPoseCounts(problem_.ExactReadings(poses), problem_.options())) {
    poses.push_back(candidates_.front());
  }
  return std::max<std::size_t>(poses.size(), 1);
}

// Moves poses off the grid, one at a time, by ever smaller turns about the body axes.
PlanSearch::Program PlanSearch::Refined(Program program) const {
  // Half the spacing of as many attitudes spread over SO(3), whose volume is 8 pi^2.
  double step = 0.5 * std::cbrt(8.0 * std::numbers::pi * std::numbers::pi /
                                static_cast<double>(options_.grid.attitudes.size()));
  for (; step > kFinestTurnRad; step *= 0.5) {
    bool improved = true;
    for (int sweep = 0; improved && sweep < kRefineSweeps; ++sweep) {
      improved = false;
      for (std::size_t k = 0; k < program.poses.size(); ++k) {
        Program others = program;
        others.rows.erase(others.rows.begin() + static_cast<std::ptrdiff_t>(k));
        const Vacancy vacancy(Information(others, true), program.weights);
        std::vector<ProgramPose> moved;
        for (int axis = 0; axis < 3; ++axis) {
          for (const double angle : {step, -step}) {
            moved.push_back(program.poses[k]);
            moved.back().world_from_body = program.poses[k].world_from_body *
                                           Eigen::AngleAxisd(angle, Eigen::Vector3d::Unit(axis));
          }
        }
        const std::vector<InformationRows> rows = problem_.Rows(moved);
        const Vacancy::Choice best = vacancy.Best(Candidates(rows));
        if (best.gain <= vacancy.Gain(program.rows[k]) * (1.0 + kLeastRefinement)) continue;
        program.poses[k] = moved[best.candidate];
        program.rows[k] = rows[best.candidate];
        improved = true;
      }
    }
  }
  return program;
}

PlanSearch::Program PlanSearch::ProgramFrom(Design design, const Wanted& wanted) const {
  const auto of_design = [&](const Eigen::MatrixXd& weights) {
    Program program;
    for (const std::size_t place : design) {
      program.poses.push_back(candidates_[place]);
      program.rows.emplace_back(rows_.rows(place));
    }
    program.weights = weights;
    program.score = Score(program, wanted);
    return program;
  };
  if (options_.criterion == PlanCriterion::kDeterminant) {
    ExchangeUntilSettled(base_, rows_, {}, &design);
    return of_design({});
  }
  // Weights that follow the σ they led to. Without wanted σ: 1/σ^2, of which a fixed point is least
  // in the sum of log σ. With them: those that are still too large count more.
  const Eigen::VectorXd targets = Targets(wanted);
  Eigen::VectorXd factors = targets.cwiseAbs2().cwiseInverse();
  Program best = of_design({});
  Program program = best;
  int idle = 0;
  for (int round = 0; round < kWeightRounds; ++round) {
    const Eigen::VectorXd sigmas = problem_.Sigmas(Information(program, true));
    if (wanted.empty()) {
      factors = sigmas.cwiseAbs2().cwiseInverse();
    } else if (round > 0) {
      for (Eigen::Index q = 0; q < factors.size(); ++q) {
        const std::string& group = problem_.quantities()[static_cast<std::size_t>(q)].group;
        if (wanted.contains(group)) factors[q] *= sigmas[q] / targets[q] / program.score;
      }
    }
    const Eigen::MatrixXd weights = Weights(factors);
    ExchangeUntilSettled(base_, rows_, weights, &design);
    program = of_design(weights);
    const bool better = program.score < best.score;
    if (better) best = program;
    idle = better ? 0 : idle + 1;
    if (idle == (wanted.empty() ? 1 : kIdleRounds) || !std::isfinite(program.score)) break;
    if (!wanted.empty() && options_.poses == 0 && best.score <= kReached) break;  // that is enough
  }
  return best;
}

std::vector<PlanSearch::Program> PlanSearch::Programs(std::size_t count,
                                                      const Wanted& wanted,
                                                      int starts) const {
  Random random(options_.seed);
  std::vector<Program> programs;
  for (int start = 0; start < starts; ++start) {
    Design design;
    if (start == 0) {
      // D finds its way from nothing, where A sees only what is worst.
      design = GreedyDesign(base_, rows_, {}, count);
    } else {
      for (std::size_t k = 0; k < count; ++k) {
        design.push_back(
            static_cast<std::size_t>(random.Below(static_cast<int>(candidates_.size()))));
      }
    }
    programs.push_back(ProgramFrom(design, wanted));
  }
  SortByScore(&programs);
  return programs;
}

std::optional<std::size_t> PlanSearch::Fewest(const Wanted& wanted) const {
  const auto reaches = [&](std::size_t count, int starts) {
    return Programs(count, wanted, starts).front().score <= kReached;
  };
  const auto most = static_cast<std::size_t>(options_.max_poses);
  std::size_t low = std::min(LeastCount(), most) - 1;  // too few
  std::size_t high = low + 1;
  while (!reaches(high, 1)) {
    if (high == most) return std::nullopt;
    low = high;
    high = std::min(2 * high, most);
  }
  while (high - low > 1) {
    const std::size_t middle = (low + high) / 2;
    (reaches(middle, 1) ? high : low) = middle;
  }
  // One start may have missed what another finds.
  const std::size_t least = LeastCount();
  while (high > least && reaches(high - 1, kSparingStarts)) --high;
  return high;
}

std::optional<int> PlanSearch::FewestFor(const std::string& group) const {
  const std::optional<std::size_t> count = Fewest({{group, options_.wanted.at(group)}});
  return count ? std::optional<int>(static_cast<int>(*count)) : std::nullopt;
}

std::vector<PlanSearch::Program> PlanSearch::BestPrograms(std::size_t count) const {
  std::vector<Program> programs = Programs(count, options_.wanted, kStarts);
  for (Program& program : programs) {
    if (!options_.grid.continuous) break;
    Program refined = Refined(program);
    refined.score = Score(refined, options_.wanted);
    if (refined.score < program.score) program = refined;
  }
  SortByScore(&programs);
  return programs;
}

std::vector<ProgramPose> PlanSearch::Find() const {
  auto count = static_cast<std::size_t>(options_.poses);
  if (count == 0) {
    const std::optional<std::size_t> fewest = Fewest(options_.wanted);
    count = fewest.value_or(static_cast<std::size_t>(options_.max_poses));
  }
  std::vector<Program> programs = BestPrograms(count);
  // All starts together, refined, may do with fewer than one of them showed.
  while (options_.poses == 0 && count > LeastCount() && programs.front().score <= kReached) {
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

}  // namespace truetriad
