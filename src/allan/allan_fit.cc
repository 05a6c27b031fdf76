// SPDX-License-Identifier: Apache-2.0
#include "allan/allan_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/LU>

#include "math/distributions.h"

namespace truetriad {
namespace {

/// Points of fewer degrees of freedom dip by chance: the minimum is looked for among the others.
constexpr double kFewestFreedomsOfMinimum = 8.0;
/// Of the deviation above that of single samples.
constexpr double kMostRise = 3.0;
// Of the 95 % intervals.
constexpr double kTail = 0.025;
/// A noise that is absent is shown this many sigmas above nothing hardly ever. The estimates at
/// long factors are skewed, so that three sigmas would not do.
constexpr double kShownSigmas = 4.0;
/// A curve follows the fit when every point is within so many sigmas, or within so much of the
/// variance: 6 % of it is 3 % of the deviation, finer than any use of a noise density.
constexpr double kMostSigmas = 4.0;
constexpr double kVarianceTolerance = 0.06;
/// Fewest points of a fit with up to five strengths.
constexpr Eigen::Index kFewestPoints = 8;
// A guard: weights settle within three or four.
constexpr int kReweightings = 12;
/// Of the tau over which white noise is looked for, last over first.
constexpr double kLeastWidth = 10.0;
// Chosen: its share falls as 1 / m against white noise; what is left out for longer is a filter.
constexpr Eigen::Index kLatestQuantisation = 2;
/// Neither filter nor rounding reaches further.
constexpr std::int64_t kLatestFilter = 100;
/// Share of the white noise that a filter may take at the first factor. A first-order filter of
/// time constant T takes 1.5 T / tau - 2 exp(-tau / T) T / tau: 0.3 is five time constants, where
/// the second part is 0.3 %. A mean of L samples takes L / 2m from m = L on.
constexpr double kMostFiltered = 0.3;
/// Of the variance of an estimate, that of white noise being one.
constexpr double kLeastSpread = 0.1;
/// A strength whose interval would span more than a decade is not worth stating: this is where
/// chi-square intervals begin to.
constexpr double kFewestTermFreedoms = 2.0;

constexpr auto kQ = static_cast<int>(NoiseTerm::kQuantisation);
constexpr auto kN = static_cast<int>(NoiseTerm::kWhite);

using Used = std::array<bool, kNoiseTerms>;
using Basis = Eigen::Matrix<double, Eigen::Dynamic, kNoiseTerms>;
using Normal = Eigen::Matrix<double, kNoiseTerms, kNoiseTerms>;

/// Linear estimate of the strengths, strengths = estimator * variances.
struct LinearFit {
  NoiseStrengths strengths = NoiseStrengths::Zero();
  Eigen::Matrix<double, kNoiseTerms, Eigen::Dynamic> estimator;
};

/// The points of a fit.
class Problem {
 public:
  Problem(const std::vector<AllanFactor>& factors,
          const Eigen::VectorXd& variances,
          const AllanCovariance& covariance,
          const FactorRange& range)
      : covariance_(covariance),
        range_(range),
        variances_(variances.segment(range.begin, range.end - range.begin)) {
    basis_.resize(variances_.size(), kNoiseTerms);
    relative_.resize(variances_.size());
    for (Eigen::Index i = 0; i < basis_.rows(); ++i) {
      const AllanFactor& factor = factors[static_cast<std::size_t>(range.begin + i)];
      basis_.row(i) = UnitAllanVariance(static_cast<double>(factor.m)).transpose();
      // White noise has about this variance of an estimate, relative to its square.
      relative_[i] = 1.5 * static_cast<double>(factor.m) /
                     (static_cast<double>(factor.terms) * static_cast<double>(factor.stride));
    }
  }

  /// Strengths of the terms in `allowed`, reweighted until they settle. With five terms all subsets
  /// can be tried: the best is the one of the smallest misfit.
  LinearFit Fit(const Used& allowed) const {
    Eigen::VectorXd weights = (relative_.array() * variances_.array().square()).inverse();
    NoiseStrengths strengths = NoiseStrengths::Zero();
    Normal inverse;
    for (int round = 0; round < kReweightings; ++round) {
      const NoiseStrengths before = strengths;
      strengths = BestSubset(allowed, weights, &inverse);
      if (strengths.isZero(0.0) || round + 1 == kReweightings || strengths.isApprox(before, 1e-6))
        break;
      weights = Deviations(strengths).cwiseAbs2().cwiseInverse();
    }
    LinearFit fit;
    fit.strengths = strengths;
    fit.estimator = inverse * basis_.transpose() * weights.asDiagonal();
    return fit;
  }

  /// Standard deviations of the estimates under these noises.
  Eigen::VectorXd Deviations(const NoiseStrengths& strengths) const {
    Eigen::VectorXd deviations(variances_.size());
    for (Eigen::Index i = 0; i < deviations.size(); ++i) {
      // A filter's share is rough within its memory: no estimate is better than that of full terms.
      const double expected = basis_.row(i) * strengths;
      deviations[i] = std::sqrt(std::max(covariance_.Variance(range_.begin + i, strengths),
                                         kLeastSpread * relative_[i] * expected * expected));
    }
    return deviations;
  }

  /// The noises that the data show, of those allowed: the least needed is dropped until all are
  /// needed. White noise goes last, if at all: it is what other noises are mistaken for.
  LinearFit FitShown() const {
    Used allowed;
    allowed.fill(true);
    LinearFit fit = Fit(allowed);
    for (;;) {
      for (std::size_t j = 0; j < kNoiseTerms; ++j) {
        allowed[j] = fit.strengths[static_cast<int>(j)] != 0.0;
      }
      std::optional<std::size_t> weakest;
      double least = kShownSigmas;
      for (std::size_t j = 0; j < kNoiseTerms; ++j) {
        // What is left out before the fit has its share in the first points, shown or not.
        if (!allowed[j] || (j == kQ && range_.begin > 0)) continue;
        Used without = allowed;
        without[j] = false;
        const LinearFit null = Fit(without);
        if (null.strengths.isZero(0.0)) continue;  // The only noise: it is there.
        const double sigma = Sigma(fit, static_cast<int>(j), null.strengths);
        const double sigmas = std::max(std::abs(fit.strengths[static_cast<int>(j)]) / sigma,
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
    return std::sqrt(
        std::max(0.0, row.dot(covariance_.Matrix(range_.begin, range_.end, strengths) * row)));
  }

  /// How far each point is from these noises, in sigmas of a normal distribution.
  /// E. Wilson and M. Hilferty, "The distribution of chi-square", PNAS 1931.
  Eigen::ArrayXd Distances(const NoiseStrengths& strengths) const {
    const Eigen::ArrayXd expected = basis_ * strengths;
    const Eigen::ArrayXd spread = (Deviations(strengths).array() / expected).square() / 9.0;
    const Eigen::ArrayXd roots = (variances_.array() / expected).pow(1.0 / 3.0);
    return (roots - (1.0 - spread)).abs() / spread.sqrt();
  }

  /// Whether the first point is within the memory of a filter.
  bool IsInFilter(const NoiseStrengths& strengths) const {
    return -strengths[kQ] * basis_(0, kQ) > kMostFiltered * strengths[kN] * basis_(0, kN);
  }

  /// Whether the points are no further from the fit than chance explains.
  bool IsByChance(const LinearFit& fit) const {
    return Distances(fit.strengths).maxCoeff() <= kMostSigmas && Misfit(fit) == 1.0;
  }

  /// Furthest point from the fit, in units of what is tolerated.
  double Worst(const NoiseStrengths& strengths) const {
    const Eigen::ArrayXd expected = basis_ * strengths;
    const Eigen::ArrayXd share = (variances_.array() - expected).abs() / expected;
    return (Distances(strengths) / kMostSigmas).min(share / kVarianceTolerance).maxCoeff();
  }

  /// Root of the weighted scatter about the fit over its expectation, at least one.
  double Misfit(const LinearFit& fit) const {
    const Eigen::MatrixXd covariance = covariance_.Matrix(range_.begin, range_.end, fit.strengths);
    const Eigen::VectorXd weights = Deviations(fit.strengths).cwiseAbs2().cwiseInverse();
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
  /// The non-negative strengths of least misfit, and the inverse of their normal equations.
  NoiseStrengths BestSubset(const Used& allowed,
                            const Eigen::VectorXd& weights,
                            Normal* inverse) const {
    // Columns of one size: the terms differ by many powers of ten.
    const Normal normal = basis_.transpose() * weights.asDiagonal() * basis_;
    const NoiseStrengths scale = normal.diagonal().cwiseSqrt().cwiseInverse();
    const Normal scaled = scale.asDiagonal() * normal * scale.asDiagonal();
    const NoiseStrengths right =
        scale.cwiseProduct(basis_.transpose() * weights.cwiseProduct(variances_));
    NoiseStrengths best = NoiseStrengths::Zero();
    Normal best_inverse = Normal::Zero();
    double most = 0.0;
    for (unsigned subset = 1; subset < (1U << kNoiseTerms); ++subset) {
      NoiseStrengths used;
      bool is_allowed = true;
      for (int j = 0; j < kNoiseTerms; ++j) {
        const bool is_used = (subset >> j & 1U) != 0;
        is_allowed = is_allowed && (!is_used || allowed[static_cast<std::size_t>(j)]);
        used[j] = is_used ? 1.0 : 0.0;
      }
      if (!is_allowed) continue;
      // Unused terms: rows of the identity with nothing on the right.
      Normal matrix = used.asDiagonal() * scaled * used.asDiagonal();
      matrix.diagonal() += NoiseStrengths::Ones() - used;
      const Eigen::LLT<Normal> factored(matrix);
      const NoiseStrengths solution = factored.solve(used.cwiseProduct(right));
      // The misfit falls by this much against no terms at all.
      const double gain = solution.dot(right);
      if (!(gain > most) || factored.info() != Eigen::Success) continue;
      const NoiseStrengths strengths = scale.cwiseProduct(solution);
      if (!IsPossible(strengths)) continue;
      most = gain;
      best = strengths;
      best_inverse = scale.asDiagonal() * Normal(factored.solve(Normal(used.asDiagonal()))) *
                     scale.asDiagonal();
    }
    *inverse = best_inverse;
    return best;
  }

  /// Quantisation stands for a filter's share as well, but not for more than there is.
  bool IsPossible(const NoiseStrengths& strengths) const {
    return strengths.tail<kNoiseTerms - 1>().minCoeff() >= 0.0 &&
           (strengths[kQ] >= 0.0 || (basis_ * strengths).minCoeff() > 0.0);
  }

  const AllanCovariance& covariance_;
  FactorRange range_;
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

/// Last factor of a range over its first; 1 if it is empty.
double Ratio(const std::vector<AllanFactor>& factors, const FactorRange& range) {
  if (range.begin == range.end) return 1.0;
  return static_cast<double>(factors[static_cast<std::size_t>(range.end - 1)].m) /
         static_cast<double>(factors[static_cast<std::size_t>(range.begin)].m);
}

/// The fit of one range.
struct Candidate {
  Candidate(const std::vector<AllanFactor>& factors,
            const Eigen::VectorXd& variances,
            const AllanCovariance& covariance,
            const FactorRange& of_range)
      : range(of_range),
        problem(factors, variances, covariance, of_range),
        fit(problem.FitShown()),
        worst(problem.Worst(fit.strengths)),
        in_filter(problem.IsInFilter(fit.strengths)),
        by_chance(!in_filter && problem.IsByChance(fit)) {}

  bool IsTolerable() const { return worst <= 1.0 && !in_filter; }

  AllanFit Finish() const {
    AllanFit result;
    result.strengths = fit.strengths;
    result.range = range;
    result.misfit = problem.Misfit(fit);
    result.follows = worst <= 1.0;
    result.by_chance = by_chance;
    for (int j = 0; j < kNoiseTerms; ++j) {
      if (!(fit.strengths[j] > 0.0) || (j == kN && in_filter)) continue;
      const double sigma = result.misfit * problem.Sigma(fit, j, fit.strengths);
      if (FreedomsOf(fit.strengths[j], sigma) < kFewestTermFreedoms) continue;
      const bool is_seen =
          j != kQ || range.begin == 0 ||
          (range.begin <= kLatestQuantisation && fit.strengths[j] > kShownSigmas * sigma);
      if (!is_seen) continue;
      result.shown[static_cast<std::size_t>(j)] = IntervalOf(fit.strengths[j], sigma);
    }
    return result;
  }

  FactorRange range;
  Problem problem;
  LinearFit fit;
  double worst;    ///< Furthest point, in units of what is tolerated.
  bool in_filter;  ///< So that white noise is not to be told.
  bool by_chance;
};

}  // namespace

Interval Root(const Interval& squared, double factor) {
  return {factor * std::sqrt(squared.value),
          factor * std::sqrt(squared.low),
          factor * std::sqrt(squared.high)};
}

std::optional<BiasInstability> Instability(const std::vector<AllanPoint>& points,
                                           bool can_only_fall) {
  const AllanPoint* lowest = nullptr;
  const AllanPoint* last = nullptr;
  for (const AllanPoint& point : points) {
    if (point.degrees_of_freedom < kFewestFreedomsOfMinimum) continue;
    last = &point;
    if (lowest == nullptr || point.deviation.value < lowest->deviation.value) lowest = &point;
  }
  if (lowest == nullptr) return std::nullopt;
  BiasInstability instability;
  instability.minimum = lowest->deviation;
  instability.coefficient =
      Scaled(lowest->deviation, 1.0 / std::sqrt(2.0 * std::numbers::ln2 / std::numbers::pi));
  instability.tau_s = lowest->tau_s;
  instability.at_end = lowest == last || can_only_fall;
  return instability;
}

bool RisesFar(const AllanAxis& axis) {
  return std::any_of(axis.points.begin(), axis.points.end(), [&](const AllanPoint& point) {
    return point.degrees_of_freedom >= kFewestFreedomsOfMinimum &&
           point.deviation.value >= kMostRise * axis.points.front().deviation.value;
  });
}

Interval ChiSquareInterval(double value, double degrees_of_freedom) {
  const double nu = degrees_of_freedom;
  // Beyond this the quantiles are those of the normal distribution to all digits that count.
  if (!(nu < 1e8)) return {value, value, value};
  return {value,
          value * nu / ChiSquareQuantile(1.0 - kTail, nu),
          value * nu / ChiSquareQuantile(kTail, nu)};
}

FactorRange WhitePart(const std::vector<AllanFactor>& factors, const Eigen::VectorXd& variances) {
  // Chosen: slopes that a person would take for -1/2 by eye.
  constexpr double kMostOff = 0.1;
  const double half_decade = std::sqrt(10.0);
  FactorRange longest, current;
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
    if (Ratio(factors, current) > Ratio(factors, longest)) longest = current;
  }
  return longest;
}

AllanFit FitNoises(const std::vector<AllanFactor>& factors,
                   const Eigen::VectorXd& variances,
                   const AllanCovariance& covariance) {
  if (variances.size() == 0 || !(variances.minCoeff() > 0.0)) return {};
  // The first start from which on chance explains all points, else the first tolerated one, else
  // the best.
  std::optional<Candidate> best;
  for (FactorRange range{0, variances.size()};; ++range.begin) {
    const bool is_late = factors[static_cast<std::size_t>(range.begin)].m > kLatestFilter;
    if (best && best->IsTolerable() && is_late) break;
    Candidate candidate(factors, variances, covariance, range);
    const bool is_settled = candidate.by_chance || (is_late && candidate.IsTolerable());
    if (is_settled || !best ||
        (!best->IsTolerable() && (candidate.IsTolerable() || candidate.worst < best->worst))) {
      best.emplace(std::move(candidate));
    }
    if (is_settled) break;
    if (variances.size() - range.begin <= kFewestPoints) break;
  }
  return best->Finish();
}

AllanFit FitWidestWhite(const std::vector<AllanFactor>& factors,
                        const Eigen::VectorXd& variances,
                        const AllanCovariance& covariance,
                        const AllanFit& whole) {
  if (variances.size() == 0 || !(variances.minCoeff() > 0.0)) return whole;
  AllanFit widest = whole;
  double width = whole.follows && whole.shown[static_cast<std::size_t>(kN)]
                     ? std::sqrt(Ratio(factors, WhiteRange(factors, whole)))
                     : 1.0;
  for (FactorRange range; range.begin < variances.size(); ++range.begin) {
    // One that ends later need not be looked for where an earlier start was not described.
    for (range.end = std::max(range.end, range.begin + kFewestPoints);
         range.end <= variances.size();
         ++range.end) {
      if (Ratio(factors, range) < std::max(kLeastWidth, width)) continue;
      const Candidate candidate(factors, variances, covariance, range);
      if (!candidate.by_chance) break;
      AllanFit fit = candidate.Finish();
      if (!fit.shown[static_cast<std::size_t>(kN)]) continue;
      const double white_width = Ratio(factors, WhiteRange(factors, fit));
      if (white_width <= width * (1.0 + 1e-9)) continue;
      width = white_width;
      widest = std::move(fit);
    }
  }
  return widest;
}

FactorRange WhiteRange(const std::vector<AllanFactor>& factors, const AllanFit& fit) {
  FactorRange white;
  for (Eigen::Index i = fit.range.begin; i < fit.range.end; ++i) {
    const NoiseStrengths parts = fit.strengths.cwiseProduct(
        UnitAllanVariance(static_cast<double>(factors[static_cast<std::size_t>(i)].m)));
    if (!(parts[kN] > 0.0) || parts[kN] < 0.5 * parts.cwiseAbs().sum()) continue;
    if (white.begin == white.end) white.begin = i;
    white.end = i + 1;
  }
  return white;
}

Interval FitWhite(const std::vector<AllanFactor>& factors,
                  const Eigen::VectorXd& variances,
                  const AllanCovariance& covariance,
                  const FactorRange& range) {
  const Eigen::Index count = range.end - range.begin;
  Eigen::VectorXd m(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    m[i] = static_cast<double>(factors[static_cast<std::size_t>(range.begin + i)].m);
  }
  // All of one white noise: the weights do not depend on its strength.
  NoiseStrengths white = NoiseStrengths::Zero();
  white[kN] = 1.0;
  const Eigen::MatrixXd unit =
      m.asDiagonal() * covariance.Matrix(range.begin, range.end, white) * m.asDiagonal();
  const Eigen::VectorXd estimates = m.cwiseProduct(variances.segment(range.begin, count));
  Eigen::VectorXd weights = unit.diagonal().cwiseInverse();
  weights /= weights.sum();
  const double strength = weights.dot(estimates);
  double variance = strength * strength * weights.dot(unit * weights);
  if (count > 1) {
    // A range that is not of slope -1/2 throughout says by its scatter how wrong the strength may
    // be. Chance alone reaches four times the expected scatter in one case of a hundred.
    const double scatter = weights.dot((estimates.array() - strength).square().matrix());
    const double expected = strength * strength * weights.dot(unit.diagonal()) - variance;
    if (scatter > 4.0 * expected && expected > 0.0) variance *= scatter / expected;
  }
  return IntervalOf(strength, std::sqrt(variance));
}

}  // namespace truetriad
