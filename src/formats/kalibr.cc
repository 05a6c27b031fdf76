// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <functional>

#include "formats/format.h"
#include "formats/text.h"

// Three files, in double: Kalibr's input, which holds only noise; Kalibr's result with the
// scale-misalignment model; the kalibr_imu_chain.yaml of OpenVINS.
//
//   Kalibr     y_a = M_a f + b_a,   y_g = M_g C_gi w + A C_gi f + b_g
//   OpenVINS   f = Ta^-1 (y_a - b_a),   w = R_IMUtoGYRO^T Tw^-1 (y_g - b_g - Tg f)
//
// M_a, M_g, Ta, Tw are lower triangular, C_gi = R_IMUtoGYRO is a rotation, A C_gi = Tg = G. Both
// programs estimate biases as states, so the file has them only in a comment.
// kalibr: aslam_offline_calibration/kalibr/python/kalibr_imu_camera_calibration/IccSensors.py
// (IccScaledMisalignedImu), kalibr_common/ConfigReader.py (ImuParameters: six keys, each above
// zero); open_vins: ov_msckf/src/core/VioManagerOptions.h, src/state/Propagator.cpp.

namespace truetriad {
namespace {

constexpr std::string_view kBiasComment = "# bias ";

constexpr std::array<Triad, 2> kInertial = {Triad::kAccelerometer, Triad::kGyroscope};

/// A matrix in the file, and the sensor that it belongs to.
struct ChainField {
  Triad triad;
  Field field;
};
/// How Kalibr, or OpenVINS, lays out its file of a chain of sensors.
struct Chain {
  std::string_view begin, model;
  bool has_blocks;  ///< In the file, each sensor has a map of its own.
  std::array<ChainField, 4> fields;
};
constexpr Chain kKalibr = {"",
                           "scale-misalignment",
                           true,
                           {{{Triad::kAccelerometer, {"M", Quantity::kSensitivity}},
                             {Triad::kGyroscope, {"M", Quantity::kLowerFactor}},
                             {Triad::kGyroscope, {"A", Quantity::kGBehindRotation}},
                             {Triad::kGyroscope, {"C_gyro_i", Quantity::kRotationFactor}}}}};
constexpr Chain kOpenVins = {"%YAML:1.0\n\n",
                             "\"kalibr\"",
                             false,
                             {{{Triad::kGyroscope, {"Tw", Quantity::kLowerFactor}},
                               {Triad::kGyroscope, {"R_IMUtoGYRO", Quantity::kRotationFactor}},
                               {Triad::kAccelerometer, {"Ta", Quantity::kSensitivity}},
                               {Triad::kGyroscope, {"Tg", Quantity::kGSensitivity}}}}};

std::vector<Field> ChainFieldsOf(Triad triad, const Chain& chain) {
  std::vector<Field> own;
  for (const ChainField& field : chain.fields) {
    if (field.triad == triad) own.push_back(field.field);
  }
  return own;
}

/// The two sensors of a file, which must state both. If a sensor is not calibrated, its correction
/// becomes the identity, with a warning. Error: the gyroscope is mirrored.
Result<PerTriad<TriadCalibration>> BothSensors(const WriteRequest& request) {
  const Calibration& calibration = request.calibration;
  PerTriad<TriadCalibration> both;
  const std::optional<TriadCalibration>& gyroscope = calibration.sensors[Triad::kGyroscope];
  if (gyroscope && gyroscope->model.sensitivity.determinant() < 0.0) {
    return Error(ErrorCode::kNotRepresentable,
                 "the gyroscope is mirrored (the determinant of its sensitivity is negative), "
                 "which a rotation and positive gains cannot express; reverse one axis of its "
                 "readings and calibrate again");
  }
  for (const Triad triad : kInertial) {
    if (calibration.sensors[triad]) {
      both[triad] = *calibration.sensors[triad];
      continue;
    }
    request.warnings.emplace_back(std::string(TriadName(triad)) +
                                  ": not calibrated; the file must state this sensor, so it states "
                                  "a correction that changes nothing");
  }
  return both;
}

std::string BiasComments(const Calibration& calibration) {
  std::string text;
  for (const Triad triad : kInertial) {
    const auto& sensor = calibration.sensors[triad];
    if (!sensor) continue;
    text.append(kBiasComment).append(TriadName(triad)).append(" ");
    text.append(sensor->input_unit).append(": ").append(ListText(sensor->model.bias)).append("\n");
  }
  return text;
}

/// Python's YAML reads 2e-05 as a string, and 2.0e-05 as a number.
std::string RealText(double value) {
  std::string text = NumberText(value);
  const std::size_t exponent = text.find('e');
  if (exponent != std::string::npos && text.find('.') == std::string::npos) {
    text.insert(exponent, ".0");
  }
  return text;
}

/// The lines of the noise keys, with placeholders for unknown values. If a rest is too short to
/// determine a random walk, the density is still written.
Result<std::string> NoiseText(const std::string& indent, const WriteRequest& request) {
  const ExportOptions& options = request.options;
  std::string text;
  double rate_hz = 0.0;
  for (const Triad triad : kInertial) {
    TRUETRIAD_ASSIGN_OR_RETURN(const std::optional<NoiseDensities> noise, NoiseOf(options, triad));
    const std::string name(TriadName(triad));
    const std::string unit(TruthUnitName(triad));
    const auto line =
        [&](std::string_view what, bool is_known, double value, const std::string& of) {
          text += indent + (is_known ? "" : "# ") + name + std::string(what) + ": " +
                  (is_known ? RealText(value) : "?") + "  # " + of + "\n";
        };
    const bool has_walk = noise && noise->random_walk;
    line("_noise_density",
         noise.has_value(),
         noise ? RmsOfAxes(noise->white) : 0.0,
         unit + "/sqrt(Hz)");
    line("_random_walk",
         has_walk,
         has_walk ? RmsOfAxes(*noise->random_walk) : 0.0,
         unit + "/s/sqrt(Hz)");
    if (noise) rate_hz = noise->rate_hz;
    if (has_walk) continue;
    request.warnings.emplace_back(
        name + (!options.allan ? ": its noise densities are missing; give --allan=FILE, or enter "
                                 "them by hand"
                : noise        ? ": the Allan file lacks the random walk of some axis (a longer "
                                 "rest may show it); enter it by hand"
                               : ": the Allan file lacks the white noise of some axis (a longer "
                                 "rest may show it); enter the densities by hand"));
  }
  if (!(rate_hz > 0.0)) {
    request.warnings.emplace_back("update_rate is missing; give --allan=FILE, or enter it by hand");
  }
  text += indent +
          (rate_hz > 0.0 ? "update_rate: " + RealText(rate_hz) + "\n" : "# update_rate: ?  # Hz\n");
  return text;
}

constexpr std::string_view kBody =
    "  T_i_b: [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]\n"
    "  time_offset: 0.0\n"
    "  rostopic: /imu0\n";

Result<Files> WriteKalibr(const WriteRequest& request) {
  TRUETRIAD_ASSIGN_OR_RETURN(const std::string noise, NoiseText("", request));
  return Files{{"", CommentText("# ", request.comment) + "rostopic: /imu0\n" + noise}};
}

Result<Files> WriteChain(const Chain& chain, const WriteRequest& request) {
  TRUETRIAD_ASSIGN_OR_RETURN(const auto both, BothSensors(request));
  TRUETRIAD_ASSIGN_OR_RETURN(const std::string noise, NoiseText("  ", request));
  std::string text(chain.begin);
  text += CommentText("# ", request.comment) + BiasComments(request.calibration) +
          "imu0:\n  model: " + std::string(chain.model) + "\n" + std::string(kBody) + noise;
  const std::string indent = chain.has_blocks ? "    " : "  ";
  std::optional<Triad> block;
  for (const auto& [triad, field] : chain.fields) {
    if (chain.has_blocks && block != triad) text.append("  ").append(TriadName(triad)) += "s:\n";
    block = triad;
    text.append(indent).append(field.name) += ": ";
    text += RowsText(ValueOf(field.quantity, both[triad])) + "\n";
    // The accelerometer's axes are those of the IMU.
    if (!chain.has_blocks && triad == Triad::kAccelerometer)
      text += "  R_IMUtoACC: " + RowsText(Eigen::Matrix3d::Identity().reshaped()) + "\n";
  }
  return Files{{"", std::move(text)}};
}

/// The bias that a comment of the file states for `triad`. If there is no such comment: zero, and a
/// note is added to `carried`.
Eigen::Vector3d BiasFromComment(const std::string& text, Triad triad, Carried* carried) {
  const std::string begin = std::string(kBiasComment) + std::string(TriadName(triad)) + " ";
  const std::size_t at = text.find(begin);
  const std::size_t list = at == std::string::npos ? at : text.find('[', at);
  const std::size_t end = text.find(']', std::min(list, text.size()));
  if (end < text.size()) {
    Result<YamlReader> line =
        YamlReader::FromText("bias: " + text.substr(list, end + 1 - list), "the comment");
    Eigen::Vector3d bias;
    if (line && line->Child("bias").Read(&bias)) return bias;
  }
  carried->notes.emplace_back(std::string(TriadName(triad)) +
                              ": the file contains no bias; assumed zero");
  return Eigen::Vector3d::Zero();
}

/// The block of the first IMU.
YamlReader FirstImu(YamlReader* root) {
  for (const std::string& key : root->Keys()) {
    if (key.starts_with("imu")) return root->Child(key);
  }
  return root->RequireChild("imu0");
}

/// Reads the file of a chain, or Kalibr's input, which states no correction. Error: a matrix is
/// singular.
Result<Carried> ReadChain(const Chain& chain, const ReadRequest& request) {
  const ExportedFile& file = request.files[0];
  // The first line of an OpenCV file is not YAML.
  const std::size_t begin = file.text.starts_with("%YAML:") ? file.text.find('\n') : 0;
  TRUETRIAD_ASSIGN_OR_RETURN(YamlReader root,
                             YamlReader::FromText(file.text.substr(begin), file.suffix));
  const bool is_input = chain.has_blocks && root.Child("rostopic");
  YamlReader imu = is_input ? root.Child("imu0") : FirstImu(&root);
  std::string model;
  if (chain.has_blocks && imu && imu.Require("model", &model) && model != chain.model) {
    imu.Child("model").Fail("`" + model + "` has no matrices; expected `" +
                            std::string(chain.model) + "`");
  }
  Carried carried;
  for (const Triad triad : kInertial) {
    YamlReader block =
        imu && chain.has_blocks ? imu.RequireChild(std::string(TriadName(triad)) + "s") : imu;
    Stated stated;
    if (block) stated = ReadFields(block, ChainFieldsOf(triad, chain), /*in_rows=*/true);
    TRUETRIAD_RETURN_IF_ERROR(root.status());
    CorrectionParts& parts = carried.parts[triad].emplace(CorrectionParts::Of(stated));
    if (!parts.matrix.allFinite())
      return Error(ErrorCode::kSingularMatrix, {file.suffix}, "a matrix of the IMU is singular");
    parts.before = BiasFromComment(file.text, triad, &carried);
    if (parts.g_sensitivity && parts.g_sensitivity->isZero(0.0)) parts.g_sensitivity.reset();
  }
  if (is_input) carried.notes = {"Kalibr's input holds only noise: readings are not corrected"};
  return carried;
}

}  // namespace

std::vector<Format> KalibrFormats() {
  constexpr TriadCapacity kAcceleration = {.held = true, .reading_unit = "m/s^2"};
  constexpr TriadCapacity kRate = {.held = true, .g_sensitivity = true, .reading_unit = "rad/s"};
  const auto as_read = [](std::string_view unit) -> TriadCapacity {
    return {.held = true, .matrix = MatrixForm::kNothing, .reading_unit = unit};
  };
  return {{.info = {"kalibr",
                    "Kalibr imu.yaml, for --imu: noise alone",
                    "imu.yaml",
                    Arithmetic::kFloat64,
                    true},
           .capacity = {{as_read("m/s^2"), as_read("rad/s"), {}}},
           .write = WriteKalibr,
           .read = std::bind_front(ReadChain, std::cref(kKalibr))},
          {.info = {"kalibr-result",
                    "Kalibr's result, scale-misalignment",
                    "kalibr-imu.yaml",
                    Arithmetic::kFloat64,
                    true},
           .gauge = Gauge::kAccelX,
           .capacity = {{kAcceleration, kRate, {}}},
           .write = std::bind_front(WriteChain, std::cref(kKalibr)),
           .read = std::bind_front(ReadChain, std::cref(kKalibr))},
          {.info = {"openvins",
                    "OpenVINS kalibr_imu_chain.yaml",
                    "kalibr_imu_chain.yaml",
                    Arithmetic::kFloat64},
           .gauge = Gauge::kAccelX,
           .capacity = {{kAcceleration, kRate, {}}},
           .write = std::bind_front(WriteChain, std::cref(kOpenVins)),
           .read = std::bind_front(ReadChain, std::cref(kOpenVins))}};
}

}  // namespace truetriad
