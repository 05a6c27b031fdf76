// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include <Eigen/Core>

namespace truetriad {

/// Rows `first` to `last` of the leading stream's file, counted from 0, both included; empty if
/// last < first.
struct RowSpan {
  std::int64_t first = 0;
  std::int64_t last = -1;
  bool empty() const { return last < first; }
};

/// A range of time as the log's stamps state it, both ends included; empty if end_ns < start_ns.
struct TimeRange {
  std::int64_t start_ns = 0;
  std::int64_t end_ns = -1;
  bool empty() const { return end_ns < start_ns; }
};

/// Where in a recording a known motion took place: by rows, by time, or by a pose.
struct MotionPlace {
  RowSpan rows;
  TimeRange times;
  /// StaticPose::number, used if neither rows nor times are stated. A rate was held in this pose; a
  /// turn leads from this pose into the next one.
  int pose = 0;
  std::string stated_in;  ///< Where the motion is stated, as "turns.yaml:3"; may be empty.
  bool is_pose() const { return rows.empty() && times.empty(); }
};

/// A turn whose angle the operator states.
struct StatedTurn {
  MotionPlace at;
  std::string id;
  /// Stated axis of the turn: unit vector, body frame, right-handed.
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();
  double angle_rad = 0.0;  ///< Whole turns count: 4 pi is two turns.
  /// σ of the attitude that the stated angle predicts after the turn, about each axis. Range: > 0.
  double sigma_rad = 0.0;
  /// σ of the direction of `axis`, about each axis perpendicular to `axis`. Range: > 0.
  double axis_sigma_rad = 0.0;
  /// If true, the turn is only predicted, and the error of the prediction is reported.
  bool held_out = false;
};

/// A rate at which a table is known to have turned the unit.
struct StatedRate {
  MotionPlace at;
  std::string id;
  /// In the body frame. If the axis is not known, only the length of the vector has a meaning.
  Eigen::Vector3d rate_radps = Eigen::Vector3d::Zero();
  bool is_axis_known = true;
  /// Covariance of the error of rate_radps, (rad/s)^2. Errors of different rates are independent.
  Eigen::Matrix3d covariance_radps2 = Eigen::Matrix3d::Zero();
};

}  // namespace truetriad
