// SPDX-License-Identifier: Apache-2.0
#include "sweep/sweep_regression.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "base/messages.h"
#include "math/dense/products.h"
#include "math/dense/qr.h"
#include "math/distributions.h"
#include "sweep/sweep_fit.h"

namespace truetriad {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
// A term is tested only if the terms in the regression leave this share of its RMS unexplained. At
// 0.1 they make its variance 100 times as large.
constexpr double kShareOfItsOwn = 0.1;
// If readings of attitudes differ by less than this share of the largest, they count as equal.
constexpr double kOtherReading = 0.05;
// Most steps: far more than the number of terms, which is at most 21.
constexpr int kMostSteps = 60;
// Relative rounding of sums of 1e4 products, 1e-16 each.
constexpr double kRounding = 1e-12;

constexpr std::array<const char*, kRegressionFactors> kLetters = {"r", "tau", "T'", "A", "A'"};
constexpr std::array<const char*, kRegressionFactors> kUnits = {
    "", "degC", "degC/s", "degC", "degC/s"};

// A term as the product of up to two factors, which are given by their numbers; -1 means no factor.
struct Product {
  int first = -1, second = -1;

  bool Has(int factor) const { return first == factor || second == factor; }
  std::string Name() const {
    if (first < 0) return "1";
    const std::string name = kLetters[static_cast<std::size_t>(first)];
    if (second < 0) return name;
    if (second == first) return name + "^2";
    return name + " " + kLetters[static_cast<std::size_t>(second)];
  }
  // The unit of the term's coefficient, for a reading in `raw_unit`.
  std::string Unit(const std::string& raw_unit) const {
    constexpr int kReading = static_cast<int>(RegressionFactor::kReading);
    const int readings = (first == kReading ? 1 : 0) + (second == kReading ? 1 : 0);
    std::vector<std::string> below;
    for (const int factor : {first, second}) {
      if (factor >= 0 && factor != kReading) {
        below.emplace_back(kUnits[static_cast<std::size_t>(factor)]);
      }
    }
    const std::string above = readings == 0 ? raw_unit : "1";
    if (readings == 2) return "1/(" + raw_unit + ")";
    if (below.empty()) return above;
    if (below.size() == 1) return above + (below[0] == "degC" ? "/degC" : "/(" + below[0] + ")");
    return above + "/((" + below[0] + ")(" + below[1] + "))";
  }
};

// The constant, the factors, then their products: r r, r tau, …
std::vector<Product> AllProducts(const ThermalOptions& wanted) {
  std::vector<int> factors;
  for (std::size_t f = 0; f < kRegressionFactors; ++f) {
    if (wanted.regression[f]) factors.push_back(static_cast<int>(f));
  }
  std::vector<Product> products = {{}};
  for (const int factor : factors) products.push_back({factor, -1});
  for (std::size_t i = 0; i < factors.size(); ++i) {
    for (std::size_t j = i; j < factors.size(); ++j) products.push_back({factors[i], factors[j]});
  }
  return products;
}

// Partial test of one column beside others.
struct PartialTest {
  double f = 0.0, p_value = 1.0;
  double own_share = 0.0;  // share of the column's size that the others do not explain
};

class Regression {
 public:
  Regression(const SweepProblem& problem, int axis, const ThermalOptions& wanted)
      : problem_(problem), products_(AllProducts(wanted)) {
    const int size = problem.size();
    Eigen::MatrixXd factors = Eigen::MatrixXd::Zero(size, kRegressionFactors);
    const bool needs_ambient = wanted.has_factor(RegressionFactor::kAmbient) ||
                               wanted.has_factor(RegressionFactor::kAmbientRate);
    const double reference = problem.scale().reference_degc;
    weights_ = problem.weights();
    for (int i = 0; i < size; ++i) {
      const StaticPose& window = problem.window(i);
      const Eigen::Vector2d ambient =
          needs_ambient ? problem.AmbientOf(i) : Eigen::Vector2d(reference, 0.0);
      if (!ambient.allFinite()) {
        weights_[i] = 0.0;
        continue;
      }
      ++windows_;
      factors.row(i) << 0.0, *window.temperature_degc - reference, window.temperature_rate_degcps,
          ambient[0] - reference, ambient[1];
    }
    used_ = (weights_.array() > 0.0).cast<double>();
    root_ = weights_.cwiseSqrt();
    reading_ = used_.cwiseProduct(problem.readings().row(axis).transpose());
    constants_ = Eigen::MatrixXd::Zero(size, problem.attitude_count());
    for (int i = 0; i < size; ++i) {
      constants_(i, problem.attitudes()[static_cast<std::size_t>(i)]) = used_[i];
    }
    SetLevels(LevelOfAttitudes(axis), &factors);
    // The level of an attitude is its reading at the reference temperature, where all temperature
    // factors are zero. Some columns contain levels, and the regression estimates them as well, so
    // that each round uses the levels of the round before. Chosen: 8 rounds.
    constexpr int kRounds = 8;
    for (int round = 0; round < kRounds && products_.size() > 1; ++round) {
      const Eigen::VectorXd level = FitColumns(With(candidates_), reading_, weights_)
                                        .coefficients.head(problem.attitude_count())
                                        .array() +
                                    problem.origin()[axis];
      // If a level moves by more than a fifth of the largest level, the levels are poorly
      // determined and are not changed.
      constexpr double kMuch = 0.2;
      const Eigen::VectorXd before = levels_;
      if ((level - before).cwiseAbs().maxCoeff() > kMuch * before.cwiseAbs().maxCoeff()) break;
      SetLevels(level, &factors);
    }
    EstimateNoise(axis);
  }

  SweepRegression Run(const ThermalOptions& wanted, const std::string& raw_unit) {
    SweepRegression result;
    for (std::size_t f = 0; f < kRegressionFactors; ++f) {
      if (wanted.regression[f]) result.factors.emplace_back(kLetters[f]);
    }
    result.windows = windows_;
    const double share = 1.0 / std::max<double>(1.0, static_cast<double>(candidates_.size()));
    result.enter_p = kEnterRegression * share;
    result.leave_p = kLeaveRegression * share;
    // If there are fewer than three windows per term, nothing is tested.
    if (windows_ >= 3 * static_cast<int>(products_.size())) Step(&result);
    Describe(raw_unit, &result);
    return result;
  }

 private:
  // Sets the columns for these levels, the readings of the attitudes.
  void SetLevels(const Eigen::VectorXd& levels, Eigen::MatrixXd* factors) {
    levels_ = levels;
    for (int i = 0; i < problem_.size(); ++i) {
      (*factors)(i, 0) = used_[i] * levels[problem_.attitudes()[static_cast<std::size_t>(i)]];
    }
    scale_ = factors->cwiseAbs().colwise().maxCoeff().transpose().cwiseMax(1e-300);
    const Eigen::MatrixXd standard = *factors * scale_.cwiseInverse().asDiagonal();
    columns_.resize(problem_.size(), static_cast<Eigen::Index>(products_.size()));
    for (std::size_t t = 0; t < products_.size(); ++t) {
      Eigen::VectorXd column = used_;
      for (const int factor : {products_[t].first, products_[t].second}) {
        if (factor >= 0) column.array() *= standard.col(factor).array();
      }
      columns_.col(static_cast<Eigen::Index>(t)) = column;
    }
    NameUntold(levels, *factors);
  }

  // First estimate of each attitude's reading at the reference temperature: its windows' mean.
  Eigen::VectorXd LevelOfAttitudes(int axis) const {
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(problem_.attitude_count()), count = sum;
    for (int i = 0; i < problem_.size(); ++i) {
      const int attitude = problem_.attitudes()[static_cast<std::size_t>(i)];
      sum[attitude] += problem_.readings()(axis, i) + problem_.origin()[axis];
      count[attitude] += 1.0;
    }
    return sum.cwiseQuotient(count.cwiseMax(1.0));
  }

  // Separates the candidates from the terms that no sweep, or not this one, can determine.
  void NameUntold(const Eigen::VectorXd& level, const Eigen::MatrixXd& factors) {
    candidates_.clear(), untold_.clear();
    constexpr int kReading = static_cast<int>(RegressionFactor::kReading);
    const bool one_reading =
        level.maxCoeff() - level.minCoeff() < kOtherReading * level.cwiseAbs().maxCoeff();
    for (std::size_t t = 0; t < products_.size(); ++t) {
      const Product& term = products_[t];
      std::string why;
      const bool of_reading_alone =
          term.first == kReading && (term.second < 0 || term.second == kReading);
      if (term.first < 0 || of_reading_alone) {
        why =
            "not determined by a sweep, since the constant of each attitude absorbs it; a static "
            "calibration determines it";
      } else if (term.Has(kReading) && one_reading) {
        why =
            "all attitudes read the same on this axis, so terms with r cannot be separated from "
            "those without; add an attitude in which the axis reads another value";
      }
      for (const int factor : {term.first, term.second}) {
        if (factor <= kReading || !why.empty()) continue;
        const double change = factors.col(factor).maxCoeff() - factors.col(factor).minCoeff();
        if (!(change > 0.0)) {
          why = std::string(kLetters[static_cast<std::size_t>(factor)]) + " does not change";
        }
      }
      if (why.empty()) candidates_.push_back(static_cast<int>(t));
      untold_.push_back(std::move(why));
    }
  }

  // The residuals of a fit with all candidates are the noise. Residuals of a fit with few terms
  // also contain the missing terms, which would then keep each other from entering.
  void EstimateNoise(int axis) {
    const Eigen::MatrixXd all = With(candidates_);
    noise_ = FitColumns(all, reading_, weights_).residuals;
    correlation_ = CorrelationOf(noise_, problem_.attitudes());
    const auto columns = static_cast<double>(all.cols());
    noise_ *= std::sqrt(windows_ / std::max(1.0, windows_ - columns));
    dof_ = std::max(1.0, EffectiveCount(windows_, correlation_) - columns);
    rounding_ =
        kRounding * (root_.cwiseProduct(reading_).norm() +
                     std::abs(problem_.origin()[axis]) * std::sqrt(static_cast<double>(windows_)));
  }

  // The columns of the constants, followed by those of `terms`.
  Eigen::MatrixXd With(const std::vector<int>& terms) const {
    Eigen::MatrixXd columns(constants_.rows(), constants_.cols() + std::ssize(terms));
    columns << constants_, columns_(Eigen::all, terms);
    return columns;
  }

  // Tests each column `tested` beside those in `others` (Frisch and Waugh 1933: estimate and
  // covariance depend only on the residuals of column and reading after a regression on the
  // others).
  std::vector<PartialTest> TestBeside(const std::vector<int>& others,
                                      const std::vector<int>& tested) const {
    const Eigen::MatrixXd beside = root_.asDiagonal() * With(others);
    const LeastSquares qr(beside);
    const auto left = [&](const Eigen::VectorXd& weighted) -> Eigen::VectorXd {
      return weighted - TimesVector(beside, qr.SolveVector(weighted));
    };
    const Eigen::VectorXd reading = left(root_.cwiseProduct(reading_));
    std::vector<PartialTest> tests;
    for (const int term : tested) {
      PartialTest& test = tests.emplace_back();
      const Eigen::VectorXd whole = root_.cwiseProduct(columns_.col(term));
      const Eigen::VectorXd own = left(whole);
      test.own_share = whole.norm() > 0.0 ? own.norm() / whole.norm() : 0.0;
      if (test.own_share < kRounding) continue;
      const double slope = own.dot(reading) / own.squaredNorm();
      if (std::abs(slope) * own.norm() <= rounding_) continue;
      const Eigen::VectorXd scores = own.cwiseProduct(root_).cwiseProduct(noise_);
      const double variance = LongRunCovariance(scores, correlation_)(0, 0);
      test.f = std::pow(own.dot(reading), 2) / std::max(variance, rounding_ * rounding_);
      test.p_value = 1.0 - FisherCdf(test.f, 1.0, dof_);
    }
    return tests;
  }

  static std::vector<int> Without(std::vector<int> terms, int term) {
    std::erase(terms, term);
    return terms;
  }

  void Step(SweepRegression* result) {
    Note("start", kNan, 1.0, result);
    std::set<std::vector<int>> seen = {chosen_};
    for (int step = 0; step < kMostSteps; ++step) {
      std::vector<int> open;
      for (const int term : candidates_) {
        if (std::find(chosen_.begin(), chosen_.end(), term) == chosen_.end()) open.push_back(term);
      }
      const std::vector<PartialTest> tests = TestBeside(chosen_, open);
      int best = -1;
      for (std::size_t i = 0; i < tests.size(); ++i) {
        const bool enters =
            tests[i].p_value < result->enter_p && tests[i].own_share >= kShareOfItsOwn;
        if (enters && (best < 0 || tests[i].f > tests[static_cast<std::size_t>(best)].f)) {
          best = static_cast<int>(i);
        }
      }
      if (best < 0) break;
      const PartialTest& test = tests[static_cast<std::size_t>(best)];
      const int entered = open[static_cast<std::size_t>(best)];
      chosen_.push_back(entered);
      Note("+ " + NameOf(entered), test.f, test.p_value, result);
      while (Remove(entered, result)) {
      }
      std::vector<int> sorted = chosen_;
      std::sort(sorted.begin(), sorted.end());
      if (!seen.insert(sorted).second)
        break;  // This set of terms was chosen before, so that the
                // steps would repeat.
    }
    std::sort(chosen_.begin(), chosen_.end());
  }

  // Removes the least significant term that has to leave, except `entered`. False: there is none.
  bool Remove(int entered, SweepRegression* result) {
    int worst = -1;
    PartialTest least;
    for (const int term : chosen_) {
      if (term == entered) continue;
      const PartialTest test = TestBeside(Without(chosen_, term), {term}).front();
      if (test.p_value <= result->leave_p || (worst >= 0 && test.f >= least.f)) continue;
      worst = term;
      least = test;
    }
    if (worst < 0) return false;
    chosen_ = Without(chosen_, worst);
    Note("- " + NameOf(worst), least.f, least.p_value, result);
    return true;
  }

  ColumnFit Fit() const { return FitColumns(With(chosen_), reading_, weights_); }

  std::string NameOf(int term) const { return products_[static_cast<std::size_t>(term)].Name(); }

  void Note(const std::string& what, double f, double p, SweepRegression* result) const {
    const ColumnFit fit = Fit();
    const ColumnFit constants = FitColumns(constants_, reading_, weights_);
    const double n = windows_;
    const auto columns =
        static_cast<double>(constants_.cols()) + static_cast<double>(chosen_.size());
    RegressionStep& step = result->steps.emplace_back();
    step.what = what;
    step.terms = static_cast<int>(chosen_.size());
    step.f = f;
    step.p_value = p;
    step.r2 = constants.weighted_square > 0.0
                  ? 1.0 - fit.weighted_square / constants.weighted_square
                  : 0.0;
    step.adjusted_r2 =
        1.0 - (1.0 - step.r2) * (n - static_cast<double>(constants_.cols())) / (n - columns);
    const double effective = EffectiveCount(n, CorrelationOf(fit.residuals, problem_.attitudes()));
    step.bic = effective * std::log(std::max(fit.weighted_square, 1e-300) / n) +
               columns * std::log(effective);
    step.held_out = HeldOutRms();
  }

  double HeldOutRms() const {
    const Eigen::MatrixXd columns = With(chosen_);
    Eigen::MatrixX3d readings = Eigen::MatrixX3d::Zero(columns.rows(), 3);
    readings.col(0) = reading_;
    const std::vector<SweepBlock> blocks =
        SumFolds(problem_.fold_begin(), columns, readings, weights_);
    std::vector<int> all(static_cast<std::size_t>(columns.cols()));
    std::iota(all.begin(), all.end(), 0);
    double sum = 0.0;
    for (int fold = 0; fold < problem_.fold_count(); ++fold) {
      sum += HeldOutSquare(blocks, all, problem_.attitude_count(), 0, fold);
    }
    return std::sqrt(std::max(sum, 0.0) / std::max(1, windows_));
  }

  void Describe(const std::string& raw_unit, SweepRegression* result) const {
    const ColumnFit fit = Fit();
    result->rms = std::sqrt(fit.residuals.squaredNorm() / std::max(1, windows_));
    const Eigen::MatrixXd covariance =
        SandwichCovariance(With(chosen_), weights_, fit.residuals, problem_.attitudes(), windows_);
    for (std::size_t t = 0; t < products_.size(); ++t) {
      const Product& product = products_[t];
      RegressionTerm& term = result->terms.emplace_back();
      term.name = product.Name();
      term.unit = product.Unit(raw_unit);
      term.why = untold_[t];
      term.f = kNan;
      if (!term.why.empty()) continue;
      const auto place = std::find(chosen_.begin(), chosen_.end(), static_cast<int>(t));
      term.chosen = place != chosen_.end();
      if (windows_ < 3 * static_cast<int>(products_.size())) {
        term.why = "not tested: too few windows have values of all factors";
        continue;
      }
      const PartialTest test =
          TestBeside(Without(chosen_, static_cast<int>(t)), {static_cast<int>(t)}).front();
      if (!term.chosen && test.own_share < kShareOfItsOwn) {
        term.why = Format("not tested: only %.1f %% of it is independent of the chosen terms",
                          100.0 * test.own_share);
        continue;
      }
      term.f = test.f;
      term.p_value = test.p_value;
      if (!term.chosen) continue;
      double physical = 1.0;
      for (const int factor : {product.first, product.second}) {
        if (factor >= 0) physical /= scale_[factor];
      }
      const Eigen::Index at = constants_.cols() + (place - chosen_.begin());
      term.coefficient = physical * fit.coefficients[at];
      term.sigma = physical * std::sqrt(std::max(0.0, covariance(at, at)));
    }
  }

  const SweepProblem& problem_;
  std::vector<Product> products_;
  int windows_ = 0;
  Eigen::VectorXd weights_, root_, used_, reading_, scale_, levels_;
  Eigen::MatrixXd constants_, columns_;  // standardised; zero if a window lacks a factor
  Eigen::VectorXd noise_;                // residuals that serve as noise
  double correlation_ = 0.0, dof_ = 1.0, rounding_ = 0.0;
  std::vector<int> candidates_, chosen_;
  std::vector<std::string> untold_;  // why each product is no candidate; empty for candidates
};

}  // namespace

SweepRegression RegressSweep(const SweepProblem& problem,
                             int axis,
                             const ThermalOptions& wanted,
                             const std::string& raw_unit) {
  return Regression(problem, axis, wanted).Run(wanted, raw_unit);
}

}  // namespace truetriad
