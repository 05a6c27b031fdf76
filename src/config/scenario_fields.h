// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <string>

#include <Eigen/Core>

#include "config/fields.h"
#include "truetriad/sim/scenario.h"

namespace truetriad {

/// What the documents of a scenario have said about one sensor so far, in true units; what it is in
/// readings can only be told when all have been read.
struct ScenarioSensor {
  Unit unit;
  std::optional<double> si_per_count;
  Eigen::Vector3d zero_raw = Eigen::Vector3d::Zero();  ///< Reading of a perfect chip at zero.

  Eigen::Vector3d bias = Eigen::Vector3d::Zero();
  /// Given as a whole, or as gains and misalignment: what was said last.
  std::optional<Eigen::Matrix3d> sensitivity;
  Eigen::Vector3d scale_error = Eigen::Vector3d::Zero();
  Eigen::Matrix3d misalignment_rad = Eigen::Matrix3d::Zero();
  std::optional<Eigen::Matrix3d> g_sensitivity;
  PerAxisTerm<Eigen::Vector3d> axis_terms =
      PerAxisTerm<Eigen::Vector3d>::All(Eigen::Vector3d::Zero());
  std::optional<ThermalTerms> thermal;

  /// Values of one sample; become a density once the rate is known.
  std::optional<Eigen::Vector3d> sample_sigma;
  std::optional<double> resolution, resolution_raw;
  std::optional<double> range;  ///< Each way from zero.
  std::optional<Eigen::Vector2d> range_raw;

  /// Everything else, which is the same in both.
  SimulatedTriad settled;
};

/// The block of a sensor. `none` removes it.
void ScenarioSensorMap(FieldReader& visit, Triad triad, std::optional<ScenarioSensor>* sensor);

/// Says to `fail` what contradicts itself.
SimulatedTriad SettledSensor(const ScenarioSensor& sensor,
                             const std::function<void(const std::string&)>& fail);

/// What happens in a scenario: its motion, temperature and disturbances. Each list that is there
/// takes the place of what was said before. Files are relative to `file`.
void CourseFields(FieldReader& visit, const std::string& file, Scenario* scenario);

}  // namespace truetriad
