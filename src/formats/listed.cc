// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/LU>

#include "formats/format.h"
#include "formats/restate.h"
#include "formats/text.h"
#include "tree/json.h"

// Formats that are maps of lists in YAML or JSON, or plain lists:
//
//   imu_calib   accelerometer only, in double, x = SM y - bias.
//               imu_calib: src/accel_calib/accel_calib.cpp
//   RealSense   D400, in float32 in the device, x = Sigma y - beta. The nine numbers are Sigma by
//               columns: the script stores the transpose of what it applies.
//               librealsense: tools/rs-imu-calibration/rs-imu-calibration.py (check_X,
//               get_IMU_Calib_Table), src/proc/motion-transform.cpp
//   Basalt      in double, x = (I + E) y - c. calib_accel_bias is c and the lower triangle of E:
//               c_x c_y c_z E11 E21 E31 E22 E32 E33; calib_gyro_bias is c and E by columns.
//               basalt-headers: include/basalt/calibration/calib_bias.hpp,
//               serialization/headers_serialization.h
//   ROS 2       parameters of a node, in double, for readings as sensor_msgs has them, m/s^2,
//               rad/s and tesla: correction (y - bias - g_sensitivity linear_acceleration), and
//               the covariances of sensor_msgs/msg/Imu and MagneticField, whose zeros mean
//               "unknown". common_interfaces: sensor_msgs/msg/Imu.msg, MagneticField.msg
//   Fusion      of x-io, constants of C, in float32, misalignment ((y - offset) o sensitivity);
//               for the magnetometer softIron (y - hardIron).
//               Fusion: Fusion/FusionModel.h (earlier FusionCalibration.h), examples
//   imu_tk      in double, x = T K (y - B), T with unit diagonal (upper triangular for the
//               accelerometer), K diagonal. One text file per sensor: T by rows, K by rows, B.
//               imu_tk does not read what follows. imu_tk: include/imu_tk/calibration.h
//               (CalibratedTriad_, load, save)

namespace truetriad {
namespace {

/// Where a file holds the fields.
struct Listing {
  std::vector<std::string_view> path;  ///< Keys to the fields; `[0]` is the first item of a list.
  bool by_sensor = false;              ///< Each sensor has a map with its name.
  PerTriad<std::vector<Field>> fields;
};

const Listing& ImuCalib() {
  static const auto& listing = *new Listing{
      {}, false, {{{{{"SM", Quantity::kCorrection}, {"bias", Quantity::kBiasAfter}}, {}, {}}}}};
  return listing;
}

const Listing& RealSense() {
  static const std::vector<Field> fields = {{"scale_and_alignment", Quantity::kCorrectionByColumn},
                                            {"bias", Quantity::kBiasAfter}};
  static const auto& listing = *new Listing{{"imus", "[0]"}, true, {{fields, fields, {}}}};
  return listing;
}

const Listing& Basalt() {
  static const auto& listing =
      *new Listing{{"value0"},
                   false,
                   {{{{{"calib_accel_bias", Quantity::kBiasAfter, true},
                       {"calib_accel_bias", Quantity::kLowerDeviation, true}},
                      {{"calib_gyro_bias", Quantity::kBiasAfter, true},
                       {"calib_gyro_bias", Quantity::kDeviation, true}},
                      {}}}}};
  return listing;
}

const Listing& Ros2() {
  static const std::vector<Field> fields = {{"correction", Quantity::kCorrection},
                                            {"bias", Quantity::kBias},
                                            {"g_sensitivity", Quantity::kGSensitivity, true}};
  static const auto& listing =
      *new Listing{{"/**", "ros__parameters"}, true, {{fields, fields, fields}}};
  return listing;
}

Result<Carried> ReadListing(const Listing& listing, const ReadRequest& request) {
  const ExportedFile& file = request.files[0];
  TRUETRIAD_ASSIGN_OR_RETURN(YamlReader root, YamlReader::FromText(file.text, file.suffix));
  std::vector<YamlReader> maps = {root};
  for (const std::string_view key : listing.path) {
    if (key != "[0]") {
      maps.push_back(maps.back().RequireChild(key));
      continue;
    }
    const std::vector<YamlReader> items = maps.back().Items();
    if (items.empty()) {
      return Error(ErrorCode::kMissingKey, {file.suffix}, "`" + maps.back().name() + "` is empty");
    }
    maps.push_back(items[0]);
  }
  Carried carried;
  for (const Triad triad : kTriads) {
    if (!maps.back() || listing.fields[triad].empty()) continue;
    const YamlReader sensor = listing.by_sensor ? maps.back().Child(TriadName(triad)) : maps.back();
    if (!sensor) continue;
    const Stated stated = ReadFields(sensor, listing.fields[triad]);
    if (!stated.empty()) carried.parts[triad] = CorrectionParts::Of(stated);
  }
  TRUETRIAD_RETURN_IF_ERROR(root.status());
  return carried;
}

Result<Files> WriteImuCalib(const WriteRequest& request) {
  std::string text = CommentText("# ", request.comment);
  for (const Field& field : ImuCalib().fields[Triad::kAccelerometer]) {
    const auto& sensor = request.calibration.sensors[Triad::kAccelerometer];
    text.append(field.name).append(": ").append(ListText(ValueOf(field.quantity, *sensor))) += '\n';
  }
  return Files{{"", std::move(text)}};
}

Result<Files> WriteRealSense(const WriteRequest& request) {
  Json sensors = Json::object();
  for (const Triad triad : kTriads) {
    const std::optional<TriadCalibration>& sensor = request.calibration.sensors[triad];
    for (const Field& field : RealSense().fields[triad]) {
      if (!sensor) continue;
      const Eigen::VectorXf numbers = ValueOf(field.quantity, *sensor).cast<float>();
      sensors[std::string(TriadName(triad))][std::string(field.name)] =
          ListJson(numbers.cast<double>());
    }
  }
  request.warnings.emplace_back(
      "RealSense corrects in the depth camera's frame (x right, y down, z forward); record and "
      "calibrate in those axes");
  const Json json = {{"device_type", "D435i"},
                     {"imus", Json::array({std::move(sensors)})},
                     {"comment", request.comment}};
  return Files{{"", TextOf(json)}};
}

Result<Files> WriteBasalt(const WriteRequest& request) {
  Json members = Json::object();
  double rate_hz = 0.0;
  for (const Triad triad : {Triad::kAccelerometer, Triad::kGyroscope}) {
    const std::optional<TriadCalibration>& sensor = request.calibration.sensors[triad];
    if (!sensor) continue;
    for (const Field& field : Basalt().fields[triad]) {
      Json& list = members[std::string(field.name)];
      for (const double value : ValueOf(field.quantity, *sensor)) list.push_back(value);
    }
    const std::string name = triad == Triad::kAccelerometer ? "accel" : "gyro";
    TRUETRIAD_ASSIGN_OR_RETURN(const std::optional<NoiseDensities> noise,
                               NoiseOf(request.options, triad));
    if (noise && noise->random_walk) {
      members[name + "_noise_std"] = ListJson(noise->white);
      members[name + "_bias_std"] = ListJson(*noise->random_walk);
      rate_hz = noise->rate_hz;
    } else {
      request.warnings.emplace_back(
          std::string(TriadName(triad)) + ": " + name + "_noise_std and " + name +
          "_bias_std are missing; give --allan=FILE with white noise and random "
          "walk of every axis, or enter them by hand");
    }
  }
  if (rate_hz > 0.0) members["imu_update_rate"] = rate_hz;
  const Json json = {{"value0", std::move(members)}, {"comment", request.comment}};
  return Files{{"", TextOf(json)}};
}

constexpr double kTeslaPerMicrotesla = 1e-6;  // sensor_msgs/MagneticField: 1e6 uT = 1 T.
constexpr PerTriad<std::string_view> kCovarianceNames = {
    {"linear_acceleration_covariance", "angular_velocity_covariance", "magnetic_field_covariance"}};

/// "[1.0, 0.5]": whole numbers get ".0", since rcl rejects a list with integers among other
/// numbers.
std::string RealListText(const Eigen::VectorXd& values) {
  std::string text;
  for (const double value : values) {
    const std::string number = NumberText(value);
    const bool is_whole = number.find_first_of(".e") == std::string::npos;
    text.append(text.empty() ? "[" : ", ").append(number).append(is_whole ? ".0" : "");
  }
  return text + "]";
}

/// Variances of one corrected reading by axis, in the message's unit squared: the noise of a
/// sample, after correction, plus the variance of the calibration. If no noise is known: zero,
/// which means unknown, and a warning, since the variance of the calibration alone would be too
/// small.
Result<Eigen::Vector3d> Variances(const WriteRequest& request,
                                  Triad triad,
                                  const Eigen::Matrix3d& correction) {
  TRUETRIAD_ASSIGN_OR_RETURN(const std::optional<NoiseDensities> noise,
                             NoiseOf(request.options, triad));
  if (!noise) {
    request.warnings.emplace_back(std::string(TriadName(triad)) + ": " +
                                  std::string(kCovarianceNames[triad]) + " is zero (unknown): " +
                                  (request.options.allan
                                       ? "the Allan file lacks the white noise of some axis"
                                       : "its noise density is missing; give --allan=FILE"));
    return Eigen::Vector3d(Eigen::Vector3d::Zero());
  }
  const Eigen::Vector3d of_sample = noise->white.array().square() * noise->rate_hz;
  Eigen::Vector3d variances = correction.array().square().matrix() * of_sample;
  if (request.stated->covariance.matrix.size() > 0) {
    variances += ReadingVariances(triad, *request.stated);
  } else {
    request.warnings.emplace_back(
        std::string(TriadName(triad)) + ": the calibration states no covariance; " +
        std::string(kCovarianceNames[triad]) + " contains only the noise");
  }
  if (triad == Triad::kMagnetometer) variances *= kTeslaPerMicrotesla * kTeslaPerMicrotesla;
  return variances;
}

Result<Files> WriteRos2(const WriteRequest& request) {
  std::string text = CommentText("# ", request.comment) + "/**:\n  ros__parameters:\n";
  std::string covariances;
  for (const Triad triad : kTriads) {
    const std::optional<TriadCalibration>& sensor = request.calibration.sensors[triad];
    if (!sensor) continue;
    text.append("    ").append(TriadName(triad)).append(":\n");
    for (const auto& [name, quantity, is_optional] : Ros2().fields[triad]) {
      if (is_optional && !sensor->g_sensitivity) continue;
      text.append("      ").append(name).append(": ");
      text.append(RealListText(ValueOf(quantity, *sensor))).append("\n");
    }
    TRUETRIAD_ASSIGN_OR_RETURN(const Eigen::Vector3d variances,
                               Variances(request, triad, sensor->model.Correction()));
    const Eigen::Matrix3d covariance = variances.asDiagonal();
    covariances.append("    ").append(kCovarianceNames[triad]).append(": ");
    covariances += RealListText(covariance.reshaped()) + "\n";
  }
  return Files{{"", text + covariances}};
}

const PerTriad<std::vector<Field>>& FusionConstants() {
  static const auto& constants = *new PerTriad<std::vector<Field>>{
      {{{{"accelerometerMisalignment", Quantity::kMisalignment},
         {"accelerometerSensitivity", Quantity::kGains},
         {"accelerometerOffset", Quantity::kBias}},
        {{"gyroscopeMisalignment", Quantity::kMisalignment},
         {"gyroscopeSensitivity", Quantity::kGains},
         {"gyroscopeOffset", Quantity::kBias}},
        {{"softIronMatrix", Quantity::kCorrection}, {"hardIronOffset", Quantity::kBias}}}}};
  return constants;
}

/// "const FusionVector gyroscopeOffset = {0.0f, 0.0f, 0.0f};" Matrices by rows.
std::string Constant(std::string_view name, const Eigen::VectorXd& values) {
  std::string text = "static const ";
  text.append(values.size() == 3 ? "FusionVector " : "FusionMatrix ").append(name).append(" = {");
  for (Eigen::Index i = 0; i < values.size(); ++i)
    text += (i > 0 ? ", " : "") + FloatLiteral(static_cast<float>(values[i]));
  return text + "};\n";
}

Result<Files> WriteFusion(const WriteRequest& request) {
  std::string text = CommentText("// ", request.comment) + "#include \"Fusion.h\"\n\n";
  for (const Triad triad : kTriads) {
    const std::optional<TriadCalibration>& sensor = request.calibration.sensors[triad];
    if (!sensor) continue;
    for (const Field& field : FusionConstants()[triad])
      text += Constant(field.name, ValueOf(field.quantity, *sensor));
  }
  return Files{{"", std::move(text)}};
}

Result<Carried> ReadFusion(const ReadRequest& request) {
  Carried carried;
  for (const Triad triad : kTriads) {
    Stated stated;
    for (const auto& [name, quantity, is_optional] : FusionConstants()[triad]) {
      const std::vector<float> numbers =
          ReadConstant(request.files[0].text, " " + std::string(name) + " = {");
      if (numbers.size() != static_cast<std::size_t>(SizeOf(quantity))) continue;
      stated[quantity] =
          Eigen::Map<const Eigen::VectorXf>(numbers.data(), SizeOf(quantity)).cast<double>();
    }
    if (stated.size() == FusionConstants()[triad].size())
      carried.parts[triad] = CorrectionParts::Of(stated);
  }
  return carried;
}

struct ImuTkFile {
  Triad triad;
  std::string_view suffix;  // as in the names that imu_tk's own programs use: test_imu_acc.calib
};
constexpr ImuTkFile kImuTkFiles[] = {{Triad::kAccelerometer, "_acc.calib"},
                                     {Triad::kGyroscope, "_gyro.calib"}};

// In the order of the file: T, K, B.
constexpr Field kImuTkFields[] = {
    {"T", Quantity::kMisalignment}, {"K", Quantity::kGainsMatrix}, {"B", Quantity::kBias}};
constexpr std::size_t kImuTkNumbers = 9 + 9 + 3;  // Two matrices and a bias.

Result<Files> WriteImuTk(const WriteRequest& request) {
  Files files;
  for (const ImuTkFile& file : kImuTkFiles) {
    const std::optional<TriadCalibration>& sensor = request.calibration.sensors[file.triad];
    if (!sensor) continue;
    std::string text;
    for (const Field& field : kImuTkFields) {
      const Eigen::VectorXd numbers = ValueOf(field.quantity, *sensor);
      // Each line holds one row of a matrix, or one number of a vector.
      const Eigen::Index columns = numbers.size() / 3;
      for (Eigen::Index i = 0; i < numbers.size(); ++i)
        text += NumberText(numbers[i]) + ((i + 1) % columns == 0 ? '\n' : ' ');
      text += '\n';
    }
    // imu_tk stops reading after the numbers.
    text += CommentText("# ", request.comment);
    files.push_back({std::string(file.suffix), std::move(text)});
  }
  return files;
}

/// The numbers of a file, without its comments.
Result<std::vector<double>> NumbersOfFile(const ExportedFile& file) {
  std::vector<double> numbers;
  for (const auto& [place, line, words] : WordLines(file)) {
    for (const std::string& word : words) {
      const std::optional<double> value = ParseNumber<double>(word);
      if (!value || !std::isfinite(*value))
        return Error(ErrorCode::kUnreadableNumber, place, "`" + word + "` is not a number");
      numbers.push_back(*value);
    }
  }
  return numbers;
}

Result<Carried> ReadImuTk(const ReadRequest& request) {
  Carried carried;
  for (const ExportedFile& file : request.files) {
    const ImuTkFile* kind = nullptr;
    for (const ImuTkFile& candidate : kImuTkFiles) {
      if (file.suffix.ends_with(candidate.suffix)) kind = &candidate;
    }
    if (kind == nullptr) {
      return Error(ErrorCode::kWrongFormat,
                   {file.suffix},
                   "the name does not show the sensor; expected names ending in "
                   "_acc.calib and _gyro.calib, as written by imu_tk");
    }
    TRUETRIAD_ASSIGN_OR_RETURN(const std::vector<double> numbers, NumbersOfFile(file));
    if (numbers.size() != kImuTkNumbers) {
      return Error(ErrorCode::kWrongFormat,
                   {file.suffix},
                   "contains " + std::to_string(numbers.size()) +
                       " numbers; expected T (9), K (9) and B (3)");
    }
    CorrectionParts& parts = carried.parts[kind->triad].emplace(
        CorrectionParts::Of(StatedTogether(kImuTkFields, numbers.data())));
    if (parts.matrix.determinant() == 0.0)
      return Error(ErrorCode::kSingularMatrix, {file.suffix}, "T K is singular");
    parts.reading_unit = UnitFromComment(file.text, kind->triad);
    if (parts.matrix.isUpperTriangular(0.0))
      parts.sensitivity = parts.matrix.inverse().triangularView<Eigen::Upper>();
  }
  return carried;
}

}  // namespace

std::vector<Format> ListedFormats() {
  constexpr TriadCapacity kAcceleration = {.held = true, .reading_unit = "m/s^2"};
  constexpr TriadCapacity kRate = {.held = true, .reading_unit = "rad/s"};
  constexpr TriadCapacity kAnyUnit = {.held = true, .free_unit = true};
  const auto in = [](std::string_view unit) -> TriadCapacity {
    return {.held = true, .reading_unit = unit, .free_unit = true, .result_in_reading_unit = true};
  };
  return {{.info = {"basalt",
                    "Basalt calibration, the IMU's part (JSON)",
                    "basalt.json",
                    Arithmetic::kFloat64},
           .gauge = Gauge::kAccelX,
           .capacity = {{kAcceleration, kRate, {}}},
           .write = WriteBasalt,
           .read = [](const ReadRequest& request) { return ReadListing(Basalt(), request); }},
          {.info = {"imu-tk",
                    "imu_tk, one file each for accelerometer and gyroscope",
                    "imu_tk",
                    Arithmetic::kFloat64,
                    true},
           .gauge = Gauge::kAccelZ,
           .capacity = {{kAnyUnit, kAnyUnit, {}}},
           .write = WriteImuTk,
           .read = ReadImuTk},
          {.info = {"imu-calib",
                    "imu_calib (ROS), accelerometer (YAML)",
                    "imu_calib.yaml",
                    Arithmetic::kFloat64},
           .capacity = {{kAcceleration, {}, {}}},
           .write = WriteImuCalib,
           .read = [](const ReadRequest& request) { return ReadListing(ImuCalib(), request); }},
          {.info = {"realsense",
                    "RealSense D400 with IMU (JSON)",
                    "realsense.json",
                    Arithmetic::kFloat32},
           .capacity = {{kAcceleration, kRate, {}}},
           .write = WriteRealSense,
           .read = [](const ReadRequest& request) { return ReadListing(RealSense(), request); }},
          {.info = {"fusion",
                    "x-io Fusion constants (C), g and deg/s",
                    "fusion.h",
                    Arithmetic::kFloat32},
           .capacity = {{in("g"), in("deg/s"), in("uT")}},
           .write = WriteFusion,
           .read = ReadFusion},
          {.info = {"ros2",
                    "ROS 2 parameters: correction, and covariances of sensor_msgs (YAML)",
                    "ros2.yaml",
                    Arithmetic::kFloat64},
           .capacity = {{kAcceleration,
                         {.held = true, .g_sensitivity = true, .reading_unit = "rad/s"},
                         {.held = true, .reading_unit = "T", .result_in_reading_unit = true}}},
           .write = WriteRos2,
           .read = [](const ReadRequest& request) { return ReadListing(Ros2(), request); }}};
}

}  // namespace truetriad
