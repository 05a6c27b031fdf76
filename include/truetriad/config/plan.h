// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

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
  PlanConfig() { options.random_draws = 200; }

  PlanOptions options;          ///< As far as the block says them.
  std::string program;          ///< Judge this one; resolved; empty when not given.
  bool from_recording = false;  ///< `start: recording`: complete the experiment's own recording.
  PerTriad<NominalSensor> nominal;
};

}  // namespace truetriad
