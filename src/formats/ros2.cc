// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <string>

#include "formats/format.h"
#include "formats/list_text.h"
#include "formats/loss.h"
#include "formats/noise.h"

// Parameters of a ROS 2 node, in double, for readings as sensor_msgs has them (m/s^2, rad/s,
// tesla):
//
//   linear_acceleration = correction (y - bias)
//   angular_velocity    = correction (y - bias - g_sensitivity linear_acceleration)
//   magnetic_field      = correction (y - bias)
//
// and the covariances of sensor_msgs/msg/Imu and MagneticField, whose zeros mean "unknown".
// common_interfaces: sensor_msgs/msg/Imu.msg, MagneticField.msg. Matrices by rows; rcl takes no
// list that has whole numbers beside others, so all have a point or an exponent.

namespace truetriad {
namespace {

constexpr std::string_view kIndent = "    ";
constexpr double kTeslaPerMicrotesla = 1e-6;  // sensor_msgs/MagneticField is in tesla.

std::string_view CovarianceName(Triad triad) {
  switch (triad) {
    case Triad::kAccelerometer:
      return "linear_acceleration_covariance";
    case Triad::kGyroscope:
      return "angular_velocity_covariance";
    case Triad::kMagnetometer:
      return "magnetic_field_covariance";
  }
  return "";
}

template <int kSize>
std::string Numbers(const Eigen::Matrix<double, kSize, 1>& values) {
  std::string text = "[";
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    std::string number = NumberText(values[i]);
    if (number.find_first_of(".e") == std::string::npos) number += ".0";
    text += (i > 0 ? ", " : "") + number;
  }
  return text + "]";
}

std::string Rows(const Eigen::Matrix3d& matrix) {
  const Eigen::Matrix3d transposed = matrix.transpose();
  return Numbers<9>(transposed.reshaped());
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
                           std::string(CovarianceName(triad)) + " is zero (unknown): " +
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
                           std::string(CovarianceName(triad)) + " is of noise alone");
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
    const Eigen::Matrix3d correction = sensor->model.Correction();
    text.append(kIndent).append(TriadName(triad)).append(":\n");
    const auto line = [&text](std::string_view name, const std::string& values) {
      text.append(kIndent).append("  ").append(name).append(": ").append(values).append("\n");
    };
    line("correction", Rows(correction));
    line("bias", Numbers<3>(sensor->model.bias));
    if (sensor->g_sensitivity) line("g_sensitivity", Rows(*sensor->g_sensitivity));
    TRUETRIAD_ASSIGN_OR_RETURN(const Eigen::Vector3d variances,
                               Variances(request, triad, correction, warnings));
    covariances.append(kIndent).append(CovarianceName(triad)).append(": ");
    covariances += Rows(variances.asDiagonal().toDenseMatrix()) + "\n";
  }
  return std::vector<ExportedFile>{{"", text + covariances}};
}

Eigen::Matrix3d ReadMatrix(YamlReader reader) {
  const std::vector<double> values = ReadList(std::move(reader), 9);
  if (values.empty()) return Eigen::Matrix3d::Identity();
  return Eigen::Map<const Eigen::Matrix3d>(values.data()).transpose();
}

Result<Carried> ReadRos2(const ReadRequest& request) {
  const ExportedFile& file = request.files[0];
  TRUETRIAD_ASSIGN_OR_RETURN(YamlReader root, YamlReader::FromText(file.text, file.suffix));
  YamlReader node = root.RequireChild("/**");
  YamlReader parameters = node.RequireChild("ros__parameters");
  Carried carried;
  for (const Triad triad : kTriads) {
    YamlReader sensor = parameters.Child(std::string(TriadName(triad)));
    if (!sensor) continue;
    const Eigen::Matrix3d correction = ReadMatrix(sensor.RequireChild("correction"));
    const std::vector<double> stated = ReadList(sensor.RequireChild("bias"), 3);
    const Eigen::Vector3d bias =
        stated.empty() ? Eigen::Vector3d::Zero() : Eigen::Vector3d(stated.data());
    Eigen::Matrix3d G = Eigen::Matrix3d::Zero();
    if (YamlReader child = sensor.Child("g_sensitivity")) G = ReadMatrix(child);
    carried.equations[triad] = [=](const Eigen::Vector3d& reading,
                                   const Eigen::Vector3d& force_mps2,
                                   double /*temperature_degc*/) -> Eigen::Vector3d {
      return correction * (reading - bias - G * force_mps2);
    };
  }
  TRUETRIAD_RETURN_IF_ERROR(root.status());
  return carried;
}

}  // namespace

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
  format.read = ReadRos2;
  return format;
}

}  // namespace truetriad
