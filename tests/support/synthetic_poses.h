// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "math/random.h"
#include "truetriad/base/triad.h"
#include "truetriad/data/static_pose.h"
#include "truetriad/model/triad_model.h"

namespace truetriad {

/// A simulated unit and the world it stands in.
struct SyntheticUnit {
  PerTriad<std::optional<TriadModel<double>>> models;
  PerTriad<Unit> units;
  double gravity_mps2 = 9.80665;
  double field_ut = 48.0;
  double dip_rad = 1.0;

  /// Specific force or field in the world frame, true unit; of a gyroscope at rest zero.
  Eigen::Vector3d WorldVector(Triad triad) const;
};

/// Noise of simulated pose means, in true units, isotropic.
struct SyntheticNoise {
  PerTriad<double> rest_sigma{};    ///< Known: goes into the poses' covariance.
  PerTriad<double> excess_sigma{};  ///< From pose to pose; not stated to the estimator.
};

/// Means of one rest for each attitude: what static detection would hand to the estimator.
PoseSet SimulatePoses(const SyntheticUnit& unit,
                      const std::vector<Eigen::Quaterniond>& world_from_body,
                      const SyntheticNoise& noise,
                      Random* random);

/// Turns from each pose to the next, about one axis each, by the shortest way, with minimum jerk.
struct SyntheticTurns {
  double duration_s = 2.5;
  double rate_hz = 100.0;
  /// White noise of one reading, isotropic in true units; that of the gyroscope is stated.
  double gyroscope_sigma_radps = 0.0;
  double accelerometer_sigma_mps2 = 0.0;
  double magnetometer_sigma_ut = 0.0;  ///< Used by a unit without accelerometer.
};

/// Adds the readings of a gyroscope and an accelerometer (of a unit without one: a magnetometer)
/// that turn in place between the poses of `set`, as a recording's moves. Without `random` the
/// readings are exact, but their noise is stated all the same.
void AddTurns(const SyntheticUnit& unit,
              const std::vector<Eigen::Quaterniond>& world_from_body,
              const SyntheticTurns& turns,
              Random* random,
              PoseSet* set);

std::vector<Eigen::Quaterniond> RandomAttitudes(int count, Random* random);

}  // namespace truetriad
