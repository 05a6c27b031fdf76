// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include <gtest/gtest.h>

#include "model/attitude_sets.h"
#include "support/accel_mag_trials.h"
#include "truetriad/planning/plan.h"

namespace truetriad::trials {

// A unit that reads true units.
inline SyntheticUnit NominalUnit() {
  SyntheticUnit unit;
  unit.dip_rad = kDip;
  for (const Triad triad : {Triad::kAccelerometer, Triad::kMagnetometer}) {
    unit.models[triad] = TriadModel<double>();
    unit.units[triad] = UnitOf(triad, false);
  }
  return unit;
}

// What configs/plans/joint-12.yaml asks for: 22 parameters from 12 poses, any rotation.
inline PlanOptions JointPlanOptions() {
  PlanOptions options;
  options.calibrate = JointOptions(NominalUnit());
  for (const Triad triad : {Triad::kAccelerometer, Triad::kMagnetometer}) {
    options.calibrate.triads[triad].excess = ExcessNoise::kNone;
    options.calibrate.triads[triad].noise_sigma_raw =
        Eigen::Vector3d::Constant(ModelNoise().rest_sigma[triad]);
  }
  options.nominal_dip_rad = kDip;
  options.grid = {SpreadAttitudes(600), true};
  options.poses = 12;
  return options;
}

// Turns of two seconds between rests of four, as configs/plans/nine-axis.yaml has them.
inline constexpr double kPlannedRestS = 4.0;
inline constexpr double kPlannedTurnS = 2.0;
inline constexpr double kGyroscopeSigma = 9e-5;  // of a rest's mean, rad/s

inline SyntheticUnit NominalUnitWithGyroscope() {
  SyntheticUnit unit = NominalUnit();
  unit.models[Triad::kGyroscope] = TriadModel<double>();
  unit.units[Triad::kGyroscope] = UnitOf(Triad::kGyroscope, false);
  return unit;
}

// 34 parameters from 16 poses and the turns between them.
inline PlanOptions NineAxisPlanOptions() {
  PlanOptions options = JointPlanOptions();
  TriadOptions& gyroscope = options.calibrate.triads[Triad::kGyroscope];
  gyroscope.enabled = true;
  gyroscope.excess = ExcessNoise::kNone;
  gyroscope.noise_sigma_raw = Eigen::Vector3d::Constant(kGyroscopeSigma);
  options.grid = {HandAttitudes(), false};
  options.poses = 16;
  options.rest_s = kPlannedRestS;
  options.turn_s = kPlannedTurnS;
  return options;
}

// Turns with the noise that was planned for: white, so that a rest's mean has kGyroscopeSigma.
inline SyntheticTurns PlannedSyntheticTurns() {
  SyntheticTurns turns;
  turns.duration_s = kPlannedTurnS;
  turns.gyroscope_sigma_radps = kGyroscopeSigma * std::sqrt(kPlannedRestS * turns.rate_hz);
  return turns;
}

// The plan that options ask for, or of the program that they judge.
inline Plan MustPlan(const PlanOptions& options) {
  const Result<Plan> plan = MakePlan({}, options);
  EXPECT_TRUE(plan) << plan.error().message;
  return plan ? *plan : Plan();
}

}  // namespace truetriad::trials
