// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>

#include <Eigen/Core>

#include "data/allan_theory.h"
#include "truetriad/data/allan.h"

namespace truetriad {

/// The four noises fitted to one curve, samples one unit of time apart.
struct AllanFit {
  /// Strengths of the noises that the data show; zero for the others.
  NoiseStrengths strengths = NoiseStrengths::Zero();
  /// 95 % interval of each strength that is shown.
  std::array<std::optional<Interval>, kNoiseTerms> shown;
  Eigen::Index first = 0;  ///< Factors before it do not follow the four noises and are left out.
  double misfit = 1.0;  ///< Scatter about the fit over that expected; the intervals allow for it.
  bool follows = true;  ///< The curve follows the four noises from `first` on.
};

/// Fits sigma^2(m) = sum_j strengths_j h_j(m), strengths >= 0, with weights by the degrees of
/// freedom and intervals from the covariance of the estimates. A noise is kept only when the curve
/// cannot be explained without it.
///
/// A sensor's filter takes noise from the shortest factors, which no sum of the four noises
/// describes: the fit starts at the first factor from which on it describes all others.
/// Quantisation is noise of the shortest factors and is looked for only when the fit holds them.
AllanFit FitNoises(const std::vector<AllanFactor>& factors,
                   const Eigen::VectorXd& variances,
                   const AllanCovariance& covariance);

/// White noise alone over the factors [begin, end), its covariance from the noises of `fit`.
Interval FitWhite(const std::vector<AllanFactor>& factors,
                  const Eigen::VectorXd& variances,
                  const AllanCovariance& covariance,
                  const NoiseStrengths& strengths,
                  Eigen::Index begin,
                  Eigen::Index end);

/// Factors [begin, end) over which the curve has the slope -1/2 to within 0.1, half a decade at a
/// time: the longest such part; begin == end when there is none.
struct FactorRange {
  Eigen::Index begin = 0, end = 0;
};
FactorRange WhitePart(const std::vector<AllanFactor>& factors, const Eigen::VectorXd& variances);

/// 95 % interval of a mean of squares of normal numbers with `degrees_of_freedom`.
Interval ChiSquareInterval(double value, double degrees_of_freedom);

}  // namespace truetriad
