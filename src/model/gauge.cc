// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Geometry>
#include <Eigen/LU>

#include "base/named_values.h"
#include "math/dense/eigenvalues.h"
#include "truetriad/model/calibration.h"

namespace truetriad {
namespace {

constexpr NamedValues<Gauge, 4> kGauges = {{
    {Gauge::kAccelX, "accel-x"},
    {Gauge::kAccelZ, "accel-z"},
    {Gauge::kSymmetric, "symmetric"},
    {Gauge::kFixture, "fixture"},
}};

// Column `first` of the rotation lies along row `first` of the sensitivity, and column `second` in
// the plane of rows `first` and `second`. The third column completes a right-handed frame.
Eigen::Matrix3d TriangularRotation(const Eigen::Matrix3d& sensitivity,
                                   int first,
                                   int second,
                                   double axis_sign) {
  const Eigen::Vector3d a = axis_sign * sensitivity.row(first).transpose().normalized();
  Eigen::Vector3d b = sensitivity.row(second).transpose();
  b = axis_sign * (b - a * a.dot(b)).normalized();
  const int third = 3 - first - second;
  // (first, second, third) is an even permutation for (0, 1, 2) and an odd one for (2, 1, 0).
  const double parity = (second - first + 3) % 3 == 1 ? 1.0 : -1.0;
  Eigen::Matrix3d rotation;
  rotation.col(first) = a;
  rotation.col(second) = b;
  rotation.col(third) = parity * a.cross(b);
  return rotation;
}

// S = U W V^T, so S * (V U^T) = U W U^T is symmetric. If the triad is left-handed, the sign of the
// smallest eigenvalue is reversed, which gives the smallest proper rotation.
Eigen::Matrix3d SymmetricRotation(const Eigen::Matrix3d& sensitivity, double axis_sign) {
  const Svd3 svd = SvdOf3(sensitivity);
  Eigen::Vector3d signs = Eigen::Vector3d::Constant(axis_sign);
  Eigen::Matrix3d rotation = svd.V * signs.asDiagonal() * svd.U.transpose();
  if (rotation.determinant() > 0.0) return rotation;
  signs[2] = -signs[2];
  return svd.V * signs.asDiagonal() * svd.U.transpose();
}

}  // namespace

std::string_view GaugeName(Gauge gauge) { return kGauges.Name(gauge); }
std::optional<Gauge> GaugeFromName(std::string_view name) { return kGauges.Find(name); }

Eigen::Matrix3d GaugeRotation(Gauge gauge,
                              const Eigen::Matrix3d& leading_sensitivity,
                              double axis_sign) {
  switch (gauge) {
    case Gauge::kAccelX:
      return TriangularRotation(leading_sensitivity, 0, 1, axis_sign);
    case Gauge::kAccelZ:
      return TriangularRotation(leading_sensitivity, 2, 1, axis_sign);
    case Gauge::kSymmetric:
      return SymmetricRotation(leading_sensitivity, axis_sign);
    case Gauge::kFixture:
      break;
  }
  return Eigen::Matrix3d::Identity();
}

// S' = S Q changes by dS' = dS Q + S' [omega]_x. S' stays triangular if the other triangle of M +
// [omega]_x vanishes, with M = S'^-1 dS Q. S' = P stays symmetric if D + P [omega]_x is symmetric,
// with D = dS Q: then (tr(P) I - P) omega = -vee(D - D^T).
Eigen::Matrix<double, 3, 9> GaugeRotationJacobian(Gauge gauge,
                                                  const Eigen::Matrix3d& leading_sensitivity,
                                                  const Eigen::Matrix3d& rotation) {
  Eigen::Matrix<double, 3, 9> jacobian = Eigen::Matrix<double, 3, 9>::Zero();
  if (gauge == Gauge::kFixture) return jacobian;
  const Eigen::Matrix3d stated = leading_sensitivity * rotation;
  const Eigen::Matrix3d inverse = stated.inverse();
  const Eigen::Matrix3d symmetric_factor =
      (stated.trace() * Eigen::Matrix3d::Identity() - stated).inverse();
  for (int entry = 0; entry < 9; ++entry) {
    const int row = entry % 3;
    const int col = entry / 3;
    Eigen::Matrix3d D = Eigen::Matrix3d::Zero();
    D.row(row) = rotation.row(col);
    if (gauge == Gauge::kSymmetric) {
      const Eigen::Vector3d skew(D(2, 1) - D(1, 2), D(0, 2) - D(2, 0), D(1, 0) - D(0, 1));
      jacobian.col(entry) = -symmetric_factor * skew;
      continue;
    }
    const Eigen::Matrix3d M = inverse * D;
    jacobian.col(entry) = gauge == Gauge::kAccelX ? Eigen::Vector3d(M(1, 2), -M(0, 2), M(0, 1))
                                                  : Eigen::Vector3d(-M(2, 1), M(2, 0), -M(1, 0));
  }
  return jacobian;
}

}  // namespace truetriad
