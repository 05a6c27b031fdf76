// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "problem/pose_state.h"
#include "problem/rows/row.h"

namespace truetriad {

// A rest on a face of the six-face block: one body axis points up, except for a tilt. All rests on
// the face share its mean tilt t; each rest scatters about it.
//
//   rows   [tangent axes]^T u - t        u: the up direction in the body
//
// Parameters: the face's tilt (2, rad), the state. A state that is a direction is u itself.
class FaceRow final : public Row {
 public:
  FaceRow(int face, const SharedBlock& tilt, PoseKind state);

  bool Evaluate(double const* const* parameters,
                double* residuals,
                double** jacobians) const override;

  template <typename T>
  bool operator()(T const* const* parameters, T* residuals) const {
    using Vector3 = Eigen::Matrix<T, 3, 1>;
    const Vector3 up =
        state_ == PoseKind::kDirection
            ? Vector3(Eigen::Map<const Vector3>(parameters[1]))
            : Vector3(Eigen::Map<const Eigen::Quaternion<T>>(parameters[1]).conjugate() *
                      Vector3(T(0), T(0), T(1)));
    Eigen::Map<Eigen::Matrix<T, 2, 1>>{residuals} =
        tangents_.transpose().cast<T>() * up -
        Eigen::Map<const Eigen::Matrix<T, 2, 1>>(parameters[0]);
    return true;
  }

 private:
  Eigen::Matrix<double, 3, 2> tangents_;
  PoseKind state_;
};

}  // namespace truetriad
