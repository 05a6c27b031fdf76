// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

#include "allan/allan_curve.h"

namespace truetriad {

/// The power-law noises of a rate, and its steady drift. IEEE Std 952-1997, annex C.
enum NoiseTerm : int { kQuantisation, kWhite, kFlicker, kWalk, kRamp, kNoiseTerms };

/// Strength of each term as variances: Q^2, N^2, B^2, K^2, R^2 for samples one unit of time apart.
using NoiseStrengths = Eigen::Matrix<double, kNoiseTerms, 1>;
/// A quadratic form of the strengths.
using NoiseForm = Eigen::Matrix<double, kNoiseTerms, kNoiseTerms>;

/// Allan variance at averaging factor `m` of each term of strength one, samples one unit of time
/// apart: 3/m^2, 1/m, 2 ln 2/pi, m/3 + 1/(6 m) and m^2/2. The walk is sampled at instants, as by
/// sensors and simulators; the textbook's m/3 holds for a walk averaged over each sample.
NoiseStrengths UnitAllanVariance(double m);

/// The covariance of the estimated Allan variances of one log, at all factors, for any mixture of
/// the four noises and a ramp.
///
/// The second differences d of the summed readings x are Gaussian and stationary, and
///
///   E[d_m(t) d_n(t + u)] = sum_ab w_a w_b G(u + b n - a m),   a, b in {-1, 0, 1}, w = {1, -2, 1}
///
/// where G is the generalised autocovariance of x: a delta for quantisation, -|t|/2 for white
/// noise, t^2 ln|t| / 2 pi for flicker and (|t|^3 - |t|)/12 for the sampled walk. The covariance of
/// two means of squares is twice the mean of the squared covariances over all pairs of terms. C.
/// Greenhall and W. Riley, "Uncertainty of stability variances based on finite differences", PTTI
/// 2003; NIST SP 1065 derives degrees of freedom from the same theory, but with approximations, and
/// neither for mixtures nor between factors. All stretches are assumed to be equally long. A ramp R
/// t adds the constant R m^2 to each d_m. Its product with the mean noise in d_m is random, and
/// this mean follows from the two ends of a stretch.
class AllanCovariance {
 public:
  explicit AllanCovariance(const std::vector<AllanFactor>& factors);

  /// Variance of the estimate at factor i.
  double Variance(Eigen::Index i, const NoiseStrengths& strengths) const {
    return strengths.dot(forms_[static_cast<std::size_t>(i)].front() * strengths);
  }
  /// Covariance of the estimates at factors [begin, end).
  Eigen::MatrixXd Matrix(Eigen::Index begin,
                         Eigen::Index end,
                         const NoiseStrengths& strengths) const;

 private:
  /// forms_[i]: the covariances of factor i with itself and with larger factors. Factors that are
  /// far apart count as uncorrelated and have no entry.
  std::vector<std::vector<NoiseForm>> forms_;
};

}  // namespace truetriad
