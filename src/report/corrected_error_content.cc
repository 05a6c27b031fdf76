// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "model/corrected_error.h"
#include "model/heading_error.h"
#include "report/charts.h"
#include "report/format.h"
#include "report/sections.h"
#include "report/sphere.h"
#include "truetriad/base/units.h"

namespace truetriad {
namespace {

/// The row of readings of a quantity of `magnitude`, as of CorrectedErrorOf; `factor` makes `unit`
/// of the true unit.
void AddErrors(const Calibration& calibration,
               const char* what,
               Triad triad,
               double magnitude,
               bool has_bias,
               double factor,
               const char* unit,
               Table* table) {
  const CorrectedError error = CorrectedErrorOf(calibration, triad, magnitude, has_bias);
  const auto number = [](double value) {
    return value >= 1e3 && value < 1e6 ? Fixed(value, 0) : Significant(value, 3);
  };
  const bool has_angle = magnitude > 0.0, is_estimated = error.after.worst > 0.0;
  const auto angle = [&](double rad) { return has_angle ? number(kDegPerRad * rad) : ""; };
  table->Add() << what << (error.before ? number(factor * error.before->rms) : "")
               << (error.before ? number(factor * error.before->worst) : "")
               << (is_estimated ? number(factor * error.after.rms) : "not estimated")
               << (is_estimated ? number(factor * error.after.worst) : "–") << unit
               << (error.before ? angle(error.before->angle_rms) : "")
               << (is_estimated ? angle(error.after.angle_rms) : "") << (has_angle ? "°" : "");
}

Table BeforeAndAfter(const Calibration& calibration) {
  Table table =
      Headed("; raw RMS; worst; corrected σ; worst; unit; raw; corrected; unit", "lrrrrlrrl");
  const ReferenceValues& reference = calibration.reference;
  const auto add = [&](const char* what,
                       Triad triad,
                       double magnitude,
                       bool has_bias,
                       double factor,
                       const char* unit) {
    if (calibration.sensors[triad]) {
      AddErrors(calibration, what, triad, magnitude, has_bias, factor, unit, &table);
    }
  };
  add("accelerometer in gravity",
      Triad::kAccelerometer,
      reference.gravity_mps2,
      true,
      1e3 / kStandardGravityMps2,
      "mg");
  if (reference.field_ut) {
    add(reference.field_nominal ? "magnetometer in the assumed field" : "magnetometer in the field",
        Triad::kMagnetometer,
        *reference.field_ut,
        true,
        1.0,
        "µT");
  }
  add("gyroscope at rest", Triad::kGyroscope, 0.0, true, 3600.0 * kDegPerRad, "°/h");
  add("gyroscope, of a rate", Triad::kGyroscope, 1.0, false, 1e6, "ppm");
  return table;
}

/// A compass of the unit held level: RMS and worst over the headings, raw and corrected, degrees.
void AddHeading(const Calibration& calibration, Table* table) {
  const std::vector<HeadingError> errors = HeadingErrors(calibration, kHeadings);
  if (errors.empty()) return;
  double raw_square = 0.0, raw_worst = 0.0, square = 0.0, worst = 0.0;
  for (const HeadingError& error : errors) {
    const double raw = error.raw_rad.value_or(0.0);
    raw_square += raw * raw / kHeadings;
    raw_worst = std::max(raw_worst, std::abs(raw));
    square += error.sigma_rad * error.sigma_rad / kHeadings;
    worst = std::max(worst, error.sigma_rad);
  }
  const auto degrees = [](double rad) { return Significant(kDegPerRad * rad, 3); };
  const bool has_raw = errors.front().raw_rad.has_value();
  table->Add() << "heading of a level unit" << (has_raw ? degrees(std::sqrt(raw_square)) : "")
               << (has_raw ? degrees(raw_worst) : "") << degrees(std::sqrt(square))
               << degrees(worst) << "°"
               << ""
               << ""
               << "";
}

// Fewer entries of the matrix were estimated than gains and the angles between axes are.
bool HoldsMisalignment(const TriadCalibration& sensor) {
  return (sensor.sensitivity_sigma.array() > 0.0).count() < 6;
}

}  // namespace

Section CorrectedErrorSection(const Calibration& calibration, bool turns) {
  Section section{"Error before and after", {}};
  if (!calibration.IsUsable() || calibration.covariance.parameters.empty()) return section;
  Table table = BeforeAndAfter(calibration);
  AddHeading(calibration, &table);
  if (table.rows.empty()) return section;
  section.Add(std::move(table));
  section.Add(
      "RMS and worst error over all directions of gravity and field; in degrees: of the direction. "
      "Raw: in nominal units, as the log has them. Corrected: by the σ of the parameters; the "
      "noise "
      "of a reading comes on top.");
  for (const Triad triad : kTriads) {
    if (!calibration.sensors[triad] || !HoldsMisalignment(*calibration.sensors[triad])) continue;
    section.Add("Misalignment of the " + std::string(TriadName(triad)) +
                " was not estimated, and its error is not in these numbers.");
  }
  if (calibration.sensors[Triad::kMagnetometer] && calibration.reference.field_nominal) {
    section.Add(
        "Field strength not given: the common scale of the magnetometer is unknown, and its "
        "readings have the relative error of the assumed strength. Directions and headings do "
        "not depend on it.");
  }
  section.draw = [&calibration, turns] {
    std::vector<Drawing> drawings =
        OfEachSensor([&](Triad triad) { return SphereDrawing(calibration, triad, turns); });
    drawings.push_back(HeadingDrawing(calibration));
    return drawings;
  };
  return section;
}

}  // namespace truetriad
