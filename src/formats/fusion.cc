// SPDX-License-Identifier: Apache-2.0
#include <charconv>
#include <vector>

#include <Eigen/Core>

#include "formats/format.h"
#include "formats/number_text.h"

// x-io Fusion's calibration constants, as C, in float32:
//
//   accelerometer, gyroscope   misalignment ((y - offset) o sensitivity)
//   magnetometer               softIron (y - hardIron)
//
// Fusion: Fusion/FusionModel.h (earlier FusionCalibration.h), examples.

namespace truetriad {
namespace {

std::string Prefix(Triad triad) { return std::string(TriadName(triad)); }

/// "const FusionVector gyroscopeOffset = {0.0f, 0.0f, 0.0f};" Matrices by rows.
template <typename Derived>
std::string Constant(const std::string& name, const Eigen::MatrixBase<Derived>& values) {
  constexpr bool kIsVector = Derived::ColsAtCompileTime == 1;
  std::string text = std::string("static const ") +
                     (kIsVector ? "FusionVector " : "FusionMatrix ") + name + " = {";
  for (Eigen::Index row = 0; row < values.rows(); ++row) {
    for (Eigen::Index col = 0; col < values.cols(); ++col) {
      text += (row + col > 0 ? ", " : "") + FloatLiteral(static_cast<float>(values(row, col)));
    }
  }
  return text + "};\n";
}

Result<std::vector<ExportedFile>> WriteFusion(const WriteRequest& request,
                                              std::vector<std::string>* /*warnings*/) {
  std::string text = CommentText("// ", request.comment) + "#include \"Fusion.h\"\n\n";
  for (const Triad triad : kTriads) {
    const std::optional<TriadCalibration>& sensor = request.calibration.sensors[triad];
    if (!sensor) continue;
    const Eigen::Matrix3d C = sensor->model.Correction();
    if (triad == Triad::kMagnetometer) {
      text += Constant("softIronMatrix", C) + Constant("hardIronOffset", sensor->model.bias);
      continue;
    }
    const Eigen::Vector3d sensitivity = C.diagonal();
    text += Constant(Prefix(triad) + "Misalignment", C * sensitivity.cwiseInverse().asDiagonal()) +
            Constant(Prefix(triad) + "Sensitivity", sensitivity) +
            Constant(Prefix(triad) + "Offset", sensor->model.bias);
  }
  return std::vector<ExportedFile>{{"", std::move(text)}};
}

/// The `count` numbers of the constant `name`; empty when it is not there.
std::vector<float> Numbers(const std::string& text, const std::string& name, std::size_t count) {
  std::vector<float> numbers;
  const std::size_t declared = text.find(" " + name + " = {");
  if (declared == std::string::npos) return numbers;
  std::size_t at = text.find('{', declared) + 1;
  while (numbers.size() < count) {
    float value = 0.0F;
    const auto [end, failure] = std::from_chars(text.data() + at, text.data() + text.size(), value);
    if (failure != std::errc()) return {};
    numbers.push_back(value);
    at = static_cast<std::size_t>(end - text.data()) + 3;  // past "f, "
  }
  return numbers;
}

Result<Carried> ReadFusion(const ReadRequest& request) {
  const std::string& text = request.files[0].text;
  Carried carried;
  for (const Triad triad : kTriads) {
    const bool is_mag = triad == Triad::kMagnetometer;
    const std::vector<float> matrix =
        Numbers(text, is_mag ? "softIronMatrix" : Prefix(triad) + "Misalignment", 9);
    const std::vector<float> offset =
        Numbers(text, is_mag ? "hardIronOffset" : Prefix(triad) + "Offset", 3);
    const std::vector<float> gains =
        is_mag ? std::vector<float>(3, 1.0F) : Numbers(text, Prefix(triad) + "Sensitivity", 3);
    if (matrix.empty() || offset.empty() || gains.empty()) continue;
    const Eigen::Matrix3f misalignment =
        Eigen::Map<const Eigen::Matrix3f>(matrix.data()).transpose();
    const Eigen::Vector3f zero = Eigen::Map<const Eigen::Vector3f>(offset.data());
    const Eigen::Vector3f sensitivity = Eigen::Map<const Eigen::Vector3f>(gains.data());
    carried.equations[triad] = [=](const Eigen::Vector3d& reading,
                                   const Eigen::Vector3d& /*force_mps2*/,
                                   double /*temperature_degc*/) -> Eigen::Vector3d {
      const Eigen::Vector3f result =
          misalignment * (reading.cast<float>() - zero).cwiseProduct(sensitivity);
      return result.cast<double>();
    };
  }
  return carried;
}

}  // namespace

Format FusionFormat() {
  Format format;
  format.info = {
      "fusion", "x-io Fusion constants (C), g and deg/s", "fusion.h", Arithmetic::kFloat32};
  for (const Triad triad : kTriads) {
    format.capacity[triad] = {.held = true,
                              .reading_unit = triad == Triad::kAccelerometer ? "g"
                                              : triad == Triad::kGyroscope   ? "deg/s"
                                                                             : "uT",
                              .free_unit = true,
                              .result_in_reading_unit = true};
  }
  format.write = WriteFusion;
  format.read = ReadFusion;
  return format;
}

}  // namespace truetriad
