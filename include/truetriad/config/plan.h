// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "truetriad/base/triad.h"
#include "truetriad/base/units.h"
#include "truetriad/planning/plan.h"

namespace truetriad {

/// `plan: { nominal: { <sensor>: … } }`: what the unit is like, nearly.
struct NominalSensor {
  std::optional<Unit> unit;                        ///< Of the readings to come; the true unit.
  std::optional<Eigen::Matrix3d> sensitivity;      ///< Raw per true unit; the unit's own scale.
  Eigen::Vector3d bias = Eigen::Vector3d::Zero();  ///< Raw.
};

/// `plan:` of an experiment: which poses to look for. A calibration reads over it.
struct PlanConfig {
  int poses = 0;  ///< 0: the fewest that reach what is wanted.
  std::map<std::string, double> wanted;
  int max_poses = 60;
  PlanGrid grid;  ///< Of `rotations:`.
  PlanCriterion criterion = PlanCriterion::kVariances;
  std::string program;  ///< Judge this one; resolved; empty when not given.
  int random_draws = 200;
  bool from_recording = false;  ///< `start: recording`: complete the experiment's own recording.
  double rest_s = 0.0;
  double turn_s = 2.0;
  double turn_sigma_deg = 0.0;
  std::uint64_t seed = 1;
  PerTriad<NominalSensor> nominal;
  std::optional<double> nominal_strength_ut, nominal_dip_deg;
};

}  // namespace truetriad
