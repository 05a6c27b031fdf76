// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <memory>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "problem/parameters.h"
#include "problem/pose_state.h"
#include "truetriad/base/triad.h"
#include "truetriad/model/triad_model.h"

namespace truetriad {

inline constexpr int kMaxPoseRows = 12;  // three triads and one attitude prior
// Three triads with all temperature terms, two axis terms (6) and all sessions; g-sensitivity,
// reference, six tilts of two angles.
inline constexpr int kMaxSharedSize =
    3 * (12 + kMaxThermalSize + 6 + 3 * (kMaxSessions - 1)) + 9 + kReferenceSize + 12;

using PoseResidual12 = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxPoseRows, 1>;
using PoseSharedJacobian =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxPoseRows, kMaxSharedSize>;
using PoseRowMatrix =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxPoseRows, kMaxPoseRows>;
using PoseStateJacobian = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxPoseRows, 3>;

// What a node of the graph represents.
enum class PoseRole {
  kRest,      // a rest of the unit
  kMoment,    // a moment of the unit's motion, with the readings around it
  kRate,      // an interval of known rate; the state is its axis, if that is unknown
  kTurnAxis,  // the mean rate of a known turn, which determines its axis
  kTurnEnd,   // begin or end of a known turn, held at the stated attitude; no rows
};

// The reading of one triad in one pose.
struct Observation {
  Triad triad = Triad::kAccelerometer;
  Eigen::Vector3d mean_raw = Eigen::Vector3d::Zero();
  // Covariance of the mean from the noise within the rest, raw unit squared.
  Eigen::Matrix3d rest_covariance = Eigen::Matrix3d::Zero();
  // By how much the mean would change if the triad's times were one second earlier. Follows from
  // the readings at both ends of the rest.
  Eigen::Vector3d by_clock_raw_per_s = Eigen::Vector3d::Zero();
  // Covariance of the known rate, (rad/s)^2.
  Eigen::Matrix3d rate_covariance = Eigen::Matrix3d::Zero();
  // For readings around a moment of motion: the mean of R_reading^T R_node over these readings. It
  // rotates a vector from the body at the node to the body at the readings. `turning`: the
  // quantities from which the mean is computed; null if it does not depend on the gyroscope's
  // parameters.
  Eigen::Matrix3d mean_turn = Eigen::Matrix3d::Identity();
  std::shared_ptr<const Turning> turning;
  // Covariance with which the mean is weighted: rest noise and excess noise.
  Eigen::Matrix3d variance = Eigen::Matrix3d::Identity();
  // Robust weight: divides the variance.
  double weight = 1.0;
  bool rejected = false;
};

// One pose of the graph: its readings, and its known or estimated attitude. The order of its rows
// (graph_rows.h): three rows for each observation, three for a given attitude, one for a held
// heading, two for a face.
struct PoseNode {
  int number = 0;  // StaticPose::number; known rates and turns have the next numbers
  PoseRole role = PoseRole::kRest;
  PoseKind kind = PoseKind::kRotation;
  double time_s = 0.0;  // the middle of the readings, or, without times, the pose's number
  PoseValues state{0.0, 0.0, 0.0, 1.0};
  double temperature_degc = 25.0;  // used only by temperature terms
  double temperature_rate_degcps = 0.0;
  int session = 0;
  std::vector<Observation> observations;

  // The known rate. If its axis is unknown, only its magnitude is used; the node's direction is the
  // axis.
  Eigen::Vector3d known_rate_radps = Eigen::Vector3d::Zero();
  bool is_axis_known = true;
  // Mean specific force while the rate was held, measured by the accelerometer.
  Eigen::Vector3d known_force_mps2 = Eigen::Vector3d::Zero();

  bool has_attitude_prior = false;
  Eigen::Quaterniond prior_world_from_body = Eigen::Quaterniond::Identity();
  Eigen::Vector3d prior_sigma_rad = Eigen::Vector3d::Ones();

  bool holds_heading = false;
  Eigen::Quaterniond held_world_from_body = Eigen::Quaterniond::Identity();

  int face = -1;  // index of the face that points up, or -1
  double seat_sigma_rad = 0.0;

  int tangent_size() const { return TangentSize(kind); }
  int row_count() const {
    return 3 * static_cast<int>(observations.size()) + (has_attitude_prior ? 3 : 0) +
           (holds_heading ? 1 : 0) + (face >= 0 ? 2 : 0);
  }
  Eigen::Quaterniond rotation() const { return {state[3], state[0], state[1], state[2]}; }
  Eigen::Vector3d direction() const { return {state[0], state[1], state[2]}; }

  // Model of `triad` at the pose's temperature and in its session.
  TriadModel<double> ModelOfTriad(const SharedLayout& layout,
                                  const double* shared,
                                  Triad triad) const;

  // Whether a reading or a given attitude determines the node's heading.
  bool TellsHeading() const;
  // False if the field itself defines the vertical (CalibrateOptions::TurnsAgainstField).
  bool is_field_inclined = true;

  // Whether the gyroscope's row includes the earth's rate. It does so only at rest, since known
  // rates are stated relative to the turntable.
  bool SeesEarthRate(const SharedLayout& layout) const {
    return role == PoseRole::kRest && layout.CountsEarthRate();
  }

  // The vector that `triad` senses, in the body frame, true unit, at the given parameters. For the
  // gyroscope: the known rate, or the earth's rate.
  Eigen::Vector3d FieldInBody(const SharedLayout& layout,
                              Triad triad,
                              const Eigen::Ref<const ReferenceVector>& reference,
                              const double* state_values) const;

  // Residuals of the rows and, if wanted, their Jacobians with respect to the shared vector (every
  // entry, free or not) and to the pose's tangent space: for a rotation R <- R Exp(d), for a
  // direction u <- u + T(u) d with T from TangentBasis. Pointers may be null.
  void Evaluate(const SharedLayout& layout,
                const double* shared,
                const double* state_values,
                PoseResidual12* residual,
                PoseSharedJacobian* shared_jacobian,
                PoseStateJacobian* tangent_jacobian) const;

  // The block lower triangular W for which W^T W is the inverse covariance of all rows, robust
  // weights included.
  PoseRowMatrix SquareRootInformation() const;
  // W^T W, block diagonal with blocks of at most three rows.
  PoseRowMatrix Information() const;

  // Moves the state by a step in its tangent space.
  void Step(const Eigen::Ref<const Eigen::VectorXd>& tangent) {
    state = After(kind, state, tangent);
  }
};

}  // namespace truetriad
