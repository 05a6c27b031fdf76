// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "model/gyro_increment.h"
#include "problem/parameters.h"
#include "problem/pose_node.h"

namespace truetriad {

// The gyroscope's rotation from one pose to the next, dR, which rows/turn_row.h compares with the
// attitudes.
//
// A stated turn leads from the held attitude Identity to the held attitude Exp(angle * axis). These
// attitudes do not show the number of whole turns between them.
//
// dR is linearised about the gyroscope's parameters at which it was integrated; Integrate replaces
// these parameters.
struct IncrementEdge {
  std::size_t from = 0;  // index of the first node; the second is the next
  GyroMove move;
  // Readings of the accelerometer at the same times, raw unit; empty without g-sensitivity.
  std::vector<Eigen::Vector3d> accelerometer_raw;
  Eigen::Vector3d sigma_raw = Eigen::Vector3d::Ones();  // σ of one gyroscope reading
  RateSampling sampling = RateSampling::kInstantaneous;
  // Temperature and its rate, as the mean of both poses; used only by temperature terms.
  double temperature_degc = 25.0;
  double temperature_rate_degcps = 0.0;
  int session = 0;

  GyroModel at;  // the gyroscope's parameters at which `increment` was integrated
  GyroIncrement increment;

  // For a stated turn: its index in PoseSet::turns and the covariance of its end attitude, rad².
  // For other turns the index is -1.
  int stated_turn = -1;
  Eigen::Matrix3d stated_covariance = Eigen::Matrix3d::Zero();

  // Covariance of the rows, rad²: the readings' noise, the excess noise and the stated covariance.
  Eigen::Matrix3d variance = Eigen::Matrix3d::Identity();
  // Robust weight: divides the variance.
  double weight = 1.0;
  bool rejected = false;

  // Integrates again at the parameters `shared`. The forces are computed with the accelerometer's
  // parameters in `shared`; their errors hardly change the turn.
  void Integrate(const SharedLayout& layout, const double* shared);

  // The rotation integrated at the parameters `shared`, instead of at those of `increment`.
  Eigen::Quaterniond RotationAt(const SharedLayout& layout, const double* shared) const;

  // The rotation of the world by the earth's rate at `shared` during the turn, rad. It is zero if
  // the earth's rate is neglected, and for a stated turn.
  Eigen::Vector3d EarthTurn(const SharedLayout& layout, const double* shared) const;

  // Evaluates like PoseNode::Evaluate, but with Jacobians in the tangent spaces of both nodes.
  void Evaluate(const SharedLayout& layout,
                const double* shared,
                const double* first_state,
                const double* second_state,
                Eigen::Vector3d* residual,
                PoseSharedJacobian* shared_jacobian,
                Eigen::Matrix3d* first_jacobian,
                Eigen::Matrix3d* second_jacobian) const;

  // The residual alone.
  Eigen::Vector3d Residual(const SharedLayout& layout,
                           const double* shared,
                           const double* first_state,
                           const double* second_state) const;

  // The W for which W^T W is the inverse covariance of the rows, robust weight included.
  Eigen::Matrix3d SquareRootInformation() const;
  Eigen::Matrix3d Information() const;

 private:
  GyroModel ModelOf(const SharedLayout& layout, const double* shared) const;
  // The specific forces, m/s², computed with the parameters `shared`; empty without g-sensitivity.
  std::vector<Eigen::Vector3d> ForcesOf(const SharedLayout& layout, const double* shared) const;
};

}  // namespace truetriad
