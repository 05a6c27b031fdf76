// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>

#include "formats/format.h"
#include "formats/number_text.h"
#include "formats/parameter_list.h"

// ArduPilot parameters. In float32; the accelerometer and gyroscope in the sensor's frame, the
// compass in that of the vehicle:
//
//   accelerometer  (y - [P(T) - P(T_cal)] - OFFS) o SCAL      m/s^2
//   gyroscope       y - [P(T) - P(T_cal)] - OFFS               rad/s
//   compass        D s (y + OFS)                               milligauss, D symmetric, s = SCALE
//   P(T)         = 1e-6 (c1 d + c2 d^2 + c3 d^3),  d = clamp(T, TMIN, TMAX) - 35 degC
//
// T_cal is clamped in the same way. ArduPilot: AP_InertialSensor/AP_InertialSensor_{Backend,
// tempcal,Params}.cpp, AP_Compass/AP_Compass_{Backend,Params}.cpp.

namespace truetriad {
namespace {

// Of P(T) above; the firmware has parameters of three compasses and of five inertial sensors.
constexpr int kArduPilotOrder = 3;
constexpr double kCentreDegc = 35.0, kTermScale = 1e-6;
constexpr int kCompasses = 3, kArduPilotInstances = 5;

/// Names of the parameters of one IMU, numbered from 1.
struct ImuNames {
  std::string offset[2];   // INS_ACCOFFS_, by the number of the triad: accelerometer, gyroscope
  std::string scale;       // INS_ACCSCAL_
  std::string id[2];       // INS_ACC_ID
  std::string caltemp[2];  // INS_ACC1_CALTEMP
  std::string thermal;     // INS_TCAL1_

  explicit ImuNames(int instance) {
    const std::string number = std::to_string(instance);
    const bool late = instance > 3;  // Names were full by then.
    const std::string head = late ? "INS" + number + "_" : "INS_";
    const std::string middle = late || instance == 1 ? "" : number;
    const std::string caltemp_middle = late ? "" : number;
    const std::array<std::string, 2> sensors = {"ACC", "GYR"};
    for (std::size_t i = 0; i < sensors.size(); ++i) {
      const std::string sensor = head + sensors[i] + middle;
      offset[i] = sensor + "OFFS_";
      id[i] = sensor + "_ID";
      caltemp[i] = head + sensors[i] + caltemp_middle + "_CALTEMP";
    }
    scale = head + "ACC" + middle + "SCAL_";
    thermal = late ? head + "TCAL_" : head + "TCAL" + number + "_";
  }

  /// INS_TCAL1_ACC2_X: power 2.
  std::string Term(Triad triad, int power, int axis) const {
    return thermal + (triad == Triad::kAccelerometer ? "ACC" : "GYR") + std::to_string(power) +
           "_" + kUpperCaseAxes[static_cast<std::size_t>(axis)];
  }
};

struct CompassNames {
  std::string offset, diagonal, off_diagonal, scale, id;

  explicit CompassNames(int instance) {
    const std::string number = instance == 1 ? "" : std::to_string(instance);
    offset = "COMPASS_OFS" + number + "_";
    diagonal = "COMPASS_DIA" + number + "_";
    off_diagonal = "COMPASS_ODI" + number + "_";
    scale = "COMPASS_SCALE" + number;
    id = "COMPASS_DEV_ID" + number;
  }
};

Result<int> ArduPilotInstance(const std::optional<int>& wanted) {
  const int instance = wanted.value_or(1);
  if (instance < 1 || instance > kArduPilotInstances) {
    return Error(ErrorCode::kInvalidArgument,
                 "--instance=" + std::to_string(instance) + ": ardupilot has IMUs 1 to " +
                     std::to_string(kArduPilotInstances) + " and compasses 1 to " +
                     std::to_string(kCompasses));
  }
  return instance;
}

/// Coefficients about `to` of a polynomial given about `from`: sum_k c_k (T - from)^k.
std::vector<Eigen::Vector3d> Shifted(const std::vector<Eigen::Vector3d>& terms,
                                     double from,
                                     double to) {
  std::vector<Eigen::Vector3d> shifted = terms;
  for (std::size_t first = 0; first + 1 < shifted.size(); ++first) {
    for (std::size_t k = shifted.size() - 1; k-- > first;) {
      shifted[k] += (to - from) * shifted[k + 1];
    }
  }
  return shifted;
}

class ArduPilotText {
 public:
  void Float(const std::string& name, double value) {
    // Tools that load these files do not all read exponents.
    text.append(name).append(",").append(PlainNumberText(static_cast<float>(value))).append("\n");
  }
  void Integer(const std::string& name, std::int64_t value) {
    text.append(name).append(",").append(std::to_string(value)).append("\n");
  }
  void Vector(const std::string& prefix, const Eigen::Vector3d& values) {
    for (int i = 0; i < 3; ++i)
      Float(prefix + kUpperCaseAxes[static_cast<std::size_t>(i)], values[i]);
  }
  std::string text;
};

/// The range in which the IMU's temperature terms hold: firmware has one for both sensors.
Result<Eigen::Vector2d> CommonRange(const Calibration& calibration) {
  Eigen::Vector2d range(-1e3, 1e3);
  for (const Triad triad : {Triad::kAccelerometer, Triad::kGyroscope}) {
    const std::optional<TriadCalibration>& sensor = calibration.sensors[triad];
    if (!sensor || !sensor->thermal) continue;
    range[0] = std::max(range[0], sensor->thermal->range_degc[0]);
    range[1] = std::min(range[1], sensor->thermal->range_degc[1]);
  }
  for (const Triad triad : {Triad::kAccelerometer, Triad::kGyroscope}) {
    const std::optional<TriadCalibration>& sensor = calibration.sensors[triad];
    if (!sensor || !sensor->thermal) continue;
    const double reference = sensor->thermal->reference_degc;
    if (!(range[0] <= reference && reference <= range[1])) {
      return Error(ErrorCode::kNotRepresentable,
                   "ardupilot needs the reference temperature (" + RoundedText(reference, 4) +
                       " degC for the " + std::string(TriadName(triad)) +
                       ") within the calibrated range (" + RoundedText(range[0], 4) + " to " +
                       RoundedText(range[1], 4) +
                       " degC, common to accelerometer and gyroscope); calibrate with another "
                       "reference.temperature_degc");
    }
  }
  return range;
}

Status WriteImu(const WriteRequest& request,
                int instance,
                ArduPilotText* out,
                std::vector<std::string>* warnings) {
  const ImuNames names(instance);
  TRUETRIAD_ASSIGN_OR_RETURN(const Eigen::Vector2d range, CommonRange(request.calibration));
  bool any_thermal = false;
  for (const Triad triad : {Triad::kAccelerometer, Triad::kGyroscope}) {
    const std::optional<TriadCalibration>& sensor = request.calibration.sensors[triad];
    if (!sensor) continue;
    const std::size_t i = triad == Triad::kAccelerometer ? 0 : 1;
    if (const auto id = request.options.device_ids[triad]) out->Integer(names.id[i], *id);
    out->Vector(names.offset[i], sensor->model.bias);
    if (triad == Triad::kAccelerometer) {
      const Eigen::Vector3d scale = sensor->model.Correction().diagonal();
      out->Vector(names.scale, scale);
      // Limits of the firmware's arming checks.
      constexpr double kMaxOffsetMps2 = 3.5, kMinAccelScale = 0.8, kMaxAccelScale = 1.2;
      if (sensor->model.bias.cwiseAbs().maxCoeff() > kMaxOffsetMps2 ||
          scale.minCoeff() < kMinAccelScale || scale.maxCoeff() > kMaxAccelScale) {
        warnings->emplace_back(
            "accelerometer: ArduPilot refuses to arm with offsets beyond 3.5 m/s^2 or scales "
            "outside 0.8 to 1.2");
      }
    } else {
      warnings->emplace_back(
          "gyroscope: ArduPilot re-estimates these offsets at every start; set INS_GYR_CAL to 0 to "
          "keep them");
    }
    if (!sensor->thermal) continue;
    any_thermal = true;
    const ThermalTerms& thermal = *sensor->thermal;
    out->Float(names.caltemp[i], thermal.reference_degc);
    std::vector<Eigen::Vector3d> terms = {Eigen::Vector3d::Zero()};
    terms.insert(terms.end(), thermal.bias.begin(), thermal.bias.end());
    terms.resize(kArduPilotOrder + 1, Eigen::Vector3d::Zero());
    terms = Shifted(terms, thermal.reference_degc, kCentreDegc);
    for (int power = 1; power <= kArduPilotOrder; ++power) {
      for (int axis = 0; axis < 3; ++axis) {
        out->Float(names.Term(triad, power, axis),
                   terms[static_cast<std::size_t>(power)][axis] / kTermScale);
      }
    }
  }
  if (any_thermal) {
    out->Float(names.thermal + "TMIN", range[0]);
    out->Float(names.thermal + "TMAX", range[1]);
    out->Integer(names.thermal + "ENABLE", 1);
  }
  return {};
}

Status WriteCompass(const WriteRequest& request,
                    int instance,
                    ArduPilotText* out,
                    std::vector<std::string>* warnings) {
  const std::optional<TriadCalibration>& sensor = request.calibration.sensors[Triad::kMagnetometer];
  if (!sensor) return {};
  if (instance > kCompasses) {
    return Error(ErrorCode::kInvalidArgument,
                 "--instance=" + std::to_string(instance) + ": ardupilot has compasses 1 to " +
                     std::to_string(kCompasses));
  }
  const CompassNames names(instance);
  const Eigen::Matrix3d D = sensor->model.Correction();
  if (const auto id = request.options.device_ids[Triad::kMagnetometer]) out->Integer(names.id, *id);
  out->Vector(names.offset, -sensor->model.bias);
  out->Vector(names.diagonal, D.diagonal());
  out->Vector(names.off_diagonal, {D(0, 1), D(0, 2), D(1, 2)});
  out->Float(names.scale, 1.0);
  warnings->emplace_back(
      "magnetometer: ArduPilot corrects after rotating the readings into the vehicle's axes, so "
      "these values are valid only for a compass without rotation (orientation None)");
  return {};
}

Result<std::vector<ExportedFile>> WriteArduPilot(const WriteRequest& request,
                                                 std::vector<std::string>* warnings) {
  TRUETRIAD_ASSIGN_OR_RETURN(const int instance, ArduPilotInstance(request.options.instance));
  ArduPilotText out;
  out.text = CommentText("# ", request.comment);
  TRUETRIAD_RETURN_IF_ERROR(WriteImu(request, instance, &out, warnings));
  TRUETRIAD_RETURN_IF_ERROR(WriteCompass(request, instance, &out, warnings));
  return std::vector<ExportedFile>{{"", std::move(out.text)}};
}

/// The temperature compensation of one sensor, in firmware's arithmetic.
struct ArduPilotThermal {
  float lowest = 0.0F, highest = 70.0F, at_calibration = 0.0F;
  std::array<Eigen::Vector3f, kArduPilotOrder> terms;

  static std::optional<ArduPilotThermal> Read(const ParameterList& list,
                                              const ImuNames& names,
                                              Triad triad) {
    if (list.Get(names.thermal + "ENABLE", 0.0F) != 1.0F) return std::nullopt;
    // What CALTEMP holds before there is one.
    constexpr float kUnset = -300.0F;
    ArduPilotThermal thermal;
    thermal.lowest = list.Get(names.thermal + "TMIN", thermal.lowest);
    thermal.highest = list.Get(names.thermal + "TMAX", thermal.highest);
    thermal.at_calibration =
        list.Get(names.caltemp[triad == Triad::kAccelerometer ? 0 : 1], kUnset);
    for (int power = 1; power <= kArduPilotOrder; ++power) {
      for (int axis = 0; axis < 3; ++axis) {
        thermal.terms[static_cast<std::size_t>(power) - 1][axis] =
            list.Get(names.Term(triad, power, axis), 0.0F);
      }
    }
    return thermal;
  }

  Eigen::Vector3f Polynomial(float temperature) const {
    const float d = std::clamp(temperature, lowest, highest) - static_cast<float>(kCentreDegc);
    return (terms[0] * d + terms[1] * d * d + terms[2] * d * d * d) *
           static_cast<float>(kTermScale);
  }

  Eigen::Vector3f At(double temperature_degc) const {
    return Polynomial(static_cast<float>(temperature_degc)) - Polynomial(at_calibration);
  }

  ThermalTerms AsTerms() const {
    std::vector<Eigen::Vector3d> about_centre = {Eigen::Vector3d::Zero()};
    for (const Eigen::Vector3f& term : terms) {
      about_centre.emplace_back(kTermScale * term.cast<double>());
    }
    ThermalTerms result;
    result.range_degc = {lowest, highest};
    result.reference_degc = std::clamp(at_calibration, lowest, highest);
    const std::vector<Eigen::Vector3d> shifted =
        Shifted(about_centre, kCentreDegc, result.reference_degc);
    result.bias.assign(shifted.begin() + 1, shifted.end());
    while (!result.bias.empty() && result.bias.back().isZero(0.0)) result.bias.pop_back();
    return result;
  }
};

void ReadImu(const ParameterList& list, int instance, Carried* carried) {
  const ImuNames names(instance);
  for (const Triad triad : {Triad::kAccelerometer, Triad::kGyroscope}) {
    const std::size_t number = triad == Triad::kAccelerometer ? 0 : 1;
    const std::string& prefix = names.offset[number];
    // 0: there is no such IMU.
    if (!list.HasVector(prefix, "") || list.Get(names.id[number], 1.0F) == 0.0F) continue;
    const Eigen::Vector3f offset = list.GetVector(prefix, "", 0.0F);
    const Eigen::Vector3f scale = triad == Triad::kAccelerometer
                                      ? list.GetVector(names.scale, "", 1.0F)
                                      : Eigen::Vector3f::Ones();
    const std::optional<ArduPilotThermal> thermal = ArduPilotThermal::Read(list, names, triad);
    carried->equations[triad] = [=](const Eigen::Vector3d& reading,
                                    const Eigen::Vector3d& /*force_mps2*/,
                                    double temperature_degc) -> Eigen::Vector3d {
      Eigen::Vector3f y = reading.cast<float>();
      if (thermal) y -= thermal->At(temperature_degc);
      const Eigen::Vector3f result = (y - offset).cwiseProduct(scale);
      return result.cast<double>();
    };
    TriadCalibration& sensor = carried->sensors[triad].emplace(CarriedTriad(
        triad == Triad::kAccelerometer ? "m/s^2" : "rad/s", scale.asDiagonal(), offset));
    carried->device_ids[triad] = list.Id(names.id[number]);
    if (thermal) {
      sensor.thermal = thermal->AsTerms();
      if (sensor.thermal->bias.empty()) sensor.thermal.reset();
    }
  }
}

void ReadCompass(const ParameterList& list, int instance, Carried* carried) {
  const CompassNames names(instance);
  if (!list.HasVector(names.offset, "") || list.Get(names.id, 1.0F) == 0.0F) return;
  const Eigen::Vector3f offset = list.GetVector(names.offset, "", 0.0F);
  Eigen::Vector3f diagonal = list.GetVector(names.diagonal, "", 1.0F);
  if (diagonal.isZero(0.0F)) diagonal.setOnes();  // 0: off
  const Eigen::Matrix3f D = SymmetricMatrix(diagonal, list.GetVector(names.off_diagonal, "", 0.0F));
  // Outside of its range the scale is ignored.
  constexpr float kMaxCompassScale = 1.5F;
  float scale = list.Get(names.scale, 0.0F);
  if (!(scale >= 1.0F / kMaxCompassScale && scale <= kMaxCompassScale)) scale = 1.0F;
  carried->equations[Triad::kMagnetometer] = [=](const Eigen::Vector3d& reading,
                                                 const Eigen::Vector3d& /*force_mps2*/,
                                                 double /*temperature_degc*/) -> Eigen::Vector3d {
    const Eigen::Vector3f result = D * (scale * (reading.cast<float>() + offset));
    return result.cast<double>();
  };
  carried->sensors[Triad::kMagnetometer] = CarriedTriad("mG", scale * D, -offset);
  carried->device_ids[Triad::kMagnetometer] = list.Id(names.id);
}

Result<Carried> ReadArduPilot(const ReadRequest& request) {
  TRUETRIAD_ASSIGN_OR_RETURN(const int instance, ArduPilotInstance(request.instance));
  TRUETRIAD_ASSIGN_OR_RETURN(const ParameterList list, ParameterList::Parse(request.files[0], 0));
  Carried carried;
  ReadImu(list, instance, &carried);
  if (instance <= kCompasses) ReadCompass(list, instance, &carried);
  return carried;
}

}  // namespace

Format ArduPilotFormat() {
  Format format;
  format.info = {"ardupilot",
                 "ArduPilot parameters (.param)",
                 "ardupilot.param",
                 Arithmetic::kFloat32,
                 true,
                 1};
  format.capacity[Triad::kAccelerometer] = {.held = true,
                                            .matrix = MatrixForm::kDiagonal,
                                            .bias_order = kArduPilotOrder,
                                            .reading_unit = "m/s^2",
                                            .result_in_reading_unit = true};
  format.capacity[Triad::kGyroscope] = {.held = true,
                                        .matrix = MatrixForm::kNone,
                                        .bias_order = kArduPilotOrder,
                                        .reading_unit = "rad/s",
                                        .result_in_reading_unit = true};
  format.capacity[Triad::kMagnetometer] = {.held = true,
                                           .matrix = MatrixForm::kSymmetric,
                                           .reading_unit = "mG",
                                           .result_in_reading_unit = true};
  format.write = WriteArduPilot;
  format.read = ReadArduPilot;
  return format;
}

}  // namespace truetriad
