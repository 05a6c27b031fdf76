// SPDX-License-Identifier: Apache-2.0
#include "data/allan_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <Eigen/Dense>

#include "truetriad/math/distributions.h"

namespace truetriad {
namespace {

constexpr double kTail = 0.025;
/// A noise that is absent is shown this many sigmas above nothing hardly ever. The estimates at
/// long factors are skewed, so that three sigmas would not do.
constexpr double kShownSigmas = 4.0;
/// A curve follows the fit when every point is within so many sigmas, or within so much of the
/// variance: 6 % of it is 3 % of the deviation, finer than any use of a noise density.
constexpr double kMostSigmas = 4.0;
constexpr double kTolerance = 0.06;
/// Fewest points of a fit with up to four strengths.
constexpr Eigen::Index kFewestPoints = 8;
constexpr int kRounds = 12;
constexpr Eigen::Index kLatestQuantisation = 2;
/// A strength whose interval would span more than a decade is not worth stating: this is where
/// chi-square intervals begin to.
constexpr double kFewestFreedoms = 2.0;

using Used = std::array<bool, kNoiseTerms>;
using Basis = Eigen::Matrix<double, Eigen::Dynamic, kNoiseTerms>;

/// Linear estimate of the strengths, strengths = estimator * variances.
struct LinearFit {
  NoiseStrengths strengths = NoiseStrengths::Zero();
  Eigen::Matrix<double, kNoiseTerms, Eigen::Dynamic> estimator;
};

/// Weighted least squares with the noises in `used`.
LinearFit Solve(const Basis& basis,
                const Eigen::VectorXd& variances,
                const Eigen::VectorXd& weights,
                const Used& used) {
  std::vector<int> columns;
  for (int j = 0; j < kNoiseTerms; ++j) {
    if (used[static_cast<std::size_t>(j)]) columns.push_back(j);
  }
  LinearFit fit;
  fit.estimator = decltype(fit.estimator)::Zero(kNoiseTerms, basis.rows());
  if (columns.empty()) return fit;
  const Eigen::VectorXd root = weights.cwiseSqrt();
  Eigen::MatrixXd rows = root.asDiagonal() * basis(Eigen::all, columns);
  // Columns of one size: the noises differ by many powers of ten.
  const Eigen::RowVectorXd scale = rows.colwise().norm();
  rows.array().rowwise() /= scale.array();
  const Eigen::MatrixXd solution = rows.householderQr().solve(Eigen::MatrixXd(root.asDiagonal()));
  for (std::size_t c = 0; c < columns.size(); ++c) {
    const auto row = static_cast<Eigen::Index>(c);
    fit.estimator.row(columns[c]) = solution.row(row) / scale[row];
  }
  fit.strengths = fit.estimator * variances;
  return fit;
}

/// The points of a fit.
class Problem {
 public:
  Problem(const std::vector<AllanFactor>& factors,
          const Eigen::VectorXd& variances,
          const AllanCovariance& covariance,
          Eigen::Index first)
      : covariance_(covariance),
        first_(first),
        variances_(variances.tail(variances.size() - first)) {
    basis_.resize(variances_.size(), kNoiseTerms);
    relative_.resize(variances_.size());
    for (Eigen::Index i = 0; i < basis_.rows(); ++i) {
      const AllanFactor& factor = factors[static_cast<std::size_t>(first + i)];
      basis_.row(i) = UnitAllanVariance(static_cast<double>(factor.m)).transpose();
      // White noise has about this variance of an estimate, relative to its square.
      relative_[i] = 1.5 * static_cast<double>(factor.m) /
                     (static_cast<double>(factor.terms) * static_cast<double>(factor.stride));
    }
  }

  /// Non-negative strengths of the noises in `allowed`, reweighted until they settle. With four
  /// noises all subsets can be tried: the best is the one of the smallest misfit.
  LinearFit Fit(const Used& allowed) const {
    Eigen::VectorXd weights = (relative_.array() * variances_.array().square()).inverse();
    LinearFit best;
    for (int round = 0; round < kRounds; ++round) {
      const NoiseStrengths before = best.strengths;
      double least = std::numeric_limits<double>::infinity();
      for (unsigned subset = 0; subset < (1U << kNoiseTerms); ++subset) {
        Used used{};
        bool is_allowed = true;
        for (std::size_t j = 0; j < kNoiseTerms; ++j) {
          used[j] = (subset >> j & 1U) != 0;
          is_allowed = is_allowed && (!used[j] || allowed[j]);
        }
        if (!is_allowed) continue;
        LinearFit fit = Solve(basis_, variances_, weights, used);
        if (fit.strengths.minCoeff() < 0.0) continue;
        const double cost = weights.dot((variances_ - basis_ * fit.strengths).cwiseAbs2().eval());
        if (cost < least) least = cost, best = std::move(fit);
      }
      if (best.strengths.isZero(0.0)) return best;
      if ((best.strengths - before).cwiseAbs().maxCoeff() <=
              1e-9 * best.strengths.cwiseAbs().maxCoeff() &&
          best.strengths.isApprox(before, 1e-6)) {
        break;
      }
      weights = Deviations(best.strengths).cwiseAbs2().cwiseInverse();
    }
    return best;
  }

  /// Standard deviations of the estimates under these noises.
  Eigen::VectorXd Deviations(const NoiseStrengths& strengths) const {
    Eigen::VectorXd deviations(variances_.size());
    for (Eigen::Index i = 0; i < deviations.size(); ++i) {
      deviations[i] = std::sqrt(covariance_.Variance(first_ + i, strengths));
    }
    return deviations;
  }

  /// The noises that the data show, of those allowed: the least needed is dropped until all are
  /// needed. White noise goes last, if at all: it is what other noises are mistaken for.
  LinearFit FitShown() const {
    Used allowed = {first_ <= kLatestQuantisation, true, true, true};
    LinearFit fit = Fit(allowed);
    for (;;) {
      for (std::size_t j = 0; j < kNoiseTerms; ++j) {
        allowed[j] = fit.strengths[static_cast<int>(j)] > 0.0;
      }
      std::optional<std::size_t> weakest;
      double least = kShownSigmas;
      for (std::size_t j = 0; j < kNoiseTerms; ++j) {
        if (!allowed[j]) continue;
        Used without = allowed;
        without[j] = false;
        const LinearFit null = Fit(without);
        if (null.strengths.isZero(0.0)) continue;  // The only noise: it is there.
        const double sigma = Sigma(fit, static_cast<int>(j), null.strengths);
        const double sigmas = std::max(fit.strengths[static_cast<int>(j)] / sigma,
                                       Distances(null.strengths).maxCoeff());
        if (sigmas < least) least = sigmas, weakest = j;
      }
      if (!weakest) return fit;
      allowed[*weakest] = false;
      fit = Fit(allowed);
    }
  }

  /// Standard deviation of strength j if the noises are `strengths`.
  double Sigma(const LinearFit& fit, int j, const NoiseStrengths& strengths) const {
    const Eigen::VectorXd row = fit.estimator.row(j).transpose();
    return std::sqrt(std::max(0.0, row.dot(covariance_.Matrix(first_, strengths) * row)));
  }

  /// How far each point is from these noises, in sigmas of a normal distribution.
  /// E. Wilson and M. Hilferty, "The distribution of chi-square", PNAS 1931.
  Eigen::ArrayXd Distances(const NoiseStrengths& strengths) const {
    const Eigen::ArrayXd expected = basis_ * strengths;
    const Eigen::ArrayXd spread = (Deviations(strengths).array() / expected).square() / 9.0;
    const Eigen::ArrayXd roots = (variances_.array() / expected).pow(1.0 / 3.0);
    return (roots - (1.0 - spread)).abs() / spread.sqrt();
  }

  /// Furthest point from the fit, in units of what is tolerated.
  double Worst(const NoiseStrengths& strengths) const {
    const Eigen::ArrayXd expected = basis_ * strengths;
    const Eigen::ArrayXd share = (variances_.array() - expected).abs() / expected;
    return (Distances(strengths) / kMostSigmas).min(share / kTolerance).maxCoeff();
  }

  /// Root of the weighted scatter about the fit over its expectation, at least one.
  double Misfit(const LinearFit& fit) const {
    const Eigen::MatrixXd covariance = covariance_.Matrix(first_, fit.strengths);
    const Eigen::VectorXd weights = covariance.diagonal().cwiseInverse();
    const Eigen::MatrixXd residual_maker =
        Eigen::MatrixXd::Identity(basis_.rows(), basis_.rows()) - basis_ * fit.estimator;
    const Eigen::MatrixXd expected = residual_maker * covariance * residual_maker.transpose();
    const Eigen::MatrixXd weighted = weights.asDiagonal() * expected;
    const double mean = weighted.trace();
    // Scatter that chance explains is not held against the fit.
    const double spread = std::sqrt(2.0 * (weighted * weighted).trace());
    const Eigen::VectorXd residuals = variances_ - basis_ * fit.strengths;
    const double scatter = weights.dot(residuals.cwiseAbs2().eval());
    return scatter > mean + 4.0 * spread ? std::sqrt(scatter / mean) : 1.0;
  }

 private:
  const AllanCovariance& covariance_;
  Eigen::Index first_;
  Eigen::VectorXd variances_;
  Eigen::VectorXd relative_;
  Basis basis_;
};

double FreedomsOf(double strength, double sigma) {
  return 2.0 * strength * strength / (sigma * sigma);
}

Interval IntervalOf(double strength, double sigma) {
  return ChiSquareInterval(strength, FreedomsOf(strength, sigma));
}

}  // namespace

Interval ChiSquareInterval(double value, double degrees_of_freedom) {
  const double nu = degrees_of_freedom;
  // Beyond this the quantiles are those of the normal distribution to all digits that count.
  if (!(nu < 1e8)) return {value, value, value};
  return {value,
          value * nu / ChiSquareQuantile(1.0 - kTail, nu),
          value * nu / ChiSquareQuantile(kTail, nu)};
}

FactorRange WhitePart(const std::vector<AllanFactor>& factors, const Eigen::VectorXd& variances) {
  constexpr double kMostOff = 0.1;
  const double half_decade = std::sqrt(10.0);
  FactorRange longest, current;
  const auto length = [&](const FactorRange& range) {
    if (range.begin == range.end) return 1.0;
    return static_cast<double>(factors[static_cast<std::size_t>(range.end - 1)].m) /
           static_cast<double>(factors[static_cast<std::size_t>(range.begin)].m);
  };
  Eigen::Index last = 0;
  for (Eigen::Index first = 0; first < variances.size(); ++first) {
    const auto m = [&](Eigen::Index i) {
      return static_cast<double>(factors[static_cast<std::size_t>(i)].m);
    };
    while (last < variances.size() && m(last) < half_decade * m(first)) ++last;
    if (last == variances.size()) break;
    // Half the slope of the variance is that of the deviation.
    const double slope =
        0.5 * std::log(variances[last] / variances[first]) / std::log(m(last) / m(first));
    if (!(std::abs(slope + 0.5) <= kMostOff)) {
      current = {};
      continue;
    }
    if (current.begin == current.end) current.begin = first;
    current.end = last + 1;
    if (length(current) > length(longest)) longest = current;
  }
  return longest;
}

AllanFit FitNoises(const std::vector<AllanFactor>& factors,
                   const Eigen::VectorXd& variances,
                   const AllanCovariance& covariance) {
  AllanFit best;
  if (variances.size() == 0 || !(variances.minCoeff() > 0.0)) return best;
  LinearFit best_fit;
  double best_worst = std::numeric_limits<double>::infinity();
  for (Eigen::Index first = 0;; ++first) {
    const Problem problem(factors, variances, covariance, first);
    LinearFit fit = problem.FitShown();
    const double worst = problem.Worst(fit.strengths);
    if (worst < best_worst) {
      best_worst = worst;
      best.first = first;
      best_fit = std::move(fit);
    }
    if (best_worst <= 1.0 || variances.size() - first <= kFewestPoints) break;
  }
  best.follows = best_worst <= 1.0;
  best.strengths = best_fit.strengths;
  const Problem problem(factors, variances, covariance, best.first);
  best.misfit = problem.Misfit(best_fit);
  for (int j = 0; j < kNoiseTerms; ++j) {
    if (!(best.strengths[j] > 0.0)) continue;
    const double sigma = best.misfit * problem.Sigma(best_fit, j, best_fit.strengths);
    if (FreedomsOf(best.strengths[j], sigma) < kFewestFreedoms) continue;
    best.shown[static_cast<std::size_t>(j)] = IntervalOf(best.strengths[j], sigma);
  }
  return best;
}

Interval FitWhite(const std::vector<AllanFactor>& factors,
                  const Eigen::VectorXd& variances,
                  const AllanCovariance& covariance,
                  const NoiseStrengths& strengths,
                  Eigen::Index begin,
                  Eigen::Index end) {
  const Eigen::Index count = end - begin;
  Eigen::VectorXd estimates(count), weights(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const auto m = static_cast<double>(factors[static_cast<std::size_t>(begin + i)].m);
    estimates[i] = variances[begin + i] * m;
    weights[i] = 1.0 / (covariance.Variance(begin + i, strengths) * m * m);
  }
  weights /= weights.sum();
  const double strength = weights.dot(estimates);
  Eigen::VectorXd gains(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    gains[i] = weights[i] * static_cast<double>(factors[static_cast<std::size_t>(begin + i)].m);
  }
  const Eigen::MatrixXd matrix = covariance.Matrix(begin, strengths).topLeftCorner(count, count);
  double variance = gains.dot(matrix * gains);
  if (count > 1) {
    // A range that is not of slope -1/2 throughout says by its scatter how wrong the strength may
    // be. Chance alone reaches four times the expected scatter in one case of a hundred.
    const double scatter = weights.dot((estimates.array() - strength).square().matrix());
    const double expected =
        (matrix.diagonal().array() * gains.array().square() / weights.array()).sum() - variance;
    if (scatter > 4.0 * expected && expected > 0.0) variance *= scatter / expected;
  }
  return IntervalOf(strength, std::sqrt(variance));
}

}  // namespace truetriad
