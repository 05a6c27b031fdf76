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

/// The firmware's correction of inertial readings y; R is AHRS_ORIENTATION, vehicle <- sensor.
enum class CorrectionOrder {
  kSensorFrame,   ///< R·((y − offset) ∘ scale): since 2015.
  kVehicleFrame,  ///< (R·y) ∘ scale − offset: Copter and Plane up to 3.2.
};

/// The firmware's correction of sensor `instance` (from 0) in its log, as the text after
/// `applied.<triad>:` of a manifest (docs/recordings.md). ArduPilot: AP_InertialSensor.cpp,
/// AP_InertialSensor_Params.cpp, AP_Compass.cpp.
///
/// Error (bad input): a parameter is missing or not invertible; the message briefly names it.
Result<std::string> AppliedByFirmware(const Parameters& parameters,
                                      CorrectionOrder order,
                                      Triad triad,
                                      int instance);

/// Whether firmware compensates the temperature of the inertial sensors `instance`.
bool IsCorrectedByTemperature(const Parameters& parameters, int instance);

/// What the log states about sensors `instance`: their device IDs, the sets of their parameters,
/// and the rotation from the board's axes, in which recordings are, to the vehicle's axes, in which
/// compasses are corrected.
Tags DeviceOf(const Parameters& parameters, int instance);

/// The offset that firmware adds to a compass: x, y, z in mG. Errors: a parameter is missing; no
/// parameter set belongs to the compass.
Result<Eigen::Vector3d> CompassOffsets(const Parameters& parameters, int instance);
/// The matrix D·s by which firmware multiplies the sum of reading and offset. Errors: as
/// CompassOffsets.
Result<Eigen::Matrix3d> CompassMatrix(const Parameters& parameters, int instance);

}  // namespace truetriad::convert
