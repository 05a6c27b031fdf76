// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <type_traits>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <ceres/rotation.h>

#include "truetriad/math/rotation.h"

namespace truetriad {

template <typename T>
using RowVector3 = Eigen::Matrix<T, 3, 1>;

using RowMajor34 = Eigen::Matrix<double, 3, 4, Eigen::RowMajor>;
using RowMajor33 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

// Exp and Log for doubles and for Ceres' Jets.
template <typename T>
Eigen::Quaternion<T> ExpOf(const RowVector3<T>& vector_rad) {
  if constexpr (std::is_same_v<T, double>) {
    return RotationExp(vector_rad);
  } else {
    T wxyz[4];
    ceres::AngleAxisToQuaternion(vector_rad.data(), wxyz);
    return {wxyz[0], wxyz[1], wxyz[2], wxyz[3]};
  }
}

template <typename T>
RowVector3<T> LogOf(const Eigen::Quaternion<T>& rotation) {
  if constexpr (std::is_same_v<T, double>) {
    return RotationLog(rotation);
  } else {
    const T wxyz[4] = {rotation.w(), rotation.x(), rotation.y(), rotation.z()};
    RowVector3<T> vector_rad;
    ceres::QuaternionToAngleAxis(wxyz, vector_rad.data());
    return vector_rad;
  }
}

// Derivative of d in R <- R Exp(d) with respect to q = (u, w), at q: 2 [w I - [u]_x, -u], since d =
// 2 vec(q0^-1 q).
inline RowMajor34 TangentFromQuaternion(const double* state) {
  const Eigen::Map<const Eigen::Quaterniond> q(state);
  RowMajor34 tangent;
  tangent << 2.0 * (q.w() * Eigen::Matrix3d::Identity() - Skew(q.vec())), -2.0 * q.vec();
  return tangent;
}

}  // namespace truetriad
