// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include <Eigen/Core>

#include "truetriad/base/result.h"
#include "truetriad/base/triad.h"
#include "truetriad/model/tags.h"

namespace truetriad::convert {

/// Parameters of a log by name.
using Parameters = std::map<std::string, double, std::less<>>;

/// How the firmware corrects inertial readings y; R is AHRS_ORIENTATION, vehicle <- sensor.
enum class CorrectionOrder {
  kSensorFrame,   ///< R·((y − offset) ∘ scale): since 2015.
  kVehicleFrame,  ///< (R·y) ∘ scale − offset: Copter and Plane up to 3.2.
};

/// What the firmware did to the readings of sensor `instance` (0-based) in its log, as the text
/// behind `applied.<triad>:` of a manifest (docs/recordings.md). ArduPilot: AP_InertialSensor.cpp,
/// AP_InertialSensor_Params.cpp, AP_Compass.cpp.
///
/// Error (bad input): which parameter is missing or cannot be undone, in a few words.
Result<std::string> AppliedByFirmware(const Parameters& parameters,
                                      CorrectionOrder order,
                                      Triad triad,
                                      int instance);

/// Whether firmware corrects the inertial sensors `instance` by their temperature.
bool IsCorrectedByTemperature(const Parameters& parameters, int instance);

/// What the log states of sensors `instance`: their numbers, where their parameters are, and the
/// turn from the board's axes, in which recordings are, into the vehicle's, in which compasses are
/// corrected.
Tags DeviceOf(const Parameters& parameters, int instance);

/// Compass offset, added: x, y, z in mG. Errors: missing; no set of parameters is this compass'.
Result<Eigen::Vector3d> CompassOffsets(const Parameters& parameters, int instance);
/// D·s, which multiplies the sum of reading and offset. Errors: as above.
Result<Eigen::Matrix3d> CompassMatrix(const Parameters& parameters, int instance);

}  // namespace truetriad::convert
