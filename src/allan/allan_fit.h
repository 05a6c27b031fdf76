// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "allan/allan_theory.h"
#include "truetriad/allan/allan.h"

namespace truetriad {

/// The estimated Allan variances of one axis; the unit of time is one sample.
struct AllanEstimates {
  const std::vector<AllanFactor>& factors;
  const AllanCovariance& covariance;
  Eigen::VectorXd variances;

  double m(Eigen::Index i) const {
    return static_cast<double>(factors[static_cast<std::size_t>(i)].m);
  }
};

/// Indices [begin, end) of consecutive averaging factors.
struct FactorRange {
  Eigen::Index begin = 0, end = 0;
  bool is_empty() const { return begin == end; }
};

/// The four noises and a ramp fitted to one curve.
struct AllanFit {
  /// Strengths of the terms that the data show; zero for the others. The strength of quantisation
  /// is negative if a filter removes noise at the short factors.
  NoiseStrengths strengths = NoiseStrengths::Zero();
  /// 95 % interval of each strength that is shown.
  std::array<std::optional<Interval>, kNoiseTerms> shown;
  FactorRange range;       ///< The fitted factors; elsewhere the curve differs from the fit.
  bool is_late = false;    ///< `range` begins where no filter and no rounding has any effect.
  bool in_filter = false;  ///< `range` begins in a filter's memory; white noise is undetermined.
  double misfit = 1.0;     ///< Scatter about the fit / expected scatter; widens the intervals.
  double worst = 0.0;      ///< Largest distance of a point from the fit, in units of the tolerance.
  bool by_chance = true;   ///< Chance explains the distance of the curve from the fit.

  /// The curve follows the terms within `range`.
  bool follows() const { return worst <= 1.0; }
};

/// Fits sigma^2(m) = sum_j strengths_j h_j(m), strengths >= 0, with weights by the degrees of
/// freedom and intervals from the covariance of the estimates. A term is kept only when the curve
/// cannot be explained without it.
///
/// A filter of any kind reduces the variance of white noise by c/m^2 at factors beyond its memory.
/// A negative quantisation describes this; the white noise is then that below the filter's corner
/// frequency. Within the filter's memory no sum of the terms describes the curve. The fit therefore
/// starts at the first factor from which a sum describes all further points. Quantisation is stated
/// only if the fit includes the shortest factors.
AllanFit FitNoises(const AllanEstimates& estimates);

struct WhiteNoise {
  std::optional<Interval> strength;
  FactorRange range;  ///< Factors at which white noise prevails; may be empty.
};
/// If chance explains `whole`, the fit of all factors, white noise is taken from it. If not, as
/// with a slow cycle, white noise is taken from the fits over a decade or more that chance
/// explains: from the fit in which white noise prevails over the most decades. If `whole` follows
/// the curve and white noise prevails in it over more than twice as many decades, `whole` is used
/// instead. If no such fit exists, white noise is fitted to the longest part of slope -1/2.
WhiteNoise FindWhite(const AllanEstimates& estimates, const AllanFit& whole);

/// The strength of white noise, fitted alone to the factors of `range`.
Interval FitWhite(const AllanEstimates& estimates, const FactorRange& range);

/// 95 % interval of a variance estimated as `value` with `degrees_of_freedom`.
Interval ChiSquareInterval(double value, double degrees_of_freedom);

/// Converts the interval of a variance to that of the deviation, times `factor`.
Interval Root(const Interval& squared, double factor);

/// Bias instability from the curve's minimum; unset if no point has enough degrees of freedom.
/// `can_only_fall`: whether the curve shows no noise that would make it level off or rise.
std::optional<BiasInstability> Instability(const std::vector<AllanPoint>& points,
                                           bool can_only_fall);

/// Whether the deviation rises to three times the deviation of single samples, as it does if the
/// unit moves.
bool RisesFar(const AllanAxis& axis);

}  // namespace truetriad
