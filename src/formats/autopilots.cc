// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <sstream>

#include "formats/format.h"
#include "formats/parameter_pattern.h"
#include "formats/text.h"
#include "model/board_rotation.h"

// PX4 parameters as QGroundControl loads them, and ArduPilot parameters. Both correct in float32
// before the board's rotation, except the compass of ArduPilot, which is corrected after it:
//
//   PX4        accelerometer  (y - P(T) - OFF) o SCALE                      m/s^2
//              gyroscope       y - P(T) - OFF                               rad/s
//              magnetometer   D (y - P(T) - OFF), D symmetric               gauss
//   ArduPilot  accelerometer  (y - [P(T) - P(CALTEMP)] - OFFS) o SCAL       m/s^2
//              gyroscope       y - [P(T) - P(CALTEMP)] - OFFS               rad/s
//              compass        D s (y + OFS), D symmetric, s = SCALE         milligauss
//
// ArduPilot up to 3.2 computes SCAL o y - OFFS for the accelerometer, with y in the vehicle's axes.
//
//   P(T) = scale (X0 + X1 d + X2 d^2 + X3 d^3),  d = clamp(T, TMIN, TMAX) - centre
//
// In PX4, centre is TREF and scale 1. In ArduPilot, centre is 35 degC, scale 1e-6, and X0 is 0.
// PX4: src/lib/sensor_calibration/{Accelerometer,Gyroscope,Magnetometer}.hpp (Correct),
// src/modules/temperature_compensation/TemperatureCompensation.cpp. ArduPilot:
// AP_InertialSensor/AP_InertialSensor_{Backend,tempcal,Params}.cpp,
// AP_Compass/AP_Compass_{Backend,Params}.cpp.

namespace truetriad {
namespace {

constexpr std::size_t kFirmwareOrder = 3;                // Degree of P(T) above.
constexpr double kCentreDegc = 35.0, kTermScale = 1e-6;  // ArduPilot's centre and scale of P(T).
// The value of ArduPilot's CALTEMP until a sensor is calibrated.
constexpr float kNoCalibrationTemperature = -300.0F;

/// An autopilot's names for the parameters of a sensor, as patterns.
struct SensorNames {
  Triad triad;
  std::vector<Field> fields;
  std::string_view id;
  std::string thermal = {};    ///< Beginning of the names of ID, TMIN, TMAX; empty: no terms.
  std::string enable = {};     ///< The parameter that is 1 if the terms are in use.
  std::string reference = {};  ///< TREF, or CALTEMP.
  std::string term = {};
  std::string_view scale = {};  ///< SCALE of a compass.
};

struct Autopilot {
  std::string_view name;
  bool is_px4;
  int first_instance;
  PerTriad<int> last_instance;
  std::vector<SensorNames> sensors;
};

const Autopilot& Px4() {
  const auto with_thermal = [](SensorNames names, const std::string& letter) {
    names.thermal = "TC_" + letter + "@_";
    names.enable = "TC_" + letter + "_ENABLE";
    names.reference = names.thermal + "TREF";
    names.term = names.thermal + "X%_?";
    return names;
  };
  using enum Quantity;
  static const auto& autopilot = *new Autopilot{
      "px4",
      true,
      0,
      {{3, 3, 3}},
      {with_thermal({Triad::kAccelerometer,
                     {{"CAL_ACC@_*OFF", kBias}, {"CAL_ACC@_*SCALE", kDiagonal}},
                     "CAL_ACC@_ID"},
                    "A"),
       with_thermal({Triad::kGyroscope, {{"CAL_GYRO@_*OFF", kBias}}, "CAL_GYRO@_ID"}, "G"),
       with_thermal({Triad::kMagnetometer,
                     {{"CAL_MAG@_*OFF", kBias},
                      {"CAL_MAG@_*SCALE", kDiagonal},
                      {"CAL_MAG@_*ODIAG", kOffDiagonal}},
                     "CAL_MAG@_ID"},
                    "M")}};
  return autopilot;
}

const Autopilot& ArduPilot() {
  const auto with_thermal = [](SensorNames names, const std::string& sensor) {
    names.thermal = "INS_TCAL@_";
    names.enable = names.thermal + "ENABLE";
    names.reference = "INS_" + sensor + "@_CALTEMP";
    names.term = names.thermal + sensor + "%_*";
    return names;
  };
  using enum Quantity;
  static const auto& autopilot = *new Autopilot{
      "ardupilot",
      false,
      1,
      {{5, 5, 3}},
      {with_thermal({Triad::kAccelerometer,
                     {{"INS_ACC#OFFS_*", kBias}, {"INS_ACC#SCAL_*", kDiagonal}},
                     "INS_ACC#_ID"},
                    "ACC"),
       with_thermal({Triad::kGyroscope, {{"INS_GYR#OFFS_*", kBias}}, "INS_GYR#_ID"}, "GYR"),
       {.triad = Triad::kMagnetometer,
        .fields = {{"COMPASS_OFS#_*", kBiasAdded},
                   {"COMPASS_DIA#_*", kDiagonal},
                   {"COMPASS_ODI#_*", kOffDiagonal}},
        .id = "COMPASS_DEV_ID#",
        .scale = "COMPASS_SCALE#"}}};
  return autopilot;
}

/// Returns `slot` if the autopilot has a parameter set of that number. `id`: the pattern of its ID
/// parameter. Errors: `slot` is kNoSlot, which means that no set is free (bad input); no set has
/// the number `slot` (usage).
Result<int> SlotOf(const Autopilot& autopilot,
                   Triad triad,
                   std::string_view id,
                   std::int64_t slot) {
  const int first = autopilot.first_instance, last = autopilot.last_instance[triad];
  if (first <= slot && slot <= last) return static_cast<int>(slot);
  if (slot == Tags::kNoSlot) {
    return Error(
        ErrorCode::kNotRepresentable,
        "none of the log's " + Expanded(id, first) + " to " + Expanded(id, last) +
            " is free for the " + std::string(TriadName(triad)) +
            ": each belongs to another sensor, or the log does not state this sensor's own id; "
            "state this id with --id, or set the id of a removed sensor to 0 and record again");
  }
  return Error(ErrorCode::kInvalidArgument,
               "--instance=" + std::to_string(slot) + ": " + std::string(autopilot.name) + " has " +
                   (triad == Triad::kMagnetometer ? "compasses " : "sensors ") +
                   std::to_string(first) + " to " + std::to_string(last));
}

/// The coefficients in powers of (T - to) of the polynomial sum_k c_k (T - from)^k.
std::vector<Eigen::Vector3d> Shifted(std::vector<Eigen::Vector3d> terms, double from, double to) {
  for (std::size_t first = 0; first + 1 < terms.size(); ++first) {
    for (std::size_t k = terms.size() - 1; k-- > first;) terms[k] += (to - from) * terms[k + 1];
  }
  return terms;
}

/// The middle of a comment line that states the axes of a magnetometer. The name of the sensor's ID
/// parameter stands before it; roll, pitch and yaw from the board's axes stand after it.
constexpr std::string_view kInAxesTurnedBy = ": in axes turned by ";

// ---------------------------------------------------------------------------------------- writing

class ParameterText {
 public:
  explicit ParameterText(bool is_px4) : is_px4_(is_px4) {}

  void Float(const std::string& name, double value) {
    // Some tools that load ArduPilot's files do not read exponents.
    const auto number = static_cast<float>(value);
    Line(name, is_px4_ ? NumberText(number) : PlainNumberText(number), "9");
  }
  void Integer(std::string_view pattern, std::int64_t value) {
    Line(Expanded(pattern, slot), std::to_string(value), "6");
  }
  void Number(std::string_view pattern, double value) { Float(Expanded(pattern, slot), value); }
  void Vector(std::string_view pattern, const Eigen::VectorXd& values, std::size_t power = 0) {
    for (std::size_t axis = 0; axis < 3; ++axis)
      Float(Expanded(pattern, slot, axis, power), values[static_cast<Eigen::Index>(axis)]);
  }
  void Turn(std::string_view id, const Eigen::Vector3d& turn_deg) {
    text += "# " + Expanded(id, slot) + std::string(kInAxesTurnedBy);
    for (const double angle : turn_deg) text += PlainNumberText(angle) + " ";
    text += "deg (roll, pitch, yaw) from the board's.\n";
  }
  std::string text;
  int slot = 0;  ///< The number of the parameter set that is written.

 private:
  void Line(const std::string& name, const std::string& value, std::string_view type) {
    text += is_px4_ ? "1\t1\t" + name + "\t" + value + "\t" : name + "," + value;
    if (is_px4_) text += type;
    text += '\n';
  }

  bool is_px4_;
};

void WarnOfPx4(const SensorNames& names, int slot, const WriteRequest& request) {
  const TriadCalibration& sensor = *request.calibration.sensors[names.triad];
  const Eigen::Vector3d scale = sensor.model.Correction().diagonal();
  const Tags& tags = request.calibration.tags;
  const bool has_scale = names.fields.size() > 1,
             has_id = request.options.device_ids[names.triad].has_value();
  const bool is_magnetometer = names.triad == Triad::kMagnetometer;
  const bool is_of_log = tags.firmware == Px4().name;
  const auto warn = [&](bool is_so, const std::string& what) {
    if (is_so) request.warnings.push_back(std::string(TriadName(names.triad)) + ": " + what);
  };
  // From the sources above: PX4 ignores shorter offsets and rejects scales outside these limits.
  constexpr double kIgnoredOffset = 0.01, kLeastScale = 0.1, kMostScale = 3.0;
  warn(!has_id,
       "without --id, PX4 uses these values only if " + Expanded(names.id, slot) +
           " already matches the sensor");
  warn(sensor.model.bias.norm() < kIgnoredOffset,
       "some versions of PX4 ignore offsets this small (below 0.01 " + sensor.input_unit + ")");
  warn(has_scale && (scale.minCoeff() < kLeastScale || scale.maxCoeff() > kMostScale),
       "PX4 accepts only scales between 0.1 and 3");
  warn(sensor.thermal && is_magnetometer,
       "versions of PX4 without TC_M_ENABLE do not compensate magnetometers for temperature: the "
       "offset is then correct only at the reference temperature");
  warn(is_of_log && has_id && !tags.device_slots[names.triad],
       "the log does not state which parameters the vehicle uses for this sensor; check that " +
           Expanded(names.id, slot) + " is its device id, or 0");
  warn(is_magnetometer && is_of_log && !tags.magnetometer_turn_deg,
       "its mounting is not known from the log; check " + Expanded("CAL_MAG@_ROT", slot));
}

void WarnOfArduPilot(const SensorNames& names, const WriteRequest& request) {
  const TriadCalibration& sensor = *request.calibration.sensors[names.triad];
  const Eigen::Vector3d &bias = sensor.model.bias, scale = sensor.model.Correction().diagonal();
  const Tags& tags = request.calibration.tags;
  // Limits of the firmware's arming checks.
  constexpr double kMaxOffsetMps2 = 3.5, kMinAccelScale = 0.8, kMaxAccelScale = 1.2;
  constexpr double kMaxOffsetMilligauss = 1800.0;  // COMPASS_OFFS_MAX of most boards.
  const auto warn = [&](Triad triad, bool is_so, const std::string& what) {
    if (triad == names.triad && is_so)
      request.warnings.push_back(std::string(TriadName(triad)) + ": ArduPilot " + what);
  };
  warn(Triad::kAccelerometer,
       bias.cwiseAbs().maxCoeff() > kMaxOffsetMps2 || scale.minCoeff() < kMinAccelScale ||
           scale.maxCoeff() > kMaxAccelScale,
       "refuses to arm with offsets beyond 3.5 m/s^2 or scales outside 0.8 to 1.2");
  warn(Triad::kGyroscope,
       true,
       "re-estimates these offsets at every start; set INS_GYR_CAL to 0 to keep them");
  warn(Triad::kMagnetometer,
       bias.norm() > kMaxOffsetMilligauss,
       "refuses to arm with offsets longer than COMPASS_OFFS_MAX (1800 mG unless changed); these "
       "are " +
           RoundedText(bias.norm(), 4) + " mG");
  warn(Triad::kMagnetometer,
       !Reads(tags.firmware, ArduPilot().name) || !tags.magnetometer_turn_deg,
       "corrects after rotating the readings into the vehicle's axes, so these values are valid "
       "only where the recording's axes are the vehicle's");
}

/// Whether this firmware subtracts offsets after scaling.
bool IsScaledFirst(std::string_view firmware, Triad triad) {
  return firmware == kArduPilotOf2014 && triad == Triad::kAccelerometer;
}

/// Temperature range that ArduPilot stores for an IMU: the overlap of its sensors' ranges; unset if
/// no sensor has temperature terms. Error: a sensor's reference temperature is outside the overlap.
Result<std::optional<Eigen::Vector2d>> CommonRange(const Calibration& calibration) {
  std::optional<Eigen::Vector2d> range;
  for (const std::optional<TriadCalibration>& sensor : calibration.sensors) {
    if (!sensor || !sensor->thermal) continue;
    const Eigen::Vector2d& own = sensor->thermal->range_degc;
    if (!range) range = own;
    range = Eigen::Vector2d(std::max((*range)[0], own[0]), std::min((*range)[1], own[1]));
  }
  for (const Triad triad : kTriads) {
    const std::optional<TriadCalibration>& sensor = calibration.sensors[triad];
    if (!sensor || !sensor->thermal) continue;
    const double reference = sensor->thermal->reference_degc;
    if ((*range)[0] <= reference && reference <= (*range)[1]) continue;
    return Error(ErrorCode::kNotRepresentable,
                 "ardupilot needs the reference temperature (" + RoundedText(reference, 4) +
                     " degC for the " + std::string(TriadName(triad)) +
                     ") within the calibrated range (" + RoundedText((*range)[0], 4) + " to " +
                     RoundedText((*range)[1], 4) +
                     " degC, common to accelerometer and gyroscope); calibrate with another "
                     "reference.temperature_degc");
  }
  return range;
}

void WriteTerms(bool is_px4,
                const SensorNames& names,
                const ThermalTerms& thermal,
                ParameterText* out) {
  // The constant term is part of the offset, as in the calibrations that the autopilots make.
  std::vector<Eigen::Vector3d> terms = {Eigen::Vector3d::Zero()};
  terms.insert(terms.end(), thermal.bias.begin(), thermal.bias.end());
  terms.resize(kFirmwareOrder + 1, Eigen::Vector3d::Zero());
  out->Number(names.reference, thermal.reference_degc);
  if (!is_px4) terms = Shifted(terms, thermal.reference_degc, kCentreDegc);
  const double scale = is_px4 ? 1.0 : kTermScale;
  for (std::size_t power = is_px4 ? 0 : 1; power <= kFirmwareOrder; ++power)
    out->Vector(names.term, terms[power] / scale, power);
}

void WriteRange(const SensorNames& names, const Eigen::Vector2d& range_degc, ParameterText* out) {
  out->Number(names.thermal + "TMIN", range_degc[0]);
  out->Number(names.thermal + "TMAX", range_degc[1]);
}

/// Writes the temperature terms of a sensor. If the sensor has none, the file disables old terms in
/// the vehicle. In PX4 the ID of their set becomes 0. In ArduPilot the terms become zero if the
/// other sensor has terms; otherwise CALTEMP cancels them at the recorded temperature, or, without
/// a recorded temperature, they are switched off.
Status WriteThermal(const Autopilot& autopilot,
                    const SensorNames& names,
                    const WriteRequest& request,
                    bool imu_has_terms,
                    ParameterText* out) {
  const Calibration& calibration = request.calibration;
  const std::optional<ThermalTerms>& thermal = calibration.sensors[names.triad]->thermal;
  if (autopilot.is_px4) {
    const std::optional<std::int64_t> id = request.options.device_ids[names.triad];
    const std::int64_t slot = request.options.thermal_slots[names.triad].value_or(out->slot);
    if (!thermal && slot == Tags::kNoSlot) return {};  // The vehicle has no old terms of it.
    const std::string number = names.thermal + "ID";
    TRUETRIAD_ASSIGN_OR_RETURN(out->slot, SlotOf(autopilot, names.triad, number, slot));
    if (id || !thermal) out->Integer(number, thermal ? *id : 0);
    if (!thermal) return {};
    WriteRange(names, thermal->range_degc, out);
    WriteTerms(true, names, *thermal, out);
    out->Integer(names.enable, 1);
    std::string ended;
    for (const std::int64_t idle : request.options.idle_thermal_slots[names.triad]) {
      if (idle == slot) continue;
      TRUETRIAD_ASSIGN_OR_RETURN(out->slot, SlotOf(autopilot, names.triad, number, idle));
      out->Integer(number, 0);
      ended += (ended.empty() ? "" : " and ") + Expanded(number, out->slot);
    }
    if (!ended.empty()) {
      request.warnings.push_back(
          std::string(TriadName(names.triad)) +
          ": the vehicle has unused temperature terms of other sensors, which " + names.enable +
          " = 1 would switch on; the file sets " + ended + " to 0, so that they stay unused");
    }
  } else if (!names.thermal.empty()) {
    const auto& recorded_degc = calibration.reference.recorded_degc;
    ThermalTerms none;
    none.reference_degc = recorded_degc ? (*recorded_degc)[1] : kCentreDegc;
    if (imu_has_terms) {
      WriteTerms(false, names, thermal.value_or(none), out);
    } else if (recorded_degc) {
      out->Number(names.reference, none.reference_degc);
    } else if (names.triad == Triad::kGyroscope || !calibration.sensors[Triad::kGyroscope]) {
      out->Integer(names.enable, 0);
    }
  }
  return {};
}

Result<Files> WriteParameters(const Autopilot& autopilot, const WriteRequest& request) {
  const int instance = request.options.instance.value_or(autopilot.first_instance);
  std::optional<Eigen::Vector2d> common_range;
  if (!autopilot.is_px4) {
    TRUETRIAD_ASSIGN_OR_RETURN(common_range, CommonRange(request.calibration));
  }
  ParameterText out(autopilot.is_px4);
  out.text = CommentText("# ", request.comment);
  for (const SensorNames& names : autopilot.sensors) {
    const std::optional<TriadCalibration>& sensor = request.calibration.sensors[names.triad];
    if (sensor) {
      TRUETRIAD_ASSIGN_OR_RETURN(out.slot,
                                 SlotOf(autopilot,
                                        names.triad,
                                        names.id,
                                        request.options.slots[names.triad].value_or(instance)));
      const std::optional<std::int64_t> id = request.options.device_ids[names.triad];
      if (id) out.Integer(names.id, *id);
      const Tags& tags = request.calibration.tags;
      if (names.triad == Triad::kMagnetometer && tags.magnetometer_turn_deg &&
          Reads(tags.firmware, autopilot.name)) {
        out.Turn(names.id, *tags.magnetometer_turn_deg);
      }
      for (const Field& field : names.fields) {
        Eigen::VectorXd value = ValueOf(field.quantity, *sensor);
        if (IsScaledFirst(tags.firmware, names.triad) && field.quantity == Quantity::kBias)
          value = value.cwiseProduct(ValueOf(Quantity::kDiagonal, *sensor)).eval();
        out.Vector(field.name, value);
      }
      if (!names.scale.empty()) out.Number(names.scale, 1.0);
      if (autopilot.is_px4) {
        WarnOfPx4(names, out.slot, request);
      } else {
        WarnOfArduPilot(names, request);
      }
      TRUETRIAD_RETURN_IF_ERROR(
          WriteThermal(autopilot, names, request, common_range.has_value(), &out));
    }
    if (names.triad == Triad::kGyroscope && common_range) {
      WriteRange(names, *common_range, &out);
      out.Integer(names.enable, 1);
    }
  }
  return Files{{"", std::move(out.text)}};
}

// ---------------------------------------------------------------------------------------- reading

/// The numbers in an autopilot's parameter file by name, as the firmware stores them.
struct ParameterList {
  std::map<std::string, float> values;
  /// Whole numbers other than 0, without float32's rounding. An ID of 0 means that no sensor
  /// exists.
  std::map<std::string, std::int64_t> ids;
  std::map<std::string, Eigen::Vector3d> turns_deg;  ///< Angles from comments (kInAxesTurnedBy).

  /// `otherwise`: the firmware's default, returned for a parameter that the file does not hold.
  float Get(const std::string& name, float otherwise) const {
    const auto found = values.find(name);
    return found == values.end() ? otherwise : found->second;
  }
  std::optional<std::int64_t> Id(const std::string& name) const {
    const auto found = ids.find(name);
    return found == ids.end() ? std::nullopt : std::optional(found->second);
  }
  /// The number of the first parameter set whose parameter `pattern`, its ID, has the value `id`.
  /// If `id` is unset: the number of the first set without an ID.
  std::optional<int> SlotWith(const std::optional<std::int64_t>& id,
                              const std::string& pattern,
                              const Autopilot& autopilot,
                              Triad triad) const {
    for (int slot = autopilot.first_instance; slot <= autopilot.last_instance[triad]; ++slot) {
      if (Id(Expanded(pattern, slot)) == id) return slot;
    }
    return std::nullopt;
  }
};

/// Reads one parameter per line: field `name_field`, counted from 0, is its name, the next field
/// its value. Blanks, tabs or commas separate fields; `#` starts a comment. Errors name the line.
Result<ParameterList> ParseList(const ExportedFile& file, std::size_t name_field) {
  ParameterList list;
  for (const auto& [place, line, words] : WordLines(file)) {
    const std::size_t said = line.starts_with("# ") ? line.find(kInAxesTurnedBy) : line.npos;
    if (said != line.npos) {
      std::istringstream angles(line.substr(said + kInAxesTurnedBy.size()));
      Eigen::Vector3d turn_deg;
      if (angles >> turn_deg[0] >> turn_deg[1] >> turn_deg[2])
        list.turns_deg[line.substr(2, said - 2)] = turn_deg;
    }
    if (words.empty()) continue;
    if (words.size() < name_field + 2) {
      return Error(ErrorCode::kWrongFormat,
                   place,
                   "`" + line + "` is not a parameter; expected a name and a value");
    }
    const std::string& name = words[name_field];
    const std::string& text = words[name_field + 1];
    const std::optional<float> value = ParseNumber<float>(text);
    if (!value || !std::isfinite(*value)) {
      return Error(
          ErrorCode::kUnreadableNumber,
          place,
          name + ": `" + text + "` is not a number; expected a name and a value on each line");
    }
    // Some programs write integers with decimals, "123.000".
    const std::size_t point = text.find('.');
    const bool is_whole =
        text.find_first_not_of('0', std::min(point, text.size() - 1) + 1) == text.npos;
    const auto id = ParseNumber<std::int64_t>(std::string_view(text).substr(0, point));
    if (id && is_whole && *id != 0) list.ids[name] = *id;
    if (!list.values.emplace(name, *value).second)
      return Error(ErrorCode::kDuplicateKey, place, name + " occurs twice; remove one");
  }
  return list;
}

/// The parameters of one sensor.
class SensorParameters {
 public:
  SensorParameters(const ParameterList& list, const SensorNames& names, int instance)
      : list_(list), names_(names), instance_(instance) {}

  /// Whether the list holds any offset of the sensor. An ID of 0 means that there is no sensor.
  bool IsThere() const {
    bool any = false;
    for (std::size_t axis = 0; axis < 3; ++axis)
      any = any || list_.values.contains(Expanded(names_.fields[0].name, instance_, axis));
    return any && Number(names_.id, 1.0F) != 0.0F;
  }

  float Number(std::string_view pattern, float otherwise) const {
    return list_.Get(Expanded(pattern, instance_), otherwise);
  }
  Eigen::Vector3f Vector(std::string_view pattern, float otherwise, std::size_t power = 0) const {
    Eigen::Vector3f vector;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      vector[static_cast<Eigen::Index>(axis)] =
          list_.Get(Expanded(pattern, instance_, axis, power), otherwise);
    }
    return vector;
  }

  /// The names of the sensor's offsets and scales that the list lacks; empty if it lacks none.
  std::string Missing() const {
    std::string missing;
    for (const Field& field : names_.fields) {
      if (field.quantity == Quantity::kOffDiagonal) continue;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const std::string name = Expanded(field.name, instance_, axis);
        if (!list_.values.contains(name)) missing += (missing.empty() ? "" : ", ") + name;
      }
    }
    return missing;
  }

  std::optional<std::int64_t> Id() const { return list_.Id(Expanded(names_.id, instance_)); }

  /// Number of the set with the sensor's temperature terms; unset if there is none. In PX4 this is
  /// the set with the sensor's ID, or, if the list states no IDs, the set with the sensor's number.
  std::optional<int> ThermalSlot(const Autopilot& autopilot) const {
    if (!autopilot.is_px4 || names_.thermal.empty()) return instance_;
    const std::string name = names_.thermal + "ID";
    const std::optional<std::int64_t> id = Id();
    const auto slot = list_.SlotWith(id, name, autopilot, names_.triad);
    if (id && slot) return slot;
    const bool is_said = list_.values.contains(Expanded(name, instance_));
    return is_said && (id || Number(name, 0.0F) == 0.0F) ? std::nullopt : std::optional(instance_);
  }

  /// The number of the PX4 set for new terms: the set with the sensor's ID. Without it: a set
  /// without an ID. Without either: kNoSlot.
  std::int64_t ThermalPlace(const Autopilot& autopilot) const {
    for (const std::optional<std::int64_t>& id : {Id(), {}}) {
      const auto slot = list_.SlotWith(id, names_.thermal + "ID", autopilot, names_.triad);
      if (slot) return *slot;
    }
    return Tags::kNoSlot;
  }

  CorrectionParts Parts(const Autopilot& autopilot, std::string_view firmware) const {
    Stated stated;
    for (const auto& [name, quantity, is_optional] : names_.fields) {
      const float otherwise = quantity == Quantity::kDiagonal ? 1.0F : 0.0F;
      stated[quantity] = Vector(name, otherwise).cast<double>();
    }
    Eigen::VectorXd& diagonal = stated[Quantity::kDiagonal];
    if (diagonal.size() == 0) diagonal = Eigen::Vector3d::Ones();
    if (IsScaledFirst(firmware, names_.triad))
      stated[Quantity::kBias] = stated[Quantity::kBias].cwiseQuotient(diagonal).eval();
    CorrectionParts parts = CorrectionParts::Of(stated);
    if (!names_.scale.empty()) {
      parts.matrix = CompassMatrixOf<float>(diagonal.cast<float>(),
                                            stated[Quantity::kOffDiagonal].cast<float>(),
                                            Number(names_.scale, 0.0F))
                         .cast<double>();
    }
    const std::optional<int> slot = ThermalSlot(autopilot);
    if (!names_.thermal.empty() && slot && Number(names_.enable, 0.0F) == 1.0F) {
      SensorParameters(list_, names_, *slot).AddThermal(autopilot.is_px4, &parts);
    }
    return parts;
  }

 private:
  void AddThermal(bool is_px4, CorrectionParts* parts) const {
    // If the list lacks the limits, the firmware's defaults hold.
    const float lowest = Number(names_.thermal + "TMIN", 0.0F);
    const float highest = Number(names_.thermal + "TMAX", is_px4 ? 100.0F : 70.0F);
    const float stated = Number(names_.reference, is_px4 ? 25.0F : kNoCalibrationTemperature);
    const float centre = is_px4 ? stated : static_cast<float>(kCentreDegc);
    const double scale = is_px4 ? 1.0 : kTermScale;
    std::array<Eigen::Vector3f, kFirmwareOrder + 1> terms;
    for (std::size_t power = 0; power <= kFirmwareOrder; ++power)
      terms[power] = Vector(names_.term, 0.0F, power);
    // ArduPilot has no constant term: INS_TCAL1_ACC0_X does not exist.
    if (!is_px4) terms[0].setZero();
    const auto polynomial = [=](float temperature) -> Eigen::Vector3f {
      const float d = std::clamp(temperature, lowest, highest) - centre;
      return (terms[0] + terms[1] * d + terms[2] * d * d + terms[3] * d * d * d) *
             static_cast<float>(scale);
    };
    const Eigen::Vector3f at_reference =
        is_px4 ? Eigen::Vector3f(Eigen::Vector3f::Zero()) : polynomial(stated);
    parts->thermal = [=](double temperature_degc) -> Eigen::Vector3d {
      return (polynomial(static_cast<float>(temperature_degc)) - at_reference).cast<double>();
    };
    ThermalTerms as_terms;
    as_terms.range_degc = {lowest, highest};
    as_terms.reference_degc = is_px4 ? stated : std::clamp(stated, lowest, highest);
    std::vector<Eigen::Vector3d> about;
    for (const Eigen::Vector3f& term : terms) about.emplace_back(scale * term.cast<double>());
    about = Shifted(about, centre, as_terms.reference_degc);
    if (is_px4) parts->thermal_constant = about[0];
    as_terms.bias.assign(about.begin() + 1, about.end());
    while (!as_terms.bias.empty() && as_terms.bias.back().isZero(0.0)) as_terms.bias.pop_back();
    if (!as_terms.bias.empty()) parts->thermal_terms = as_terms;
  }

  const ParameterList& list_;
  const SensorNames& names_;
  int instance_;
};

/// Roll, pitch and yaw from the board's axes to those in which a magnetometer is corrected; unset
/// if the list does not determine them.
std::optional<Eigen::Vector3d> TurnDegIn(const ParameterList& list,
                                         bool is_px4,
                                         std::string_view id,
                                         int instance) {
  const std::string rotation = is_px4 ? Expanded("CAL_MAG@_ROT", instance) : "AHRS_ORIENTATION";
  const auto said = list.turns_deg.find(Expanded(id, instance));
  if (!list.values.contains(rotation) && said != list.turns_deg.end()) return said->second;
  const auto number = [&list](const std::string& name) { return list.Get(name, -2.0F); };
  if (!is_px4) return BoardTurnDeg(number("AHRS_ORIENTATION"), kBoardRotations.size());
  const float own = number(rotation);
  if (own == -1.0F) return Eigen::Vector3d(Eigen::Vector3d::Zero());  // The sensor is on the board.
  const auto sensor = BoardTurnDeg(own, kPx4BoardRotations);
  const auto board = BoardTurnDeg(list.Get("SENS_BOARD_ROT", 0.0F), kPx4BoardRotations);
  if (!sensor || !board) return std::nullopt;
  Eigen::Vector3d level;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    level[static_cast<Eigen::Index>(axis)] =
        list.Get(Expanded("SENS_BOARD_*_OFF", instance, axis), 0.0F);
  }
  // Both rotations lead from their own axes into the vehicle's axes.
  return TurnDegOf(TurnOf(*sensor).transpose() * TurnOf(level) * TurnOf(*board));
}

Result<Carried> ReadParameters(const Autopilot& autopilot, const ReadRequest& request) {
  TRUETRIAD_ASSIGN_OR_RETURN(const int instance,
                             SlotOf(autopilot,
                                    Triad::kAccelerometer,
                                    autopilot.sensors[0].id,
                                    request.instance.value_or(autopilot.first_instance)));
  // In a QGroundControl file, each line has two ids, of vehicle and component, before the name.
  TRUETRIAD_ASSIGN_OR_RETURN(const ParameterList list,
                             ParseList(request.files[0], autopilot.is_px4 ? 2 : 0));
  Carried carried;
  for (const SensorNames& names : autopilot.sensors) {
    std::optional<std::int64_t> slot = request.slots[names.triad];
    if (const auto& id = request.device_ids[names.triad]) {
      slot = list.SlotWith(id, std::string(names.id), autopilot, names.triad);
      if (!slot) {
        carried.notes.push_back("no " + std::string(TriadName(names.triad)) +
                                " of the file has the device id " + std::to_string(*id));
        continue;
      }
    }
    const int of = static_cast<int>(slot.value_or(instance));
    const SensorParameters sensor(list, names, of);
    if (of > autopilot.last_instance[names.triad] || !sensor.IsThere()) continue;
    carried.parts[names.triad] = sensor.Parts(autopilot, request.firmware);
    if (const std::string missing = sensor.Missing(); !missing.empty()) {
      carried.notes.push_back(std::string(TriadName(names.triad)) + ": the file has no " + missing +
                              "; missing offsets are taken as 0, missing scales as 1");
    }
    Tags& device = carried.device;
    if (const auto id = sensor.Id()) {
      device.device_ids[names.triad] = id;
      device.device_slots[names.triad] = of;
      if (autopilot.is_px4) device.thermal_slots[names.triad] = sensor.ThermalPlace(autopilot);
    }
    if (names.triad == Triad::kMagnetometer) {
      device.magnetometer_turn_deg = TurnDegIn(list, autopilot.is_px4, names.id, of);
      if (!device.magnetometer_turn_deg) {
        const std::string rotation = autopilot.is_px4
                                         ? Expanded("CAL_MAG@_ROT", of) + " and SENS_BOARD_ROT"
                                         : "AHRS_ORIENTATION";
        carried.notes.push_back(
            "magnetometer: the file does not say how it is mounted on the board (" + rotation +
            "); assumed not rotated");
      }
    }
  }
  if (carried.device != Tags()) carried.device.firmware = autopilot.name;
  return carried;
}

}  // namespace

std::vector<Format> AutopilotFormats() {
  const auto held = [](MatrixForm matrix, std::string_view unit, int bias_order) -> TriadCapacity {
    return {.held = true,
            .matrix = matrix,
            .bias_order = bias_order,
            .reading_unit = unit,
            .result_in_reading_unit = true};
  };
  constexpr int kOrder = kFirmwareOrder;
  const TriadCapacity acceleration = held(MatrixForm::kDiagonal, "m/s^2", kOrder);
  const TriadCapacity rate = held(MatrixForm::kNone, "rad/s", kOrder);
  return {{.info = {"px4",
                    "PX4 parameters, for QGroundControl (.params)",
                    "px4.params",
                    Arithmetic::kFloat32,
                    true,
                    0},
           .is_firmware = true,
           .capacity = {{acceleration, rate, held(MatrixForm::kSymmetric, "G", kOrder)}},
           .write = std::bind_front(WriteParameters, std::cref(Px4())),
           .read = std::bind_front(ReadParameters, std::cref(Px4()))},
          {.info = {"ardupilot",
                    "ArduPilot parameters (.param)",
                    "ardupilot.param",
                    Arithmetic::kFloat32,
                    true,
                    1},
           .is_firmware = true,
           .capacity = {{acceleration, rate, held(MatrixForm::kSymmetric, "mG", 0)}},
           .write = std::bind_front(WriteParameters, std::cref(ArduPilot())),
           .read = std::bind_front(ReadParameters, std::cref(ArduPilot()))}};
}

}  // namespace truetriad
