// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include <Eigen/Core>

#include "model/gyro_increment.h"
#include "problem/pose_state.h"
#include "truetriad/base/result.h"
#include "truetriad/data/static_pose.h"

namespace truetriad {

// The readings of a vector sensor that are gathered at one node of the chain.
struct GatheredReadings {
  int count = 0;
  Eigen::Vector3d mean_raw = Eigen::Vector3d::Zero();
  // Mean of R_reading^T R_node: maps a world-fixed vector, in the body frame at the node, to its
  // mean in the body frames at the readings.
  Eigen::Matrix3d turn = Eigen::Matrix3d::Zero();
  // Mean of -d/dt (R_reading^T R_node) = [omega]x R_reading^T R_node, rad/s: by how much `turn`
  // changes if the readings' times are one second earlier.
  Eigen::Matrix3d turn_per_s = Eigen::Matrix3d::Zero();
  // The rate from which `turn` was computed; with it, `turn` follows the gyroscope's parameters.
  // Null if no turn is known.
  std::shared_ptr<const Turning> turning;
  double weight = 1.0;  // robust
};

// One moment of the motion, at the time of a reading of the gyroscope.
struct Moment {
  std::size_t reading = 0;  // index of the gyroscope's reading
  GatheredReadings accelerometer, magnetometer;
  bool is_linked = false;  // the gyroscope measured the turn to the next node
  double weight = 1.0;     // robust weight of that turn

  const GatheredReadings& seen(Triad triad) const {
    return triad == Triad::kMagnetometer ? magnetometer : accelerometer;
  }
  GatheredReadings& seen(Triad triad) {
    return triad == Triad::kMagnetometer ? magnetometer : accelerometer;
  }
};

// The recording of a tumbling unit: the readings of the gyroscope and of the vector sensors by
// time.
class MotionTrack {
 public:
  // A track of the gyroscope and the wanted vector sensors. Error (bad input): one of these sensors
  // has no readings at two different times.
  static Result<MotionTrack> Of(const PoseSet& poses, const PerTriad<bool>& wanted);

  // A chain with a node every `spacing_s`. The readings are rotated to their node with the model
  // `gyroscope`, or not at all if it is null. The chain is broken where the gyroscope did not
  // measure the turn (gaps) and at joints.
  std::vector<Moment> Gather(double spacing_s, const GyroModel* gyroscope) const;

  // The gyroscope's readings from `node` to the next node.
  GyroReadings Between(const Moment& node, const Moment& next) const;
  // The accelerometer's readings at the times of Between, once SetForces was called.
  std::vector<Eigen::Vector3d> AccelerometerBetween(const Moment& node, const Moment& next) const {
    return {accelerometer_raw_.begin() + static_cast<std::ptrdiff_t>(node.reading),
            accelerometer_raw_.begin() + static_cast<std::ptrdiff_t>(next.reading) + 1};
  }

  // By how much a vector sensor's clock is ahead of the gyroscope's, s; zero at first. Gather and
  // SetForces correct the times by it.
  double ahead_s(Triad triad) const { return ahead_s_[triad]; }
  void set_ahead_s(Triad triad, double ahead_s) { ahead_s_[triad] = ahead_s; }

  // Computes the specific force at the gyroscope's readings, for its g-sensitivity.
  void SetForces(const TriadModel<double>& accelerometer);

  double TimeOf(const Moment& node) const { return time_s_[node.reading]; }
  // Median time between two readings.
  double spacing_s(Triad triad) const { return spacing_s_[triad]; }
  // Duration without the gaps of the gyroscope, s.
  double duration_s() const { return time_s_.back() - time_s_.front() - untold_s_; }
  // Total time without gyroscope data, s, and the number of such intervals.
  double untold_s() const { return untold_s_; }
  int untold() const { return untold_; }

 private:
  struct Vectors {
    std::vector<double> time_s;
    std::vector<Eigen::Vector3d> reading_raw;
  };
  // The rate at each reading of the gyroscope, by its model; zero if that is null.
  std::vector<Eigen::Vector3d> RatesBy(const GyroModel* gyroscope) const;
  // Nodes every `spacing_s`, and at both ends of each interval without gyroscope data.
  std::vector<Moment> NodesEvery(double spacing_s) const;
  struct Span {
    double from_s = 0.0, to_s = 0.0;
  };
  void FindUntoldSteps(const std::vector<Span>& excluded);
  // Breaks the chain before the first reading at `time_s` or later; no data is missing there.
  void BreakBefore(double time_s);

  std::vector<double> time_s_;
  std::vector<Eigen::Vector3d> rate_raw_, accelerometer_raw_, force_mps2_;
  std::vector<bool> is_untold_;  // whether the chain breaks before the next reading
  PerTriad<Vectors> vectors_;
  PerTriad<double> spacing_s_{}, ahead_s_{};
  double untold_s_ = 0.0;
  int untold_ = 0;
};

}  // namespace truetriad
