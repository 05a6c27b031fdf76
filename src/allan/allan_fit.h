// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "allan/allan_theory.h"
#include "truetriad/allan/allan.h"

namespace truetriad {

/// The estimated Allan variances of one axis, samples one unit of time apart.
struct AllanEstimates {
  const std::vector<AllanFactor>& factors;
  const AllanCovariance& covariance;
  Eigen::VectorXd variances;

  double m(Eigen::Index i) const {
    return static_cast<double>(factors[static_cast<std::size_t>(i)].m);
  }
};

/// Factors [begin, end).
struct FactorRange {
  Eigen::Index begin = 0, end = 0;
  bool is_empty() const { return begin == end; }
};

/// The four noises and a ramp fitted to one curve.
struct AllanFit {
  /// Strengths of the terms that the data show; zero for the others. That of quantisation is
  /// negative when a filter takes noise from the short factors.
  NoiseStrengths strengths = NoiseStrengths::Zero();
  /// 95 % interval of each strength that is shown.
  std::array<std::optional<Interval>, kNoiseTerms> shown;
  FactorRange range;       ///< Factors outside do not follow the terms and are left out.
  bool is_late = false;    ///< It starts where neither a filter nor rounding reaches.
  bool in_filter = false;  ///< It starts within a filter's memory: white noise is not determined.
  double misfit = 1.0;    ///< Scatter about the fit over that expected; the intervals allow for it.
  double worst = 0.0;     ///< Largest distance of a point, in units of the tolerance.
  bool by_chance = true;  ///< The curve is no further from the terms than chance explains.

  /// The curve follows the terms within `range`.
  bool follows() const { return worst <= 1.0; }
};

/// Fits sigma^2(m) = sum_j strengths_j h_j(m), strengths >= 0, with weights by the degrees of
/// freedom and intervals from the covariance of the estimates. A term is kept only when the curve
/// cannot be explained without it.
///
/// A filter of any kind takes c/m^2 from white noise at factors beyond its memory: the strength of
/// quantisation may be negative, so that the white noise is that below the filter's corner. Within
/// its memory no sum describes the curve: the fit starts at the first factor from which on it
/// describes all others. Quantisation is looked for only when the fit holds the shortest factors.
AllanFit FitNoises(const AllanEstimates& estimates);

struct WhiteNoise {
  std::optional<Interval> strength;
  FactorRange range;  ///< Where it is most of the variance; may be empty.
};
/// White noise by `whole`, the fit of all factors. Where chance does not explain all of that fit,
/// as with a slow cycle, white noise by the fit over a decade or more that chance explains and in
/// which white noise prevails over the widest range, unless `whole` follows the curve and its range
/// is more than twice as many decades; else by the longest part whose slope is -1/2.
WhiteNoise FindWhite(const AllanEstimates& estimates, const AllanFit& whole);

/// White noise alone over the factors of `range`.
Interval FitWhite(const AllanEstimates& estimates, const FactorRange& range);

/// 95 % interval of a mean of squares of normal numbers with `degrees_of_freedom`.
Interval ChiSquareInterval(double value, double degrees_of_freedom);

/// Converts the interval of a variance to that of the deviation, times `factor`.
Interval Root(const Interval& squared, double factor);

/// From the minimum of the curve; unset without a point of enough degrees of freedom.
std::optional<BiasInstability> Instability(const std::vector<AllanPoint>& points,
                                           bool can_only_fall);

/// Whether the deviation rises to three times that of single samples, as motion makes it do.
bool RisesFar(const AllanAxis& axis);

}  // namespace truetriad
