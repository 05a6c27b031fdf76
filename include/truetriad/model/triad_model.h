// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <limits>
#include <type_traits>

#include <Eigen/Core>
#include <Eigen/LU>

#include "truetriad/model/terms.h"

namespace truetriad {

/// The model of one triad: from the true quantity to the reading of the chip, and back.
///
///   u     = sensitivity * truth                  input of each sensing axis
///   raw_i = u_i + sum of a_i f(u_i) + bias_i     response of the axis; terms a f of terms.h
///   truth = correction * u(raw - bias)           calibrated reading; correction = sensitivity^-1
///
/// Most chips have no axis terms: all are zero. Axis terms are functions of u, not of the truth,
/// since they belong to the sensing axis: neither u nor the terms change if the body frame is
/// rotated or the gains refer to another field strength.
///
/// Frame: truth is in the body frame; row i of sensitivity is sensing axis i there. Stored
/// column-major (Eigen).
/// Units: truth in m/s^2, rad/s or uT; raw, u and bias in the log's unit; sensitivity in raw per
/// true unit; the quadratic term per raw, the cubic per raw^2. The asymmetry a is a share of the
/// gain: where u > 0 the gain is 1 + a times the sensitivity's, where u < 0 it is 1 - a times.
/// Range: |asymmetry| < 1.
/// Gauge: static poses do not determine a common rotation of all rows; gauge.h has the conventions.
template <typename Scalar>
struct TriadModel {
  using Vector3 = Eigen::Matrix<Scalar, 3, 1>;
  using Matrix3 = Eigen::Matrix<Scalar, 3, 3>;

  Matrix3 sensitivity = Matrix3::Identity();
  Vector3 bias = Vector3::Zero();
  PerAxisTerm<Vector3> axis_terms = PerAxisTerm<Vector3>::All(Vector3::Zero());

  Vector3 RawFromTruth(const Vector3& truth) const {
    const Vector3 felt = sensitivity * truth;
    Vector3 raw = felt + bias;
    for (const AxisTermInfo& info : kAxisTerms) {
      const Vector3& a = axis_terms[info.term];
      for (int i = 0; i < 3; ++i) {
        if (IsThere(a[i])) raw[i] += a[i] * ValueOf(info.term, felt[i]);
      }
    }
    return raw;
  }

  /// Undefined (infinities) when the sensitivity is singular.
  Vector3 TruthFromRaw(const Vector3& raw) const { return Correction() * Felt(raw - bias); }

  Matrix3 Correction() const { return sensitivity.inverse(); }

  /// The u of `reading`, which is raw - bias: that root of u + sum of a f(u) = reading which tends
  /// to zero as the reading does. NaN if no u gives the reading.
  Vector3 Felt(const Vector3& reading) const {
    using std::sqrt;
    const Vector3& quadratic = axis_terms[AxisTerm::kQuadratic];
    const Vector3& asymmetry = axis_terms[AxisTerm::kAsymmetry];
    Vector3 felt = reading;
    for (int i = 0; i < 3; ++i) {
      if (IsThere(quadratic[i]) || IsThere(asymmetry[i])) {
        const Scalar gain = Scalar(1) + (reading[i] < Scalar(0) ? -asymmetry[i] : asymmetry[i]);
        felt[i] *= Scalar(2) / (gain + sqrt(gain * gain + Scalar(4) * quadratic[i] * reading[i]));
      }
      for (const AxisTermInfo& info : kAxisTerms) {
        if (info.is_closed_form || !IsThere(axis_terms[info.term][i])) continue;
        felt[i] = RootFrom(felt[i], i, reading[i]);
        break;
      }
    }
    return felt;
  }

  /// d raw / d u at u, axis by axis.
  Vector3 Slope(const Vector3& felt) const {
    Vector3 slope;
    for (int i = 0; i < 3; ++i) slope[i] = SlopeAt(i, felt[i]);
    return slope;
  }

 private:
  // Zero terms are skipped, which also keeps infinities unchanged. If the scalar has derivatives
  // (ceres::Jet), they are not skipped: a zero term has derivatives, too.
  static bool IsThere(const Scalar& a) {
    return !std::is_floating_point_v<Scalar> || a != Scalar(0);
  }

  Scalar SlopeAt(int i, const Scalar& felt) const {
    Scalar slope(1);
    for (const AxisTermInfo& info : kAxisTerms) {
      slope += axis_terms[info.term][i] * SlopeOf(info.term, felt);
    }
    return slope;
  }

  // Felt of one axis by Newton's method, kept between zero and the point where the slope is zero.
  Scalar RootFrom(const Scalar& start, int i, const Scalar& reading) const {
    using std::abs;
    constexpr int kMostSteps = 100;       // Bisection alone reaches 2^-53 in 53 steps.
    constexpr double kPrecision = 1e-14;  // Relative; 45 times the rounding.
    // From here on absolute values are used: the reading counts as positive.
    const Scalar sign(reading < Scalar(0) ? -1.0 : 1.0);
    Scalar low(0), high(std::numeric_limits<double>::infinity());
    Scalar size = sign * start;
    if (!(size > low)) size = sign * reading;  // `start` is NaN if the other terms have no root.
    for (int step = 0; step < kMostSteps; ++step) {
      const Scalar felt = sign * size;
      Scalar miss = felt - reading;
      for (const AxisTermInfo& info : kAxisTerms) {
        miss += axis_terms[info.term][i] * ValueOf(info.term, felt);
      }
      miss *= sign;
      const Scalar slope = SlopeAt(i, felt);
      const bool is_rising = slope > Scalar(0);
      Scalar next = size - miss / slope;
      if (is_rising && abs(next - size) <= Scalar(kPrecision) * size) return sign * next;
      (is_rising && miss < Scalar(0) ? low : high) = size;
      if (!is_rising || !(next > low && next < high)) next = Scalar(0.5) * (low + high);
      size = next;
    }
    return Scalar(std::numeric_limits<double>::quiet_NaN());
  }
};

/// Norm of a corrected reading minus the reference strength, true unit.
inline double NormError(const TriadModel<double>& model,
                        const Eigen::Vector3d& reading,
                        double strength) {
  return model.TruthFromRaw(reading).norm() - strength;
}

}  // namespace truetriad
