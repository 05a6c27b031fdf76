// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "problem/rows/attitude.h"
#include "problem/rows/row.h"

namespace truetriad {

// An attitude measured from outside (turntable, robot, fixture):
//
//   rows   Log(R_given^T R)        rad, about the body axes
//
// Parameters: the attitude.
class AttitudeRow final : public Row {
 public:
  explicit AttitudeRow(const Eigen::Quaterniond& given_world_from_body)
      : Row(3), given_(given_world_from_body) {
    AddState(kAttitudeSize);
  }

  bool Evaluate(double const* const* parameters,
                double* residuals,
                double** jacobians) const override;

  template <typename T>
  bool operator()(T const* const* parameters, T* residuals) const {
    const Eigen::Map<const Eigen::Quaternion<T>> attitude(parameters[0]);
    Eigen::Map<Eigen::Matrix<T, 3, 1>>{residuals} =
        LogOf<T>(given_.conjugate().cast<T>() * attitude);
    return true;
  }

 private:
  Eigen::Quaterniond given_;
};

// If the heading of a chain is not observable, holds the chain's first pose at an arbitrary
// heading. No other row depends on this heading, so that the residual is zero at the optimum and
// adds nothing to χ².
//
//   row   Log(R R_held^T) about the vertical        rad
//
// Parameters: the attitude.
class HeldHeadingRow final : public Row {
 public:
  explicit HeldHeadingRow(const Eigen::Quaterniond& held_world_from_body)
      : Row(1), held_(held_world_from_body) {
    AddState(kAttitudeSize);
  }

  bool Evaluate(double const* const* parameters,
                double* residuals,
                double** jacobians) const override;

  template <typename T>
  bool operator()(T const* const* parameters, T* residuals) const {
    const Eigen::Map<const Eigen::Quaternion<T>> attitude(parameters[0]);
    residuals[0] = LogOf<T>(attitude * held_.conjugate().cast<T>()).z();
    return true;
  }

 private:
  Eigen::Quaterniond held_;
};

}  // namespace truetriad
