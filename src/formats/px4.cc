// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>

#include "formats/format.h"
#include "formats/number_text.h"
#include "formats/parameter_list.h"

// PX4 parameters as QGroundControl loads them. In float32, before the board's rotation:
//
//   accelerometer  (y - thermal - OFF) o SCALE        m/s^2
//   gyroscope       y - thermal - OFF                  rad/s
//   magnetometer   D (y - thermal - OFF)               gauss, D symmetric
//   thermal_i     = X0_i + X1_i d + X2_i d^2 + X3_i d^3,  d = clamp(T, TMIN, TMAX) - TREF
//
// PX4: src/lib/sensor_calibration/{Accelerometer,Gyroscope,Magnetometer}.hpp (Correct),
// src/modules/temperature_compensation/TemperatureCompensation.cpp.

namespace truetriad {
namespace {

constexpr int kPx4Order = 3;
constexpr int kPx4Instances = 4;

struct Px4Triad {
  Triad triad;
  std::string_view calibration;  // CAL_ACC0_XOFF
  std::string_view thermal;      // TC_A0_X1_0
};
constexpr std::array<Px4Triad, 3> kPx4Triads = {{
    {Triad::kAccelerometer, "ACC", "A"},
    {Triad::kGyroscope, "GYRO", "G"},
    {Triad::kMagnetometer, "MAG", "M"},
}};

std::string CalibrationPrefix(const Px4Triad& names, int instance) {
  return "CAL_" + std::string(names.calibration) + std::to_string(instance) + "_";
}
std::string ThermalPrefix(const Px4Triad& names, int instance) {
  return "TC_" + std::string(names.thermal) + std::to_string(instance) + "_";
}

Result<int> Px4Instance(const std::optional<int>& wanted) {
  const int instance = wanted.value_or(0);
  if (instance < 0 || instance >= kPx4Instances) {
    return Error(ErrorCode::kInvalidArgument,
                 "--instance=" + std::to_string(instance) + ": px4 has sensors 0 to " +
                     std::to_string(kPx4Instances - 1));
  }
  return instance;
}

class Px4Text {
 public:
  void Float(const std::string& name, double value) {
    Line(name, NumberText(static_cast<float>(value)), "9");
  }
  void Integer(const std::string& name, std::int64_t value) {
    Line(name, std::to_string(value), "6");
  }
  std::string text;

 private:
  void Line(const std::string& name, const std::string& value, std::string_view type) {
    text.append("1\t1\t").append(name).append("\t").append(value).append("\t").append(type);
    text += '\n';
  }
};

void WriteThermal(const std::string& prefix, const ThermalTerms& thermal, Px4Text* out) {
  out->Float(prefix + "TMIN", thermal.range_degc[0]);
  out->Float(prefix + "TMAX", thermal.range_degc[1]);
  out->Float(prefix + "TREF", thermal.reference_degc);
  for (int power = 0; power <= kPx4Order; ++power) {
    for (int axis = 0; axis < 3; ++axis) {
      // The constant stands in OFF, where PX4's own calibration puts it.
      const bool held = power > 0 && power <= static_cast<int>(thermal.bias.size());
      const double value = held ? thermal.bias[static_cast<std::size_t>(power) - 1][axis] : 0.0;
      out->Float(prefix + "X" + std::to_string(power) + "_" + std::to_string(axis), value);
    }
  }
}

Result<std::vector<ExportedFile>> WritePx4(const WriteRequest& request,
                                           std::vector<std::string>* warnings) {
  TRUETRIAD_ASSIGN_OR_RETURN(const int instance, Px4Instance(request.options.instance));
  Px4Text out;
  out.text = CommentText("# ", request.comment);
  for (const Px4Triad& names : kPx4Triads) {
    const std::optional<TriadCalibration>& sensor = request.calibration.sensors[names.triad];
    if (!sensor) continue;
    const std::string name(TriadName(names.triad));
    const std::string prefix = CalibrationPrefix(names, instance);
    const std::optional<std::int64_t> id = request.options.device_ids[names.triad];
    if (id) {
      out.Integer(prefix + "ID", *id);
    } else {
      warnings->emplace_back(name + ": without --id, PX4 uses these values only if " + prefix +
                             "ID already matches the sensor");
    }
    const Eigen::Matrix3d correction = sensor->model.Correction();
    for (int axis = 0; axis < 3; ++axis) {
      out.Float(prefix + kUpperCaseAxes[static_cast<std::size_t>(axis)] + "OFF",
                sensor->model.bias[axis]);
    }
    // Limits of the sources named above.
    constexpr double kIgnoredOffset = 0.01;
    if (sensor->model.bias.norm() < kIgnoredOffset) {
      warnings->emplace_back(name +
                             ": some versions of PX4 ignore offsets this small (below 0.01 " +
                             sensor->input_unit + ")");
    }
    if (names.triad != Triad::kGyroscope) {
      for (int axis = 0; axis < 3; ++axis) {
        out.Float(prefix + kUpperCaseAxes[static_cast<std::size_t>(axis)] + "SCALE",
                  correction(axis, axis));
      }
      // Limits of the sources named above.
      constexpr double kLeastScale = 0.1, kMostScale = 3.0;
      if (correction.diagonal().minCoeff() < kLeastScale ||
          correction.diagonal().maxCoeff() > kMostScale) {
        warnings->emplace_back(name + ": PX4 accepts only scales between 0.1 and 3");
      }
    }
    if (names.triad == Triad::kMagnetometer) {
      out.Float(prefix + "XODIAG", correction(0, 1));
      out.Float(prefix + "YODIAG", correction(0, 2));
      out.Float(prefix + "ZODIAG", correction(1, 2));
    }
    if (!sensor->thermal) continue;
    const std::string thermal_prefix = ThermalPrefix(names, instance);
    if (id) out.Integer(thermal_prefix + "ID", *id);
    WriteThermal(thermal_prefix, *sensor->thermal, &out);
    out.Integer("TC_" + std::string(names.thermal) + "_ENABLE", 1);
    if (names.triad == Triad::kMagnetometer) {
      warnings->emplace_back(
          name +
          ": versions of PX4 without TC_M_ENABLE do not compensate magnetometers: there the "
          "offset holds at the reference temperature alone");
    }
  }
  return std::vector<ExportedFile>{{"", std::move(out.text)}};
}

/// The temperature compensation of one sensor, in firmware's arithmetic.
struct Px4Thermal {
  float lowest = 0.0F, highest = 100.0F, reference = 25.0F;
  std::array<Eigen::Vector3f, kPx4Order + 1> terms;

  static std::optional<Px4Thermal> Read(const ParameterList& list,
                                        const Px4Triad& names,
                                        int instance) {
    if (list.Get("TC_" + std::string(names.thermal) + "_ENABLE", 0.0F) != 1.0F) return std::nullopt;
    const std::string prefix = ThermalPrefix(names, instance);
    Px4Thermal thermal;
    thermal.lowest = list.Get(prefix + "TMIN", thermal.lowest);
    thermal.highest = list.Get(prefix + "TMAX", thermal.highest);
    thermal.reference = list.Get(prefix + "TREF", thermal.reference);
    for (int power = 0; power <= kPx4Order; ++power) {
      for (int axis = 0; axis < 3; ++axis) {
        thermal.terms[static_cast<std::size_t>(power)][axis] =
            list.Get(prefix + "X" + std::to_string(power) + "_" + std::to_string(axis), 0.0F);
      }
    }
    return thermal;
  }

  Eigen::Vector3f At(double temperature_degc) const {
    const float d = std::clamp(static_cast<float>(temperature_degc), lowest, highest) - reference;
    return terms[0] + terms[1] * d + terms[2] * d * d + terms[3] * d * d * d;
  }

  ThermalTerms AsTerms() const {
    ThermalTerms result;
    result.reference_degc = reference;
    result.range_degc = {lowest, highest};
    for (int power = 1; power <= kPx4Order; ++power) {
      result.bias.emplace_back(terms[static_cast<std::size_t>(power)].cast<double>());
    }
    while (!result.bias.empty() && result.bias.back().isZero(0.0)) result.bias.pop_back();
    return result;
  }
};

Result<Carried> ReadPx4(const ReadRequest& request) {
  TRUETRIAD_ASSIGN_OR_RETURN(const int instance, Px4Instance(request.instance));
  constexpr std::size_t kNameField = 2;
  TRUETRIAD_ASSIGN_OR_RETURN(const ParameterList list,
                             ParameterList::Parse(request.files[0], kNameField));
  Carried carried;
  for (const Px4Triad& names : kPx4Triads) {
    const std::string prefix = CalibrationPrefix(names, instance);
    // 0: the slot belongs to no sensor.
    if (!list.HasVector(prefix, "OFF") || list.Get(prefix + "ID", 1.0F) == 0.0F) continue;
    const Eigen::Vector3f offset = list.GetVector(prefix, "OFF", 0.0F);
    Eigen::Matrix3f D = Eigen::Matrix3f::Identity();
    if (names.triad != Triad::kGyroscope) {
      D.diagonal() = list.GetVector(prefix, "SCALE", 1.0F);
    }
    if (names.triad == Triad::kMagnetometer) {
      D = SymmetricMatrix(D.diagonal(), list.GetVector(prefix, "ODIAG", 0.0F));
    }
    const std::optional<Px4Thermal> thermal = Px4Thermal::Read(list, names, instance);
    carried.equations[names.triad] = [=](const Eigen::Vector3d& reading,
                                         const Eigen::Vector3d& /*force_mps2*/,
                                         double temperature_degc) -> Eigen::Vector3d {
      Eigen::Vector3f y = reading.cast<float>();
      if (thermal) y -= thermal->At(temperature_degc);
      const Eigen::Vector3f result = D * (y - offset);
      return result.cast<double>();
    };
    TriadCalibration& sensor = carried.sensors[names.triad].emplace(
        CarriedTriad(names.triad == Triad::kAccelerometer ? "m/s^2"
                     : names.triad == Triad::kGyroscope   ? "rad/s"
                                                          : "G",
                     D,
                     offset));
    carried.device_ids[names.triad] = list.Id(prefix + "ID");
    if (thermal) {
      sensor.model.bias += thermal->terms[0].cast<double>();
      sensor.thermal = thermal->AsTerms();
      if (sensor.thermal->bias.empty()) sensor.thermal.reset();
    }
  }
  return carried;
}

}  // namespace

Format Px4Format() {
  Format format;
  format.info = {"px4",
                 "PX4 parameters, for QGroundControl (.params)",
                 "px4.params",
                 Arithmetic::kFloat32,
                 true,
                 0};
  format.capacity[Triad::kAccelerometer] = {.held = true,
                                            .matrix = MatrixForm::kDiagonal,
                                            .bias_order = kPx4Order,
                                            .reading_unit = "m/s^2",
                                            .result_in_reading_unit = true};
  format.capacity[Triad::kGyroscope] = {.held = true,
                                        .matrix = MatrixForm::kNone,
                                        .bias_order = kPx4Order,
                                        .reading_unit = "rad/s",
                                        .result_in_reading_unit = true};
  format.capacity[Triad::kMagnetometer] = {.held = true,
                                           .matrix = MatrixForm::kSymmetric,
                                           .bias_order = kPx4Order,
                                           .reading_unit = "G",
                                           .result_in_reading_unit = true};
  format.write = WritePx4;
  format.read = ReadPx4;
  return format;
}

}  // namespace truetriad
