// SPDX-License-Identifier: Apache-2.0
#include <utility>

#include <Eigen/Core>

#include "formats/format.h"
#include "formats/list_text.h"
#include "json/json.h"

// RealSense D400, float32 in the device: x = Sigma y - beta. The nine numbers are Sigma by columns:
// the script stores the transpose of what it applies.
// librealsense: tools/rs-imu-calibration/rs-imu-calibration.py (check_X, get_IMU_Calib_Table),
// src/proc/motion-transform.cpp.

namespace truetriad {
namespace {

Result<std::vector<ExportedFile>> WriteRealSense(const WriteRequest& request,
                                                 std::vector<std::string>* warnings) {
  Json sensors = Json::object();
  for (const Triad triad : {Triad::kAccelerometer, Triad::kGyroscope}) {
    const std::optional<TriadCalibration>& sensor = request.calibration.sensors[triad];
    if (!sensor) continue;
    const Eigen::Matrix3d C = sensor->model.Correction();
    const Eigen::Matrix3f sigma = C.cast<float>();
    const Eigen::Vector3f beta = (C * sensor->model.bias).cast<float>();
    sensors[std::string(TriadName(triad))] = {
        {"scale_and_alignment", ListJson(sigma.reshaped().cast<double>())},
        {"bias", ListJson(beta.cast<double>())}};
  }
  warnings->emplace_back(
      "RealSense corrects in the depth camera's frame (x right, y down, z forward); record and "
      "calibrate in those axes");
  const Json json = {{"device_type", "D435i"},
                     {"imus", Json::array({std::move(sensors)})},
                     {"comment", request.comment}};
  return std::vector<ExportedFile>{{"", TextOf(json)}};
}

Result<Carried> ReadRealSense(const ReadRequest& request) {
  const ExportedFile& file = request.files[0];
  TRUETRIAD_ASSIGN_OR_RETURN(YamlReader root, YamlReader::FromText(file.text, file.suffix));
  std::vector<YamlReader> imus = root.RequireChild("imus").Items();
  if (imus.empty()) return Error(ErrorCode::kMissingKey, {file.suffix}, "`imus` is empty");
  Carried carried;
  for (const Triad triad : {Triad::kAccelerometer, Triad::kGyroscope}) {
    YamlReader sensor = imus[0].Child(TriadName(triad));
    if (!sensor) continue;
    const std::vector<double> by_columns = ReadList(sensor.RequireChild("scale_and_alignment"), 9);
    const std::vector<double> bias = ReadList(sensor.RequireChild("bias"), 3);
    if (by_columns.empty() || bias.empty()) continue;
    const Eigen::Matrix3f sigma =
        Eigen::Map<const Eigen::Matrix3d>(by_columns.data()).cast<float>();
    const Eigen::Vector3f beta = Eigen::Map<const Eigen::Vector3d>(bias.data()).cast<float>();
    carried.equations[triad] = [=](const Eigen::Vector3d& reading,
                                   const Eigen::Vector3d& /*force_mps2*/,
                                   double /*temperature_degc*/) -> Eigen::Vector3d {
      const Eigen::Vector3f result = sigma * reading.cast<float>() - beta;
      return result.cast<double>();
    };
  }
  TRUETRIAD_RETURN_IF_ERROR(root.status());
  return carried;
}

}  // namespace

Format RealSenseFormat() {
  Format format;
  format.info = {
      "realsense", "RealSense D400 with IMU (JSON)", "realsense.json", Arithmetic::kFloat32};
  format.capacity[Triad::kAccelerometer] = {.held = true, .reading_unit = "m/s^2"};
  format.capacity[Triad::kGyroscope] = {.held = true, .reading_unit = "rad/s"};
  format.write = WriteRealSense;
  format.read = ReadRealSense;
  return format;
}

}  // namespace truetriad
