// SPDX-License-Identifier: Apache-2.0
#include <string>
#include <utility>
#include <vector>

#include "formats/format.h"
#include "formats/list_text.h"
#include "formats/loss.h"
#include "formats/noise.h"
#include "json/json.h"

// Formats that are maps of lists, in YAML or JSON:
//
//   imu_calib   accelerometer only, in double, x = SM y - bias.
//               imu_calib: src/accel_calib/accel_calib.cpp
//   RealSense   D400, in float32 in the device, x = Sigma y - beta. The nine numbers are Sigma by
//               columns: the script stores the transpose of what it applies.
//               librealsense: tools/rs-imu-calibration/rs-imu-calibration.py (check_X,
//               get_IMU_Calib_Table), src/proc/motion-transform.cpp
//   Basalt      in double, x = (I + E) y - c. calib_accel_bias is c and the lower triangle of E
//   (c_x
//               c_y c_z E11 E21 E31 E22 E32 E33), calib_gyro_bias is c and E by columns.
//               basalt-headers: include/basalt/calibration/calib_bias.hpp,
//               serialization/headers_serialization.h
//   ROS 2       parameters of a node, in double, for readings as sensor_msgs has them (m/s^2,
//   rad/s,
//               tesla): correction (y - bias - g_sensitivity linear_acceleration), and the
//               covariances of sensor_msgs/msg/Imu and MagneticField, whose zeros mean "unknown".
//               common_interfaces: sensor_msgs/msg/Imu.msg, MagneticField.msg

namespace truetriad {
namespace {

/// Where a file keeps its fields.
struct Listing {
  std::vector<std::string_view> path;  ///< Keys; `[0]` is the first of a list.
  bool by_sensor = false;              ///< Each sensor has a map of its own there, by its name.
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

Result<std::vector<ExportedFile>> WriteImuCalib(const WriteRequest& request,
                                                std::vector<std::string>* /*warnings*/) {
  std::string text = CommentText("# ", request.comment);
  for (const Field& field : ImuCalib().fields[Triad::kAccelerometer]) {
    const auto& sensor = request.calibration.sensors[Triad::kAccelerometer];
    text.append(field.name).append(": ").append(ListText(ValueOf(field.quantity, *sensor))) += '\n';
  }
  return std::vector<ExportedFile>{{"", std::move(text)}};
}

Result<std::vector<ExportedFile>> WriteRealSense(const WriteRequest& request,
                                                 std::vector<std::string>* warnings) {
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
  warnings->emplace_back(
      "RealSense corrects in the depth camera's frame (x right, y down, z forward); record and "
      "calibrate in those axes");
  const Json json = {{"device_type", "D435i"},
                     {"imus", Json::array({std::move(sensors)})},
                     {"comment", request.comment}};
  return std::vector<ExportedFile>{{"", TextOf(json)}};
}

Result<std::vector<ExportedFile>> WriteBasalt(const WriteRequest& request,
                                              std::vector<std::string>* warnings) {
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
      warnings->emplace_back(std::string(TriadName(triad)) + ": " + name + "_noise_std and " +
                             name +
                             "_bias_std are missing; give --allan=FILE with white noise and random "
                             "walk of every axis, or fill them in");
    }
  }
  if (rate_hz > 0.0) members["imu_update_rate"] = rate_hz;
  const Json json = {{"value0", std::move(members)}, {"comment", request.comment}};
  return std::vector<ExportedFile>{{"", TextOf(json)}};
}

constexpr double kTeslaPerMicrotesla = 1e-6;  // sensor_msgs/MagneticField is in tesla.
constexpr PerTriad<std::string_view> kCovarianceNames = {
    {"linear_acceleration_covariance", "angular_velocity_covariance", "magnetic_field_covariance"}};

/// "[1.0, 0.5]": rcl takes no list that has whole numbers beside others.
std::string RealListText(const Eigen::VectorXd& values) {
  std::string text;
  for (const double value : values) {
    const std::string number = NumberText(value);
    const bool is_whole = number.find_first_of(".e") == std::string::npos;
    text.append(text.empty() ? "[" : ", ").append(number).append(is_whole ? ".0" : "");
  }
  return text + "]";
}

/// Variances of one corrected reading by axis, in the message's unit: the noise of a sample through
/// the correction, and the calibration's own. Zero, and a warning, where no noise is known: less
/// than the truth would claim too much.
Result<Eigen::Vector3d> Variances(const WriteRequest& request,
                                  Triad triad,
                                  const Eigen::Matrix3d& correction,
                                  std::vector<std::string>* warnings) {
  TRUETRIAD_ASSIGN_OR_RETURN(const std::optional<NoiseDensities> noise,
                             NoiseOf(request.options, triad));
  if (!noise) {
    warnings->emplace_back(std::string(TriadName(triad)) + ": " +
                           std::string(kCovarianceNames[triad]) + " is zero (unknown): " +
                           (request.options.allan
                                ? "the Allan file does not tell white noise of every axis"
                                : "its noise density is missing; give --allan=FILE"));
    return Eigen::Vector3d(Eigen::Vector3d::Zero());
  }
  const Eigen::Vector3d of_sample = noise->white.array().square() * noise->rate_hz;
  Eigen::Vector3d variances = correction.array().square().matrix() * of_sample;
  if (request.stated->covariance.matrix.size() > 0) {
    variances += ReadingVariances(triad, *request.stated);
  } else {
    warnings->emplace_back(std::string(TriadName(triad)) +
                           ": the calibration states no covariance; " +
                           std::string(kCovarianceNames[triad]) + " is of noise alone");
  }
  if (triad == Triad::kMagnetometer) variances *= kTeslaPerMicrotesla * kTeslaPerMicrotesla;
  return variances;
}

Result<std::vector<ExportedFile>> WriteRos2(const WriteRequest& request,
                                            std::vector<std::string>* warnings) {
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
                               Variances(request, triad, sensor->model.Correction(), warnings));
    const Eigen::Matrix3d covariance = variances.asDiagonal();
    covariances.append("    ").append(kCovarianceNames[triad]).append(": ");
    covariances += RealListText(covariance.reshaped()) + "\n";
  }
  return std::vector<ExportedFile>{{"", text + covariances}};
}

}  // namespace

Format ImuCalibFormat() {
  Format format;
  format.info = {
      "imu-calib", "imu_calib (ROS), accelerometer (YAML)", "imu_calib.yaml", Arithmetic::kFloat64};
  format.capacity[Triad::kAccelerometer] = {.held = true, .reading_unit = "m/s^2"};
  format.write = WriteImuCalib;
  format.read = [](const ReadRequest& request) { return ReadListing(ImuCalib(), request); };
  return format;
}

Format RealSenseFormat() {
  Format format;
  format.info = {
      "realsense", "RealSense D400 with IMU (JSON)", "realsense.json", Arithmetic::kFloat32};
  format.capacity[Triad::kAccelerometer] = {.held = true, .reading_unit = "m/s^2"};
  format.capacity[Triad::kGyroscope] = {.held = true, .reading_unit = "rad/s"};
  format.write = WriteRealSense;
  format.read = [](const ReadRequest& request) { return ReadListing(RealSense(), request); };
  return format;
}

Format BasaltFormat() {
  Format format;
  format.info = {
      "basalt", "Basalt calibration, the IMU's part (JSON)", "basalt.json", Arithmetic::kFloat64};
  format.gauge = Gauge::kAccelX;
  format.capacity[Triad::kAccelerometer] = {.held = true, .reading_unit = "m/s^2"};
  format.capacity[Triad::kGyroscope] = {.held = true, .reading_unit = "rad/s"};
  format.write = WriteBasalt;
  format.read = [](const ReadRequest& request) { return ReadListing(Basalt(), request); };
  return format;
}

Format Ros2Format() {
  Format format;
  format.info = {"ros2",
                 "ROS 2 parameters: correction, and covariances of sensor_msgs (YAML)",
                 "ros2.yaml",
                 Arithmetic::kFloat64};
  format.capacity[Triad::kAccelerometer] = {.held = true, .reading_unit = "m/s^2"};
  format.capacity[Triad::kGyroscope] = {
      .held = true, .g_sensitivity = true, .reading_unit = "rad/s"};
  format.capacity[Triad::kMagnetometer] = {
      .held = true, .reading_unit = "T", .result_in_reading_unit = true};
  format.write = WriteRos2;
  format.read = [](const ReadRequest& request) { return ReadListing(Ros2(), request); };
  return format;
}

}  // namespace truetriad
