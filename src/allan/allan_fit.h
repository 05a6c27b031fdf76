// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "allan/allan_theory.h"
#include "truetriad/allan/allan.h"

namespace truetriad {

/// Factors [begin, end).
struct FactorRange {
  Eigen::Index begin = 0, end = 0;
};

/// The four noises and a ramp fitted to one curve, samples one unit of time apart.
struct AllanFit {
  /// Strengths of the terms that the data show; zero for the others. That of quantisation is
  /// negative when a filter takes noise from the short factors.
  NoiseStrengths strengths = NoiseStrengths::Zero();
  /// 95 % interval of each strength that is shown.
  std::array<std::optional<Interval>, kNoiseTerms> shown;
  FactorRange range;      ///< Factors outside do not follow the terms and are left out.
  double misfit = 1.0;    ///< Scatter about the fit over that expected; the intervals allow for it.
  bool follows = true;    ///< The curve follows the terms within `range`.
  bool by_chance = true;  ///< And is no further from them than chance explains.
};

/// Fits sigma^2(m) = sum_j strengths_j h_j(m), strengths >= 0, with weights by the degrees of
/// freedom and intervals from the covariance of the estimates. A term is kept only when the curve
/// cannot be explained without it.
///
/// A filter of any kind takes c/m^2 from white noise at factors beyond its memory: the strength of
/// quantisation may be negative, so that the white noise is that below the filter's corner. Within
/// its memory no sum describes the curve: the fit starts at the first factor from which on it
/// describes all others. Quantisation is looked for only when the fit holds the shortest factors.
AllanFit FitNoises(const std::vector<AllanFactor>& factors,
                   const Eigen::VectorXd& variances,
                   const AllanCovariance& covariance);

/// The same over a range of a decade or more, no further from the curve than chance explains, that
/// is more white than all else for longest: what is known of white noise when the curve ends
/// otherwise than in noise, as a slow cycle makes it. `whole`, the fit of all, when that follows
/// the curve over more than twice as many decades of white noise, or there is no such range.
AllanFit FitWidestWhite(const std::vector<AllanFactor>& factors,
                        const Eigen::VectorXd& variances,
                        const AllanCovariance& covariance,
                        const AllanFit& whole);

/// Factors, first to last, at which white noise is most of what `fit` says; may be empty.
FactorRange WhiteRange(const std::vector<AllanFactor>& factors, const AllanFit& fit);

/// White noise alone over the factors of `range`.
Interval FitWhite(const std::vector<AllanFactor>& factors,
                  const Eigen::VectorXd& variances,
                  const AllanCovariance& covariance,
                  const FactorRange& range);

/// Factors over which the curve has the slope -1/2 to within 0.1, half a decade at a time: the
/// longest such part; begin == end when there is none.
FactorRange WhitePart(const std::vector<AllanFactor>& factors, const Eigen::VectorXd& variances);

/// 95 % interval of a mean of squares of normal numbers with `degrees_of_freedom`.
Interval ChiSquareInterval(double value, double degrees_of_freedom);

// Of a variance that of the deviation.
Interval Root(const Interval& squared, double factor);

// From the minimum of the curve; unset without a point that can be relied on.
std::optional<BiasInstability> Instability(const std::vector<AllanPoint>& points,
                                           bool can_only_fall);

// As motion makes it, and noise at rest rarely does.
bool RisesFar(const AllanAxis& axis);

}  // namespace truetriad
