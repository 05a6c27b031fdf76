// SPDX-License-Identifier: Apache-2.0
#include "allan/allan_fit.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/LU>

#include "math/distributions.h"

namespace truetriad {
namespace {

/// If a point has fewer degrees of freedom, the σ of its deviation exceeds 25 %, and the point
/// could be the curve's minimum by chance.
constexpr double kFewestFreedomsOfMinimum = 8.0;
/// A noise is stated if it is over this many sigmas above zero. A curve follows the fit if every
/// point is within as many sigmas. Three would not suffice, since the estimates at long factors are
/// skewed.
constexpr double kMostSigmas = 4.0;
/// A point also follows the fit if its variance differs from the fit by less than this share. 6 %
/// of the variance is 3 % of the deviation, less than matters in any use of a noise density.
constexpr double kVarianceTolerance = 0.06;
/// Fewest points of a fit: five strengths are fitted, and three degrees of freedom remain.
constexpr Eigen::Index kFewestPoints = 8;
/// Chosen: neither a filter nor rounding affects larger factors.
constexpr double kLatestFilter = 100.0;
/// Share of the white noise that a filter may remove at the first factor. A first-order filter of
/// time constant T removes 1.5 T / tau - 2 exp(-tau / T) T / tau: 0.3 at tau = 5 T, where the
/// second term is 0.3 %. A mean of L samples removes L / 2m at m >= L.
constexpr double kMostFiltered = 0.3;
/// If a strength has fewer degrees of freedom, it is not stated. With two, the 95 % interval of the
/// deviation spans a factor of 12.
constexpr double kFewestTermFreedoms = 2.0;

using Used = std::array<bool, kNoiseTerms>;
using Basis = Eigen::Matrix<double, Eigen::Dynamic, kNoiseTerms>;

/// Linear estimate of the strengths, strengths = estimator * variances.
struct LinearFit {
  NoiseStrengths strengths = NoiseStrengths::Zero();
  Eigen::Matrix<double, kNoiseTerms, Eigen::Dynamic> estimator;
};

/// The fit of the terms to the points of one range.
class Problem {
 public:
  Problem(const AllanEstimates& estimates, const FactorRange& range)
      : covariance_(estimates.covariance),
        range_(range),
        variances_(estimates.variances.segment(range.begin, range.end - range.begin)) {
    basis_.resize(variances_.size(), kNoiseTerms);
    relative_.resize(variances_.size());
    for (Eigen::Index i = 0; i < basis_.rows(); ++i) {
      const AllanFactor& factor = estimates.factors[static_cast<std::size_t>(range.begin + i)];
      basis_.row(i) = UnitAllanVariance(static_cast<double>(factor.m)).transpose();
      // Approximate relative variance of an estimate for white noise.
      relative_[i] = 1.5 * static_cast<double>(factor.m) /
                     (static_cast<double>(factor.terms) * static_cast<double>(factor.stride));
    }
  }

  const Basis& basis() const { return basis_; }

  /// Strengths of the terms in `allowed`, reweighted until they settle, which takes three or four
  /// rounds.
  LinearFit Fit(const Used& allowed) const {
    Eigen::VectorXd weights = (relative_.array() * variances_.array().square()).inverse();
    LinearFit fit;
    for (int rounds_left = 12;; --rounds_left) {
      NoiseForm inverse = NoiseForm::Zero();
      const NoiseStrengths before =
          std::exchange(fit.strengths, BestSubset(allowed, weights, &inverse));
      if (fit.strengths.isZero(0.0) || rounds_left == 1 || fit.strengths.isApprox(before, 1e-6)) {
        fit.estimator = inverse * basis_.transpose() * weights.asDiagonal();
        return fit;
      }
      weights = Deviations(fit.strengths).cwiseAbs2().cwiseInverse();
    }
  }

  /// The noises that the data show: the least significant one is dropped until all are significant.
  LinearFit FitShown() const {
    Used allowed;
    allowed.fill(true);
    for (;;) {
      LinearFit fit = Fit(allowed);
      std::optional<std::size_t> weakest;
      double least = kMostSigmas;
      for (std::size_t j = 0; j < kNoiseTerms; ++j) {
        const double strength = fit.strengths[static_cast<int>(j)];
        allowed[j] = strength != 0.0;
      }
      for (std::size_t j = 0; j < kNoiseTerms; ++j) {
        // If the fit begins at a later factor, it keeps quantisation, which describes noises that
        // affect only its first points.
        if (!allowed[j] || (j == kQuantisation && range_.begin > 0)) continue;
        Used without = allowed;
        without[j] = false;
        const NoiseStrengths null = Fit(without).strengths;
        if (null.isZero(0.0)) continue;  // Without this term no noise is left.
        const auto term = static_cast<NoiseTerm>(j);
        const double sigmas = std::max(std::abs(fit.strengths[term]) / Sigma(fit, term, null),
                                       Distances(null).maxCoeff());
        if (sigmas < least) least = sigmas, weakest = j;
      }
      if (!weakest) return fit;
      allowed[*weakest] = false;
    }
  }

  /// Standard deviation of the strength of a term if the noises are `strengths`.
  double Sigma(const LinearFit& fit, NoiseTerm term, const NoiseStrengths& strengths) const {
    const Eigen::VectorXd row = fit.estimator.row(term).transpose();
    return std::sqrt(
        std::max(0.0, row.dot(covariance_.Matrix(range_.begin, range_.end, strengths) * row)));
  }

  /// Distance of each point from the curve of `strengths`, in sigmas of a normal distribution.
  /// E. Wilson and M. Hilferty, "The distribution of chi-square", PNAS 1931.
  Eigen::ArrayXd Distances(const NoiseStrengths& strengths) const {
    const Eigen::ArrayXd expected = basis_ * strengths;
    const Eigen::ArrayXd spread = (Deviations(strengths).array() / expected).square() / 9.0;
    const Eigen::ArrayXd roots = (variances_.array() / expected).pow(1.0 / 3.0);
    return (roots - (1.0 - spread)).abs() / spread.sqrt();
  }

  /// Largest distance of a point from the curve of `strengths`, in units of the tolerance.
  double Worst(const NoiseStrengths& strengths) const {
    const Eigen::ArrayXd expected = basis_ * strengths;
    const Eigen::ArrayXd share = (variances_.array() - expected).abs() / expected;
    return (Distances(strengths) / kMostSigmas).min(share / kVarianceTolerance).maxCoeff();
  }

  /// The square root of weighted scatter over expected scatter; 1 if chance explains the scatter.
  double Misfit(const LinearFit& fit) const {
    const Eigen::MatrixXd covariance = covariance_.Matrix(range_.begin, range_.end, fit.strengths);
    const Eigen::VectorXd weights = Deviations(fit.strengths).cwiseAbs2().cwiseInverse();
    const Eigen::MatrixXd residual_maker =
        Eigen::MatrixXd::Identity(basis_.rows(), basis_.rows()) - basis_ * fit.estimator;
    const Eigen::MatrixXd weighted =
        weights.asDiagonal() * (residual_maker * covariance * residual_maker.transpose()).eval();
    const double mean = weighted.trace();
    // Scatter within four sigmas of its expectation is chance.
    const double spread = std::sqrt(2.0 * (weighted * weighted).trace());
    const Eigen::VectorXd residuals = variances_ - basis_ * fit.strengths;
    const double scatter = weights.dot(residuals.cwiseAbs2().eval());
    return scatter > mean + 4.0 * spread ? std::sqrt(scatter / mean) : 1.0;
  }

 private:
  /// Standard deviations of the estimates if the noises are `strengths`.
  Eigen::VectorXd Deviations(const NoiseStrengths& strengths) const {
    Eigen::VectorXd deviations(variances_.size());
    for (Eigen::Index i = 0; i < deviations.size(); ++i) {
      // Within a filter's memory the computed effect of the filter is inaccurate. The variance of
      // an estimate is therefore set to at least a tenth of that for white noise.
      const double expected = basis_.row(i) * strengths;
      deviations[i] = std::sqrt(std::max(covariance_.Variance(range_.begin + i, strengths),
                                         0.1 * relative_[i] * expected * expected));
    }
    return deviations;
  }

  /// The non-negative strengths of least misfit, and the inverse of their normal equations. With
  /// five terms all subsets can be tried.
  NoiseStrengths BestSubset(const Used& allowed,
                            const Eigen::VectorXd& weights,
                            NoiseForm* inverse) const {
    // The columns are scaled to equal size, since the terms differ by many powers of ten.
    const NoiseForm normal = basis_.transpose() * weights.asDiagonal() * basis_;
    const NoiseStrengths scale = normal.diagonal().cwiseSqrt().cwiseInverse();
    const NoiseForm scaled = scale.asDiagonal() * normal * scale.asDiagonal();
    const NoiseStrengths right =
        scale.cwiseProduct(basis_.transpose() * weights.cwiseProduct(variances_));
    NoiseStrengths best = NoiseStrengths::Zero();
    double most = 0.0;
    for (unsigned subset = 1; subset < (1U << kNoiseTerms); ++subset) {
      NoiseStrengths used;
      bool is_allowed = true;
      for (int j = 0; j < kNoiseTerms; ++j) {
        used[j] = (subset >> j & 1U) != 0 ? 1.0 : 0.0;
        is_allowed = is_allowed && (used[j] == 0.0 || allowed[static_cast<std::size_t>(j)]);
      }
      if (!is_allowed) continue;
      // An unused term gets a row of the identity and a right-hand side of zero.
      NoiseForm matrix = used.asDiagonal() * scaled * used.asDiagonal();
      matrix.diagonal() += NoiseStrengths::Ones() - used;
      const Eigen::LLT<NoiseForm> factored(matrix);
      const NoiseStrengths solution = factored.solve(used.cwiseProduct(right));
      // The decrease of the weighted sum of squares relative to a fit without any term.
      const double gain = solution.dot(right);
      if (!(gain > most) || factored.info() != Eigen::Success) continue;
      const NoiseStrengths strengths = scale.cwiseProduct(solution);
      if (!IsPossible(strengths)) continue;
      most = gain;
      best = strengths;
      *inverse = scale.asDiagonal() * NoiseForm(factored.solve(NoiseForm(used.asDiagonal()))) *
                 scale.asDiagonal();
    }
    return best;
  }

  /// Whether the strengths are possible: only quantisation may be negative, as with a filter, and
  /// all expected variances must be positive.
  bool IsPossible(const NoiseStrengths& strengths) const {
    return strengths.tail<kNoiseTerms - 1>().minCoeff() >= 0.0 &&
           (strengths[kQuantisation] >= 0.0 || (basis_ * strengths).minCoeff() > 0.0);
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

/// The last factor of a range divided by its first one; 1 if the range is empty.
double Ratio(const AllanEstimates& estimates, const FactorRange& range) {
  return range.is_empty() ? 1.0 : estimates.m(range.end - 1) / estimates.m(range.begin);
}

AllanFit FitRange(const AllanEstimates& estimates, const FactorRange& range) {
  const Problem problem(estimates, range);
  const LinearFit fit = problem.FitShown();
  const NoiseStrengths& strengths = fit.strengths;
  AllanFit result;
  result.strengths = strengths;
  result.range = range;
  result.is_late = estimates.m(range.begin) > kLatestFilter;
  result.in_filter = -strengths[kQuantisation] * problem.basis()(0, kQuantisation) >
                     kMostFiltered * strengths[kWhite] * problem.basis()(0, kWhite);
  result.misfit = problem.Misfit(fit);
  result.worst = problem.Worst(strengths);
  result.by_chance = !result.in_filter && result.misfit == 1.0 &&
                     problem.Distances(strengths).maxCoeff() <= kMostSigmas;
  for (const NoiseTerm term : {kQuantisation, kWhite, kFlicker, kWalk, kRamp}) {
    const double strength = strengths[term];
    if (!(strength > 0.0) || (term == kWhite && result.in_filter)) continue;
    const double sigma = result.misfit * problem.Sigma(fit, term, strengths);
    const double freedoms = FreedomsOf(strength, sigma);
    if (freedoms < kFewestTermFreedoms) continue;
    // Relative to white noise, quantisation falls as 1 / m. If the fit leaves out more than two
    // factors, it does so because of a filter, and the term is not quantisation.
    if (term == kQuantisation && range.begin > 0 &&
        (range.begin > 2 || !(strength > kMostSigmas * sigma))) {
      continue;
    }
    result.shown[static_cast<std::size_t>(term)] = ChiSquareInterval(strength, freedoms);
  }
  return result;
}

/// The first to the last factor at which white noise is at least half of the variance of `fit`.
FactorRange WhiteRange(const AllanEstimates& estimates, const AllanFit& fit) {
  FactorRange white;
  for (Eigen::Index i = fit.range.begin; i < fit.range.end; ++i) {
    const NoiseStrengths parts = fit.strengths.cwiseProduct(UnitAllanVariance(estimates.m(i)));
    if (!(parts[kWhite] > 0.0) || parts[kWhite] < 0.5 * parts.cwiseAbs().sum()) continue;
    if (white.is_empty()) white.begin = i;
    white.end = i + 1;
  }
  return white;
}

/// Considers the fits over a decade or more whose misfit chance explains. Returns the fit in which
/// white noise prevails over the most decades, or `whole`, if white noise prevails in it over more
/// than twice as many decades. Without this, a cycle of 1.5 s makes N 1.8 times too large (two of
/// three simulated axes).
AllanFit FitWidestWhite(const AllanEstimates& estimates, const AllanFit& whole) {
  AllanFit widest = whole;
  double width = whole.follows() && whole.shown[kWhite]
                     ? std::sqrt(Ratio(estimates, WhiteRange(estimates, whole)))
                     : 1.0;
  for (FactorRange range; range.begin < estimates.variances.size(); ++range.begin) {
    // For each begin, the search starts at the end at which the previous begin failed, since
    // earlier ends give narrower ranges.
    for (range.end = std::max(range.end, range.begin + kFewestPoints);
         range.end <= estimates.variances.size();
         ++range.end) {
      if (Ratio(estimates, range) < std::max(10.0, width)) continue;
      AllanFit fit = FitRange(estimates, range);
      if (!fit.by_chance) break;
      if (!fit.shown[kWhite]) continue;
      const double white_width = Ratio(estimates, WhiteRange(estimates, fit));
      if (white_width <= width * (1.0 + 1e-9)) continue;
      width = white_width;
      widest = std::move(fit);
    }
  }
  return widest;
}

/// The longest part in which the slope of the curve over each half decade is -1/2 to within 0.1, as
/// a person would choose it by eye. Without this, two of three accelerometer axes of the ADIS16405,
/// which have a cycle, show no N.
FactorRange WhitePart(const AllanEstimates& estimates) {
  const double half_decade = std::sqrt(10.0);
  const Eigen::VectorXd& variances = estimates.variances;
  FactorRange longest, current;
  for (Eigen::Index first = 0, last = 0; first < variances.size(); ++first) {
    while (last < variances.size() && estimates.m(last) < half_decade * estimates.m(first)) ++last;
    if (last == variances.size()) break;
    // The slope of the deviation is half that of the variance.
    const double slope = 0.5 * std::log(variances[last] / variances[first]) /
                         std::log(estimates.m(last) / estimates.m(first));
    if (!(std::abs(slope + 0.5) <= 0.1)) {
      current = {};
      continue;
    }
    current = {current.is_empty() ? first : current.begin, last + 1};
    if (Ratio(estimates, current) > Ratio(estimates, longest)) longest = current;
  }
  return longest;
}

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
  const double per_minimum = 1.0 / std::sqrt(2.0 * std::numbers::ln2 / std::numbers::pi);
  return BiasInstability{.coefficient = Scaled(lowest->deviation, per_minimum),
                         .minimum = lowest->deviation,
                         .tau_s = lowest->tau_s,
                         .at_end = lowest == last || can_only_fall};
}

bool RisesFar(const AllanAxis& axis) {
  return std::any_of(axis.points.begin(), axis.points.end(), [&](const AllanPoint& point) {
    return point.degrees_of_freedom >= kFewestFreedomsOfMinimum &&
           point.deviation.value >= 3.0 * axis.points.front().deviation.value;
  });
}

Interval ChiSquareInterval(double value, double degrees_of_freedom) {
  const double nu = degrees_of_freedom;
  // With more degrees of freedom, the interval is within 0.03 % of the value and neglected.
  if (!(nu < 1e8)) return {value, value, value};
  return {
      value, value * nu / ChiSquareQuantile(0.975, nu), value * nu / ChiSquareQuantile(0.025, nu)};
}

AllanFit FitNoises(const AllanEstimates& estimates) {
  const Eigen::Index end = estimates.variances.size();
  if (end == 0 || !(estimates.variances.minCoeff() > 0.0)) return {};
  // Takes the fit from the first `begin` at which chance explains its misfit. If there is none:
  // from the first `begin` at which the fit is tolerable. If there is none either: the best fit.
  const auto is_tolerable = [](const AllanFit& fit) { return fit.follows() && !fit.in_filter; };
  AllanFit best;
  for (Eigen::Index begin = 0;; ++begin) {
    AllanFit fit = FitRange(estimates, {begin, end});
    if (begin > 0 && is_tolerable(best) && fit.is_late) return best;
    const bool is_settled = fit.by_chance || (fit.is_late && is_tolerable(fit));
    if (is_settled || begin == 0 ||
        (!is_tolerable(best) && (is_tolerable(fit) || fit.worst < best.worst))) {
      best = std::move(fit);
    }
    if (is_settled || end - begin <= kFewestPoints) return best;
  }
}

Interval FitWhite(const AllanEstimates& estimates, const FactorRange& range) {
  Used white{};
  white[kWhite] = true;
  const Problem problem(estimates, range);
  const LinearFit fit = problem.Fit(white);
  // If the slope differs from -1/2 in the range, the scatter about the fit widens the interval.
  const double misfit = range.end - range.begin > 1 ? problem.Misfit(fit) : 1.0;
  const double strength = fit.strengths[kWhite];
  return ChiSquareInterval(
      strength, FreedomsOf(strength, misfit * problem.Sigma(fit, kWhite, fit.strengths)));
}

WhiteNoise FindWhite(const AllanEstimates& estimates, const AllanFit& whole) {
  const AllanFit used =
      whole.by_chance && !whole.is_late ? whole : FitWidestWhite(estimates, whole);
  const std::optional<Interval>& strength = used.shown[kWhite];
  if (strength && (used.by_chance || (used.follows() && !used.is_late))) {
    return {strength, WhiteRange(estimates, used)};
  }
  const FactorRange part = WhitePart(estimates);
  return part.is_empty() ? WhiteNoise{strength, {}} : WhiteNoise{FitWhite(estimates, part), part};
}

}  // namespace truetriad
