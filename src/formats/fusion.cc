// SPDX-License-Identifier: Apache-2.0
#include <charconv>
#include <string>

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

const PerTriad<std::vector<Field>> kConstants = {
    {{{{"accelerometerMisalignment", Quantity::kMisalignment},
       {"accelerometerSensitivity", Quantity::kGains},
       {"accelerometerOffset", Quantity::kBias}},
      {{"gyroscopeMisalignment", Quantity::kMisalignment},
       {"gyroscopeSensitivity", Quantity::kGains},
       {"gyroscopeOffset", Quantity::kBias}},
      {{"softIronMatrix", Quantity::kCorrection}, {"hardIronOffset", Quantity::kBias}}}}};

/// "const FusionVector gyroscopeOffset = {0.0f, 0.0f, 0.0f};" Matrices by rows.
std::string Constant(std::string_view name, const Eigen::VectorXd& values) {
  std::string text = "static const ";
  text.append(values.size() == 3 ? "FusionVector " : "FusionMatrix ").append(name).append(" = {");
  for (Eigen::Index i = 0; i < values.size(); ++i)
    text += (i > 0 ? ", " : "") + FloatLiteral(static_cast<float>(values[i]));
  return text + "};\n";
}

Result<std::vector<ExportedFile>> WriteFusion(const WriteRequest& request,
                                              std::vector<std::string>* /*warnings*/) {
  std::string text = CommentText("// ", request.comment) + "#include \"Fusion.h\"\n\n";
  for (const Triad triad : kTriads) {
    const std::optional<TriadCalibration>& sensor = request.calibration.sensors[triad];
    if (!sensor) continue;
    for (const Field& field : kConstants[triad])
      text += Constant(field.name, ValueOf(field.quantity, *sensor));
  }
  return std::vector<ExportedFile>{{"", std::move(text)}};
}

/// The `count` numbers of the constant `name`; unset when they are not there.
std::optional<Eigen::VectorXd> ConstantNumbers(const std::string& text,
                                               std::string_view name,
                                               Eigen::Index count) {
  const std::size_t declared = text.find(" " + std::string(name) + " = {");
  if (declared == std::string::npos) return std::nullopt;
  Eigen::VectorXd numbers(count);
  const char* at = text.data() + text.find('{', declared) + 1;
  const char* const text_end = text.data() + text.size();
  for (double& number : numbers) {
    float value = 0.0F;
    if (at > text_end) return std::nullopt;
    const auto [end, failure] = std::from_chars(at, text_end, value);
    if (failure != std::errc()) return std::nullopt;
    number = value;
    at = end + 3;  // Past "f, ".
  }
  return numbers;
}

Result<Carried> ReadFusion(const ReadRequest& request) {
  Carried carried;
  for (const Triad triad : kTriads) {
    Stated stated;
    for (const auto& [name, quantity, is_optional] : kConstants[triad]) {
      const auto numbers = ConstantNumbers(request.files[0].text, name, SizeOf(quantity));
      if (numbers) stated[quantity] = *numbers;
    }
    if (stated.size() == kConstants[triad].size())
      carried.parts[triad] = CorrectionParts::Of(stated);
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
