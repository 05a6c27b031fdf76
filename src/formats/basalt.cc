// SPDX-License-Identifier: Apache-2.0
#include <utility>

#include <Eigen/Core>

#include "formats/format.h"
#include "formats/list_text.h"
#include "formats/noise.h"
#include "json/json.h"

// Basalt, in double: x = (I + E) y - c. calib_accel_bias is c and the lower triangle of E
// (c_x c_y c_z E11 E21 E31 E22 E32 E33), calib_gyro_bias is c and E by columns.
// basalt-headers: include/basalt/calibration/calib_bias.hpp, serialization/headers_serialization.h.

namespace truetriad {
namespace {

Result<std::vector<ExportedFile>> WriteBasalt(const WriteRequest& request,
                                              std::vector<std::string>* warnings) {
  Json members = Json::object();
  double rate_hz = 0.0;
  for (const Triad triad : {Triad::kAccelerometer, Triad::kGyroscope}) {
    const std::optional<TriadCalibration>& sensor = request.calibration.sensors[triad];
    if (!sensor) continue;
    const std::string name = triad == Triad::kAccelerometer ? "accel" : "gyro";
    const Eigen::Matrix3d C = sensor->model.Correction();
    const Eigen::Vector3d c = C * sensor->model.bias;
    const Eigen::Matrix3d E = C - Eigen::Matrix3d::Identity();
    std::vector<double> numbers(c.begin(), c.end());
    for (int col = 0; col < 3; ++col) {
      for (int row = triad == Triad::kAccelerometer ? col : 0; row < 3; ++row) {
        numbers.push_back(E(row, col));
      }
    }
    members["calib_" + name + "_bias"] = numbers;
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

Result<Carried> ReadBasalt(const ReadRequest& request) {
  const ExportedFile& file = request.files[0];
  TRUETRIAD_ASSIGN_OR_RETURN(YamlReader root, YamlReader::FromText(file.text, file.suffix));
  YamlReader value = root.RequireChild("value0");
  Carried carried;
  for (const Triad triad : {Triad::kAccelerometer, Triad::kGyroscope}) {
    const bool lower = triad == Triad::kAccelerometer;
    YamlReader list = value.Child(lower ? "calib_accel_bias" : "calib_gyro_bias");
    if (!list) continue;
    const std::vector<double> numbers = ReadList(list, lower ? 9 : 12);
    if (numbers.empty()) continue;
    const Eigen::Vector3d c(numbers[0], numbers[1], numbers[2]);
    Eigen::Matrix3d E = Eigen::Matrix3d::Zero();
    std::size_t next = 3;
    for (int col = 0; col < 3; ++col) {
      for (int row = lower ? col : 0; row < 3; ++row) E(row, col) = numbers[next++];
    }
    carried.equations[triad] = [=](const Eigen::Vector3d& reading,
                                   const Eigen::Vector3d& /*force_mps2*/,
                                   double /*temperature_degc*/) -> Eigen::Vector3d {
      return reading + E * reading - c;
    };
  }
  TRUETRIAD_RETURN_IF_ERROR(root.status());
  return carried;
}

}  // namespace

Format BasaltFormat() {
  Format format;
  format.info = {
      "basalt", "Basalt calibration, the IMU's part (JSON)", "basalt.json", Arithmetic::kFloat64};
  format.gauge = Gauge::kAccelX;
  format.capacity[Triad::kAccelerometer] = {.held = true, .reading_unit = "m/s^2"};
  format.capacity[Triad::kGyroscope] = {.held = true, .reading_unit = "rad/s"};
  format.write = WriteBasalt;
  format.read = ReadBasalt;
  return format;
}

}  // namespace truetriad
