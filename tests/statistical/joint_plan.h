// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include "support/accel_mag_trials.h"
#include "truetriad/estimation/plan.h"
#include "truetriad/model/attitude_sets.h"

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

// The plan that options ask for, or of the program that they judge.
inline Plan MustPlan(const PlanOptions& options) {
  const Result<Plan> plan = MakePlan({}, options);
  EXPECT_TRUE(plan) << plan.error().message;
  return plan ? *plan : Plan();
}

}  // namespace truetriad::trials
