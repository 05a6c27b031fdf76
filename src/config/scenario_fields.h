// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <string>

#include <Eigen/Core>

#include "io/field_schema.h"
#include "truetriad/sim/scenario.h"

namespace truetriad {

/// What the documents of a scenario state about one sensor. Values are in units of the measured
/// quantity (SI, µT), except those named `raw`. All are converted to raw units after the last
/// document.
struct ScenarioSensor {
  Unit unit;
  std::optional<double> si_per_count;
  Eigen::Vector3d zero_raw = Eigen::Vector3d::Zero();  ///< Raw reading of an ideal sensor at zero.

  Eigen::Vector3d bias = Eigen::Vector3d::Zero();
  /// Documents state either this matrix, or scale_error and misalignment_rad. The last statement
  /// counts.
  std::optional<Eigen::Matrix3d> sensitivity;
  Eigen::Vector3d scale_error = Eigen::Vector3d::Zero();
  Eigen::Matrix3d misalignment_rad = Eigen::Matrix3d::Zero();
  std::optional<Eigen::Matrix3d> g_sensitivity;
  PerAxisTerm<Eigen::Vector3d> axis_terms =
      PerAxisTerm<Eigen::Vector3d>::All(Eigen::Vector3d::Zero());
  std::optional<ThermalTerms> thermal;

  /// σ of a sample's noise; converted to a density once the rate is known.
  std::optional<Eigen::Vector3d> sample_sigma;
  std::optional<double> resolution, resolution_raw;
  std::optional<double> range;  ///< Largest reading in either direction.
  std::optional<Eigen::Vector2d> range_raw;

  /// All other values, which need no conversion to raw units.
  SimulatedTriad settled;
};

/// Reads the block of a sensor. The word `none` in place of a block removes the sensor.
void ScenarioSensorMap(auto& visit, Triad triad, std::optional<ScenarioSensor>* sensor);

/// Converts a sensor to raw units. Calls `fail` with a message for each contradiction.
SimulatedTriad SettledSensor(const ScenarioSensor& sensor,
                             const std::function<void(const std::string&)>& fail);

/// Reads the course of a scenario: its motion, temperature and disturbances. A list replaces the
/// list of earlier documents. File names are relative to the folder of `file`.
void CourseFields(auto& visit, const std::string& file, Scenario* scenario);

}  // namespace truetriad
