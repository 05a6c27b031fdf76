// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string_view>

#include <Eigen/Core>

namespace truetriad {

/// Which of the equivalent body frames a result is stated in. Static readings leave one common
/// rotation of all triads undetermined; the leading triad fixes it. docs/method.md, "Gauge".
enum class Gauge {
  kAccelX,     ///< Leading sensitivity lower triangular: body x along the x sensing axis.
  kAccelZ,     ///< Leading sensitivity upper triangular. Tedaldi et al. 2014.
  kSymmetric,  ///< Leading sensitivity symmetric: the least rotation.
  kFixture,    ///< Known attitudes define the body frame: leading sensitivity full.
};

std::string_view GaugeName(Gauge gauge);
std::optional<Gauge> GaugeFromName(std::string_view name);

/// The rotation Q for which `sensitivity * Q` has the form that `gauge` asks of the leading triad.
/// `axis_sign` (+1, or -1 for a chip that reports gravity) is the sign of the first two (accel-x)
/// or the last two (accel-z) diagonal entries; the sign of the remaining entry makes det Q = +1,
/// for left-handed triads, too. Identity for kFixture.
Eigen::Matrix3d GaugeRotation(Gauge gauge,
                              const Eigen::Matrix3d& leading_sensitivity,
                              double axis_sign = 1.0);

/// Derivative of the rotation: for a change dS of the leading sensitivity, Q changes by
/// Q * [omega]_x with omega = Jacobian * vec(dS) (3x9, vec column-major).
Eigen::Matrix<double, 3, 9> GaugeRotationJacobian(Gauge gauge,
                                                  const Eigen::Matrix3d& leading_sensitivity,
                                                  const Eigen::Matrix3d& rotation);

}  // namespace truetriad
