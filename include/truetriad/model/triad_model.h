// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include <Eigen/Core>
#include <Eigen/LU>

namespace truetriad {

/// One triad: what the chip reports for a true field, and back.
///
///   u     = sensitivity * truth                                   what each sensing axis feels
///   raw_i = u_i + quadratic_i u_i^2 + asymmetry_i |u_i| + bias_i  what the chip does
///   truth = correction * u(raw - bias)                  what we ship; correction = sensitivity^-1
///
/// Most chips have no higher terms: quadratic and asymmetry are zero then. The terms are in u
/// and not in the truth because they belong to the sensing axis: a rotation of the body frame, or
/// another strength of the field that the gains are relative to, leaves u as it is, and with it the
/// terms.
///
/// Frame: truth is in the body frame; row i of sensitivity is sensing axis i there. Stored
/// column-major (Eigen).
/// Units: truth in m/s^2, rad/s or uT; raw, u and bias in the log's unit; sensitivity in raw per
/// true unit; quadratic per raw; asymmetry a share of the gain, which is (1 + a) times the
/// sensitivity's where u > 0 and (1 - a) times where u < 0. Range: |asymmetry| < 1.
/// Gauge: static poses cannot see a common rotation of all rows; see gauge.h for which convention
/// holds.
template <typename Scalar>
struct TriadModel {
  using Vector3 = Eigen::Matrix<Scalar, 3, 1>;
  using Matrix3 = Eigen::Matrix<Scalar, 3, 3>;

  Matrix3 sensitivity = Matrix3::Identity();
  Vector3 bias = Vector3::Zero();
  Vector3 quadratic = Vector3::Zero();
  Vector3 asymmetry = Vector3::Zero();

  Vector3 RawFromTruth(const Vector3& truth) const {
    const Vector3 felt = sensitivity * truth;
    Vector3 raw = felt + bias;
    // Where there is no term, infinities stay what they are.
    for (int i = 0; i < 3; ++i) {
      if (quadratic[i] != Scalar(0)) raw[i] += quadratic[i] * felt[i] * felt[i];
      if (asymmetry[i] != Scalar(0))
        raw[i] += asymmetry[i] * (felt[i] < Scalar(0) ? -felt[i] : felt[i]);
    }
    return raw;
  }

  /// Undefined (infinities) when the sensitivity is singular.
  Vector3 TruthFromRaw(const Vector3& raw) const { return Correction() * Felt(raw - bias); }

  Matrix3 Correction() const { return sensitivity.inverse(); }

  /// u of a reading less the bias: the root of u + quadratic u^2 + asymmetry |u| = reading that
  /// goes to zero with it. NaN where no u gives the reading.
  Vector3 Felt(const Vector3& reading) const {
    using std::sqrt;
    Vector3 felt = reading;
    for (int i = 0; i < 3; ++i) {
      if (quadratic[i] == Scalar(0) && asymmetry[i] == Scalar(0)) continue;
      const Scalar gain = Scalar(1) + (reading[i] < Scalar(0) ? -asymmetry[i] : asymmetry[i]);
      felt[i] *= Scalar(2) / (gain + sqrt(gain * gain + Scalar(4) * quadratic[i] * reading[i]));
    }
    return felt;
  }

  /// d raw / d u at u, axis by axis; at the kink u = 0 of the asymmetry the mean of both sides.
  Vector3 Slope(const Vector3& felt) const {
    const Vector3 sign =
        felt.unaryExpr([](Scalar u) { return Scalar((u > Scalar(0)) - (u < Scalar(0))); });
    return Vector3::Ones() + Scalar(2) * quadratic.cwiseProduct(felt) +
           asymmetry.cwiseProduct(sign);
  }
};

/// Norm of a corrected reading minus the reference strength, true unit.
inline double NormError(const TriadModel<double>& model,
                        const Eigen::Vector3d& reading,
                        double strength) {
  return model.TruthFromRaw(reading).norm() - strength;
}

}  // namespace truetriad
