// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "truetriad/base/result.h"
#include "truetriad/base/triad.h"
#include "truetriad/data/static_pose.h"
#include "truetriad/model/calibration.h"
#include "truetriad/problem/options.h"

namespace truetriad {

/// What makes one program better than another.
enum class PlanCriterion {
  kDeterminant,  ///< D: the smallest volume of the joint uncertainty.
  kVariances,    ///< A: the smallest sum of (σ / wanted)^2; without wanted σ, of log σ.
};

/// The poses from which a program may be composed.
struct PlanGrid {
  std::vector<Eigen::Quaterniond> attitudes;
  /// Whether the grid is only a sample of all rotations; poses may then be moved off the grid.
  bool continuous = false;
  /// Each attitude is a candidate at each of these chamber temperatures. Empty: there is one
  /// temperature, which is not stated.
  std::vector<double> temperatures_degc{};
};

/// What is to be planned, and what is known beforehand.
struct PlanOptions {
  /// Sensors, model terms, noise of one pose, reference, attitudes and gauge, as for a calibration.
  CalibrateOptions calibrate;
  /// The approximate model of the unit: raw = sensitivity * truth + bias. Unset: no bias, and the
  /// scale of the readings' unit. It is needed for readings in counts, whose scale is unknown.
  PerTriad<std::optional<TriadModel<double>>> nominal;
  PerTriad<Unit> units;  ///< Units of the future readings.
  /// Used if the reference states none. Unset: 50 uT; 60 degrees with the hemisphere's sign.
  std::optional<double> nominal_field_ut, nominal_dip_rad;
  /// Length of the planned rests, s; 0: not stated. Needed if the noise is stated as a density.
  double rest_s = 0.0;
  /// Duration of the turn from one pose to the next, s. Range: > 0.
  double turn_s = 2.0;
  /// σ of a turn about each axis beyond the noise of the gyroscope's readings.
  double turn_sigma_rad = 0.0;
  /// σ of the attitudes that a fixture gives, about the body axes.
  Eigen::Vector3d attitude_sigma_rad = Eigen::Vector3d::Zero();

  PlanGrid grid;
  PlanCriterion criterion = PlanCriterion::kVariances;
  /// Number of poses to take; 0: the fewest that reach every wanted σ. Range: >= 0.
  int poses = 0;
  /// Largest σ wanted of each group: "<sensor>.{bias,scale_error,misalignment_rad}", in true units,
  /// "<sensor>.thermal.{bias,sensitivity}.<power>", the same per degC^power,
  /// "<sensor>.thermal.rate.{linear,quadratic,cross}", "reference.{dip_rad,field_ut}".
  std::map<std::string, double> wanted;
  /// Largest number of poses of a program. Range: >= 1.
  int max_poses = 60;
  /// If set, this program is evaluated instead of searching for one.
  std::optional<PoseProgram> program;
  /// Number of random programs to compare with; 0: none.
  int random_draws = 0;
  std::uint64_t seed = 1;

  /// Ok, or an error that lists every invalid option with its value.
  Status Validate() const;
};

/// σ of one quantity as limits state it: a bias in true units, a gain's relative error, a
/// misalignment, a reference value. Infinite if the poses do not determine it.
struct PlannedSigma {
  std::string name;     ///< "accelerometer.scale_error.x", "magnetometer.misalignment_rad.xy", …
  std::string group;    ///< "accelerometer.scale_error": the name that limits and wanted σ use.
  std::string unit;     ///< "m/s^2", "uT", "rad"; empty for a share.
  double before = 0.0;  ///< From measured poses and prior knowledge alone.
  double after = 0.0;   ///< With the program.
};

/// One wanted σ.
struct WantedSigma {
  std::string group;
  double wanted = 0.0;
  double reached = 0.0;  ///< Largest σ of the group.
  bool met = false;
  /// Number of poses that suffice for this σ alone; unset if over max_poses, or not searched.
  std::optional<int> poses_needed;
};

/// The purpose of one pose of the program: the quantity whose σ would grow most without it.
struct PosePurpose {
  std::string name;          ///< The PlannedSigma::name of the quantity.
  double sigma_ratio = 1.0;  ///< σ without the pose / σ with it; infinite: it needs the pose.
};

/// The noise of one triad that a plan assumes.
struct PlannedNoise {
  Triad triad = Triad::kAccelerometer;
  std::string unit;  ///< Unit of the readings.
  TriadNoise noise;  ///< Noise of a pose's mean.
};

/// The program compared with as many random poses.
struct RandomComparison {
  int draws = 0;
  /// Geometric mean of σ random / σ planned over all quantities: median and quartiles over draws.
  double gain = 0.0, gain_low = 0.0, gain_high = 0.0;
  /// How many random poses are as good as the program (median gain 1); unset if over 3 times as
  /// many.
  std::optional<int> equal_poses;
};

/// A planned or given program, and the σ that a calibration from its poses has.
struct Plan {
  PoseProgram program;
  int measured_poses = 0;  ///< Number of poses already taken; PlannedSigma::after includes them.
  std::vector<PlannedSigma> sigmas;
  std::vector<WantedSigma> wanted;
  std::vector<PosePurpose> purposes;  ///< One per pose.
  /// How long the unit is to rest in a pose so that its mean has the noise below, s: the stated
  /// time or, without one, the median of the measured poses; 0 if it is not known.
  double rest_s = 0.0;
  std::vector<PlannedNoise> noise;  ///< One per triad.
  bool determined = false;          ///< The poses determine every parameter.
  bool rehearsed = false;           ///< A calibration from exact readings succeeds.
  std::vector<WeakDirection> weak_directions;
  std::optional<RandomComparison> random;
  NamedCovariance covariance;  ///< The covariance that calibration.yaml will list, raw units.
  std::vector<std::string> messages;

  /// Whether all is determined, the rehearsed calibration succeeds and every wanted σ is reached.
  bool IsMet() const;
};

/// Predicts σ of every parameter (the Cramér-Rao bound of the calibration's own factor graph at the
/// nominal values) for options.program, or makes the program that is best by options.criterion.
/// `measured` holds the poses already taken; it may be empty. Errors: noise or gain not stated,
/// wanted names unknown (usage or bad input). It is no error if a wanted σ cannot be reached; see
/// Plan::IsMet.
Result<Plan> MakePlan(const PoseSet& measured, const PlanOptions& options);

}  // namespace truetriad
