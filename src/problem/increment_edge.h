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

// What the gyroscope says about the turn from one pose to the next, dR. How that is compared with
// the attitudes: rows/turn_row.h.
//
// A turn that the operator states leads from one held attitude to another: no turn, and Exp(angle *
// axis). Both are known but for whole turns, which nobody can tell from where the unit ends up.
//
// dR is linear in the gyroscope's parameters about the point where it was integrated; Integrate
// moves that point.
struct IncrementEdge {
  std::size_t from = 0;  // index of the first node; the second is the next
  GyroMove move;
  // The accelerometer at the same times; empty where there is no g-sensitivity.
  std::vector<Eigen::Vector3d> accelerometer_raw;
  Eigen::Vector3d sigma_raw = Eigen::Vector3d::Ones();  // of one reading
  RateSampling sampling = RateSampling::kInstantaneous;
  // Mean of both poses; only read where there are temperature terms.
  double temperature_degc = 25.0;
  double temperature_rate_degcps = 0.0;
  int session = 0;

  GyroModel at;  // where it was integrated
  GyroIncrement increment;

  // Of a turn that the operator states: its place in PoseSet::turns, and how well its end is known.
  int stated_turn = -1;
  Eigen::Matrix3d stated_covariance = Eigen::Matrix3d::Zero();

  // What it is weighted with: the readings' noise, the excess, and what is stated.
  Eigen::Matrix3d variance = Eigen::Matrix3d::Identity();
  // Robust weight: divides the variance.
  double weight = 1.0;
  bool rejected = false;

  // Integrates again, at the present parameters; the forces are those of the present accelerometer,
  // on whose own errors the turn hardly depends.
  void Integrate(const SharedLayout& layout, const double* shared);

  // The turn at other parameters than those of `increment`.
  Eigen::Quaterniond RotationAt(const SharedLayout& layout, const double* shared) const;

  // What the earth's rate at `shared` has turned the world by meanwhile, rad; zero where it is not
  // counted.
  Eigen::Vector3d EarthTurn(const SharedLayout& layout, const double* shared) const;

  // As PoseNode::Evaluate, with the tangent spaces of both nodes.
  void Evaluate(const SharedLayout& layout,
                const double* shared,
                const double* first_state,
                const double* second_state,
                Eigen::Vector3d* residual,
                PoseSharedJacobian* shared_jacobian,
                Eigen::Matrix3d* first_jacobian,
                Eigen::Matrix3d* second_jacobian) const;

  // The rows alone.
  Eigen::Vector3d Residual(const SharedLayout& layout,
                           const double* shared,
                           const double* first_state,
                           const double* second_state) const;

  // W with W^T W the inverse covariance of the rows, robust weight included.
  Eigen::Matrix3d SquareRootInformation() const;
  Eigen::Matrix3d Information() const;

 private:
  GyroModel ModelOf(const SharedLayout& layout, const double* shared) const;
  // Specific forces as the accelerometer at `shared` shows them; empty without g-sensitivity.
  std::vector<Eigen::Vector3d> ForcesOf(const SharedLayout& layout, const double* shared) const;
};

}  // namespace truetriad
