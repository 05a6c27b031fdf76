// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Core>

#include "formats/format.h"
#include "formats/list_text.h"

// imu_calib (ROS), accelerometer only, in double: x = SM y - bias, SM by rows.
// imu_calib: src/accel_calib/accel_calib.cpp.

namespace truetriad {
namespace {

Result<std::vector<ExportedFile>> WriteImuCalib(const WriteRequest& request,
                                                std::vector<std::string>* /*warnings*/) {
  const TriadCalibration& sensor = *request.calibration.sensors[Triad::kAccelerometer];
  const Eigen::Matrix3d C = sensor.model.Correction();
  std::string text = CommentText("# ", request.comment) + "SM: " + RowMajorText(C) +
                     "\nbias: " + ListText(Eigen::Vector3d(C * sensor.model.bias)) + "\n";
  return std::vector<ExportedFile>{{"", std::move(text)}};
}

Result<Carried> ReadImuCalib(const ReadRequest& request) {
  const ExportedFile& file = request.files[0];
  TRUETRIAD_ASSIGN_OR_RETURN(YamlReader root, YamlReader::FromText(file.text, file.suffix));
  const std::vector<double> SM = ReadList(root.RequireChild("SM"), 9);
  const std::vector<double> bias = ReadList(root.RequireChild("bias"), 3);
  TRUETRIAD_RETURN_IF_ERROR(root.status());
  const Eigen::Matrix3d matrix = Eigen::Map<const Eigen::Matrix3d>(SM.data()).transpose();
  const Eigen::Vector3d after = Eigen::Map<const Eigen::Vector3d>(bias.data());
  Carried carried;
  carried.equations[Triad::kAccelerometer] = [=](const Eigen::Vector3d& reading,
                                                 const Eigen::Vector3d& /*force_mps2*/,
                                                 double /*temperature_degc*/) -> Eigen::Vector3d {
    return matrix * reading - after;
  };
  return carried;
}

}  // namespace

Format ImuCalibFormat() {
  Format format;
  format.info = {
      "imu-calib", "imu_calib (ROS), accelerometer (YAML)", "imu_calib.yaml", Arithmetic::kFloat64};
  format.capacity[Triad::kAccelerometer] = {.held = true, .reading_unit = "m/s^2"};
  format.write = WriteImuCalib;
  format.read = ReadImuCalib;
  return format;
}

}  // namespace truetriad
