// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include <Eigen/Core>

#include "truetriad/base/triad.h"
#include "truetriad/base/units.h"
#include "truetriad/planning/plan.h"

namespace truetriad {

/// `plan: { nominal: { <sensor>: … } }`: the approximate properties of the unit.
struct NominalSensor {
  std::optional<Unit> unit;                        ///< Unit of future readings; default: true unit.
  std::optional<Eigen::Matrix3d> sensitivity;      ///< Raw per true unit; default: unit's scale.
  Eigen::Vector3d bias = Eigen::Vector3d::Zero();  ///< Raw.
};

/// `plan:` of an experiment: which poses to search for. A calibration ignores it.
struct PlanConfig {
  PlanConfig() { options.random_draws = 200; }

  PlanOptions options;          ///< Has the values that `plan:` states.
  std::string program;          ///< File to judge instead of a search; resolved; empty: none.
  bool from_recording = false;  ///< `start: recording`: complete the experiment's own recording.
  PerTriad<NominalSensor> nominal;
};

}  // namespace truetriad
