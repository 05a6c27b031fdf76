// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <ostream>
#include <vector>

#include <Eigen/Geometry>

#include "support/accel_mag_trials.h"

namespace truetriad::trials {

// One simulated problem: joint, attitudes random and unknown, noise known, unless a regime says
// otherwise.
struct Trial {
  SyntheticUnit unit;
  std::vector<Eigen::Quaterniond> attitudes;
  SyntheticNoise noise = ModelNoise();
  CalibrateOptions options;
  // Told to the estimator, one a pose; empty: nothing is.
  std::vector<AttitudeReference> stated_attitudes;
  // Seconds that each pose is averaged, for noise from an Allan deviation; empty: not timed.
  std::vector<double> durations_s;
  // Rest noise of each pose over that of `noise`; empty: all alike.
  std::vector<double> rest_factors;
  // The gyroscope's readings from pose to pose, where it is calibrated.
  SyntheticTurns turns;
  // False: the poses come without covariances, as a table without σ columns does.
  bool states_covariances = true;
};

// A working regime: one row of the table in docs/tables/accuracy.md.
struct Regime {
  const char* name;  // a word for the test
  const char* row;   // what the table says
  UnitSpread spread = {};
  // What makes it differ, before noise is drawn.
  void (*change)(Trial* trial, Random* random) = nullptr;
  // False: the errors are curved in the parameters (their squares show), so that no covariance
  // describes them jointly. NEES is then reported and not judged; single parameters still are.
  bool linear = true;
};
void PrintTo(const Regime& regime, std::ostream* out);

const std::vector<Regime>& Regimes();

Trial MakeTrial(const Regime& regime, Random* random);

// What the estimator is given.
PoseSet NoisyPoses(const Trial& trial, Random* random);

// The same without noise, but with its true covariance: what the bound is computed from.
PoseSet ExactPoses(const Trial& trial);

}  // namespace truetriad::trials
