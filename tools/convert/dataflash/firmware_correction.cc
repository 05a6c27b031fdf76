// SPDX-License-Identifier: Apache-2.0
#include "tools/convert/dataflash/firmware_correction.h"

#include <cmath>
#include <optional>

#include "formats/parameter_pattern.h"
#include "io/yaml_text.h"
#include "model/board_rotation.h"

namespace truetriad::convert {
namespace {

/// The name of a parameter of an inertial sensor: "ACC", "GYR" or "TCAL" of `instance`, which
/// counts from 0.
std::string InertialName(std::string_view sensor, std::string_view rest, int instance) {
  return Expanded("INS_" + std::string(sensor) + std::string(rest), instance + 1);
}
/// The name of a parameter of a compass; its sets of parameters are counted from 1.
std::string CompassName(std::string_view rest, int slot) {
  return Expanded("COMPASS_" + std::string(rest), slot);
}

Result<double> Value(const Parameters& parameters, const std::string& name) {
  const auto found = parameters.find(name);
  if (found == parameters.end())
    return Error(ErrorCode::kMissingKey, "the log has no parameter " + name);
  if (!std::isfinite(found->second))
    return Error(ErrorCode::kUnreadableNumber, "parameter " + name + " is not a finite number");
  return found->second;
}

Result<Eigen::Vector3d> Vector(const Parameters& parameters, const std::string& prefix) {
  Eigen::Vector3d values;
  for (int axis = 0; axis < 3; ++axis) {
    TRUETRIAD_ASSIGN_OR_RETURN(values[axis], Value(parameters, prefix + "_" + "XYZ"[axis]));
  }
  return values;
}

/// A sensor's device ID, 24 bits in firmware; unset: the log does not state it, or states 0.
std::optional<std::int64_t> IdIn(const Parameters& parameters, const std::string& name) {
  const Result<double> id = Value(parameters, name);
  if (!id || !(*id > 0.0 && *id < 0x1p24)) return std::nullopt;
  return static_cast<std::int64_t>(*id);
}

/// The parameter set of compass `instance`. Compasses are logged in the order of COMPASS_PRIOn_ID,
/// while sets have the order of COMPASS_DEV_ID (AP_Compass.cpp: _get_state_id). Error: no set has
/// the id.
Result<int> CompassSlot(const Parameters& parameters, int instance) {
  const std::string name = CompassName("PRIO@_ID", instance + 1);
  const std::optional<std::int64_t> id = IdIn(parameters, name);
  bool is_any_stated = false;
  for (const int slot : {1, 2, 3}) {
    const std::optional<std::int64_t> its_id = IdIn(parameters, CompassName("DEV_ID#", slot));
    if (id && its_id == id) return slot;
    is_any_stated = is_any_stated || its_id;
  }
  if (!id || !is_any_stated) return instance + 1;
  return Error(ErrorCode::kInvalidValue, "no COMPASS_DEV_ID equals " + name);
}

/// The rotation from the board to the vehicle. Sensors on the board are corrected before this
/// rotation, a compass after it.
Result<Eigen::Matrix3d> RotationOf(const Parameters& parameters) {
  TRUETRIAD_ASSIGN_OR_RETURN(const double number, Value(parameters, "AHRS_ORIENTATION"));
  const auto turn_deg = BoardTurnDeg(number, kBoardRotations.size());
  if (turn_deg) return TurnOf(*turn_deg);
  return Error(ErrorCode::kInvalidValue, "AHRS_ORIENTATION is not a supported rotation");
}

/// Roll, pitch and yaw from an external compass's axes into the recording's axes: ORIENT turns the
/// compass's readings into the vehicle's axes, and `applied:` turns them into the board's axes.
/// Unset: the compass is on the board, and `applied:` only undoes AHRS_ORIENTATION.
std::optional<Eigen::Vector3d> MountDegOf(const Parameters& parameters, int slot) {
  const Result<double> external =
      Value(parameters, slot == 1 ? "COMPASS_EXTERNAL" : CompassName("EXTERN#", slot));
  if (!external || *external == 0.0) return std::nullopt;
  const Result<double> number = Value(parameters, CompassName("ORIENT#", slot));
  const auto turn_deg = BoardTurnDeg(number ? *number : 0.0, kBoardRotations.size());
  const Result<Eigen::Matrix3d> board = RotationOf(parameters);
  if (!turn_deg || !board) return std::nullopt;
  return TurnDegOf(board->transpose() * TurnOf(*turn_deg));
}

/// The `thermal:` line for P(T) − P(T_cal); empty if firmware lacks such terms or they are off.
Result<std::string> Thermal(const Parameters& parameters, std::string_view sensor, int instance) {
  const std::string prefix = InertialName("TCAL", "@_", instance);
  if (!IsCorrectedByTemperature(parameters, instance)) return std::string();
  TRUETRIAD_ASSIGN_OR_RETURN(const double low, Value(parameters, prefix + "TMIN"));
  TRUETRIAD_ASSIGN_OR_RETURN(const double high, Value(parameters, prefix + "TMAX"));
  TRUETRIAD_ASSIGN_OR_RETURN(const double calibrated,
                             Value(parameters, InertialName(sensor, "@_CALTEMP", instance)));
  if (high <= low)
    return Error(ErrorCode::kInvalidValue, prefix + "TMAX is not above " + prefix + "TMIN");
  YamlText text;
  text << "\n    thermal: {reference_degc: 35, calibrated_degc: " << calibrated << ", range_degc: ["
       << low << ", " << high << "], coefficients: [";
  for (int power = 1; power <= 3; ++power) {
    TRUETRIAD_ASSIGN_OR_RETURN(
        const Eigen::Vector3d row,
        Vector(parameters, prefix + std::string(sensor) + std::to_string(power)));
    text << (power > 1 ? ", " : "") << row * 1e-6;  // Firmware states millionths.
  }
  return (text << "]}").str();
}

/// INS_ACCSCAL of an accelerometer; ones for a gyroscope.
Result<Eigen::Vector3d> InertialScale(const Parameters& parameters,
                                      std::string_view sensor,
                                      int instance) {
  if (sensor != "ACC") return Eigen::Vector3d(Eigen::Vector3d::Ones());
  const std::string name = InertialName(sensor, "#SCAL", instance);
  Result<Eigen::Vector3d> scale = Vector(parameters, name);
  if (scale && (scale->array() == 0.0).any())
    return Error(ErrorCode::kInvalidValue,
                 name + " is zero: this accelerometer has no scale calibration");
  return scale;
}

Result<std::string> InertialCorrection(const Parameters& parameters,
                                       CorrectionOrder order,
                                       std::string_view sensor,
                                       int instance) {
  TRUETRIAD_ASSIGN_OR_RETURN(const Eigen::Vector3d offset,
                             Vector(parameters, InertialName(sensor, "#OFFS", instance)));
  TRUETRIAD_ASSIGN_OR_RETURN(const Eigen::Matrix3d rotation, RotationOf(parameters));
  TRUETRIAD_ASSIGN_OR_RETURN(const Eigen::Vector3d scale,
                             InertialScale(parameters, sensor, instance));
  YamlText text;
  if (order == CorrectionOrder::kVehicleFrame) {
    // (R·y) ∘ s − o in the form of a manifest: M·(y − p) with M = diag(s)·R, p = Rᵀ·(o / s).
    const Eigen::Vector3d subtracted = rotation.transpose() * offset.cwiseQuotient(scale);
    const Eigen::Matrix3d product = scale.asDiagonal() * rotation;
    text << "\n    offset: " << subtracted << "\n    matrix: " << product << "\n";
    return text.str();
  }
  text << "\n    offset: " << offset;
  if (sensor == "ACC") text << "\n    scale: " << scale;
  if (!rotation.isIdentity(0.0)) text << "\n    matrix: " << rotation;
  TRUETRIAD_ASSIGN_OR_RETURN(const std::string thermal, Thermal(parameters, sensor, instance));
  return (text << thermal << "\n").str();
}

Result<std::string> CompassCorrection(const Parameters& parameters, int instance) {
  TRUETRIAD_ASSIGN_OR_RETURN(const Eigen::Vector3d added, CompassOffsets(parameters, instance));
  TRUETRIAD_ASSIGN_OR_RETURN(const Eigen::Matrix3d matrix, CompassMatrix(parameters, instance));
  // D·(R·y + o) = D·R·(y + Rᵀ·o), y in the board's axes; a manifest subtracts its offset.
  const Result<Eigen::Matrix3d> known = RotationOf(parameters);
  const Eigen::Matrix3d rotation = known ? *known : Eigen::Matrix3d(Eigen::Matrix3d::Identity());
  const Eigen::Vector3d offset = Eigen::Vector3d::Zero() - rotation.transpose() * added;
  const Eigen::Matrix3d product = matrix * rotation;
  YamlText text;
  text << "\n    offset: " << offset << "\n    matrix: " << product << "\n";
  return text.str();
}

}  // namespace

bool IsCorrectedByTemperature(const Parameters& parameters, int instance) {
  const auto enabled = parameters.find(InertialName("TCAL", "@_ENABLE", instance));
  // 1: corrects. 2: learns without correcting. Absent: firmware before 4.1.
  return enabled != parameters.end() && enabled->second == 1.0;
}

Tags DeviceOf(const Parameters& parameters, int instance) {
  Tags device;
  device.firmware = "ardupilot";
  const Result<int> compass = CompassSlot(parameters, instance);
  const PerTriad<std::string> names = {
      {InertialName("ACC", "#_ID", instance),
       InertialName("GYR", "#_ID", instance),
       compass ? CompassName("DEV_ID#", *compass) : CompassName("PRIO@_ID", instance + 1)}};
  for (const Triad triad : kTriads) {
    const bool is_compass = triad == Triad::kMagnetometer;
    device.device_ids[triad] = IdIn(parameters, names[triad]);
    device.device_slots[triad] = !is_compass ? instance + 1 : compass ? *compass : Tags::kNoSlot;
  }
  const Result<double> number = Value(parameters, "AHRS_ORIENTATION");
  if (compass) device.magnetometer_mount_deg = MountDegOf(parameters, *compass);
  if (number) device.magnetometer_turn_deg = BoardTurnDeg(*number, kBoardRotations.size());
  return device;
}

Result<Eigen::Vector3d> CompassOffsets(const Parameters& parameters, int instance) {
  TRUETRIAD_ASSIGN_OR_RETURN(const int slot, CompassSlot(parameters, instance));
  return Vector(parameters, CompassName("OFS#", slot));
}

Result<Eigen::Matrix3d> CompassMatrix(const Parameters& parameters, int instance) {
  TRUETRIAD_ASSIGN_OR_RETURN(const int slot, CompassSlot(parameters, instance));
  TRUETRIAD_ASSIGN_OR_RETURN(const Eigen::Vector3d d,
                             Vector(parameters, CompassName("DIA#", slot)));
  TRUETRIAD_ASSIGN_OR_RETURN(const Eigen::Vector3d o,
                             Vector(parameters, CompassName("ODI#", slot)));
  const auto scale = parameters.find(CompassName("SCALE#", slot));
  return CompassMatrixOf<double>(d, o, scale == parameters.end() ? 0.0 : scale->second);
}

Result<std::string> AppliedByFirmware(const Parameters& parameters,
                                      CorrectionOrder order,
                                      Triad triad,
                                      int instance) {
  switch (triad) {
    case Triad::kAccelerometer:
      return InertialCorrection(parameters, order, "ACC", instance);
    case Triad::kGyroscope:
      return InertialCorrection(parameters, order, "GYR", instance);
    case Triad::kMagnetometer:
      return CompassCorrection(parameters, instance);
  }
  return Error(ErrorCode::kMissingSensor, "no such triad");
}

}  // namespace truetriad::convert
