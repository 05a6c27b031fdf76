// SPDX-License-Identifier: Apache-2.0
#include <charconv>
#include <sstream>

#include <Eigen/LU>

#include "formats/format.h"
#include "formats/list_text.h"
#include "formats/noise.h"
#include "formats/number_text.h"
#include "math/dense/qr.h"

// Kalibr's input, which is noise alone, its result with the scale-misalignment model, and OpenVINS'
// kalibr_imu_chain.yaml, in double:
//
//   Kalibr     y_a = M_a f + b_a,   y_g = M_g C_gi w + A C_gi f + b_g
//   OpenVINS   f = Ta^-1 (y_a - b_a),   w = R_IMUtoGYRO^T Tw^-1 (y_g - b_g - Tg f)
//
// M_a, M_g, Ta, Tw lower triangular, C_gi = R_IMUtoGYRO a rotation, A C_gi = Tg = G. Biases are
// states of both programs and no part of the file: they stand in a comment.
// kalibr: aslam_offline_calibration/kalibr/python/kalibr_imu_camera_calibration/IccSensors.py
// (IccScaledMisalignedImu), kalibr_common/ConfigReader.py (ImuParameters: six keys, each above
// zero); open_vins: ov_msckf/src/core/VioManagerOptions.h, src/state/Propagator.cpp.

namespace truetriad {
namespace {

constexpr std::string_view kBiasComment = "# bias ";

/// S = M C, M lower triangular with positive diagonal, C a rotation.
struct LowerTimesRotation {
  Eigen::Matrix3d M = Eigen::Matrix3d::Identity();
  Eigen::Matrix3d C = Eigen::Matrix3d::Identity();
};

LowerTimesRotation Split(const Eigen::Matrix3d& sensitivity) {
  // S^T = Q R, so S = R^T Q^T.
  const auto [Q, R] = QrOf3(sensitivity.transpose());
  const Eigen::Vector3d signs =
      R.diagonal().unaryExpr([](double d) { return d < 0.0 ? -1.0 : 1.0; });
  return {R.transpose() * signs.asDiagonal(), signs.asDiagonal() * Q.transpose()};
}

/// The matrices of both programs.
struct Chain {
  Eigen::Matrix3d M_a = Eigen::Matrix3d::Identity();
  LowerTimesRotation gyroscope;
  Eigen::Matrix3d G = Eigen::Matrix3d::Zero();
};

Result<Chain> ChainOf(const Calibration& calibration) {
  Chain chain;
  if (const auto& sensor = calibration.sensors[Triad::kAccelerometer]) {
    chain.M_a = sensor->model.sensitivity;
  }
  if (const auto& sensor = calibration.sensors[Triad::kGyroscope]) {
    if (sensor->model.sensitivity.determinant() < 0.0) {
      return Error(
          ErrorCode::kNotRepresentable,
          "the gyroscope is mirrored (the determinant of its sensitivity is negative), which a "
          "rotation and positive gains cannot express; reverse one axis of its readings and "
          "calibrate again");
    }
    chain.gyroscope = Split(sensor->model.sensitivity);
    if (sensor->g_sensitivity) chain.G = *sensor->g_sensitivity;
  }
  return chain;
}

std::string BiasComments(const Calibration& calibration) {
  std::string text;
  for (const Triad triad : {Triad::kAccelerometer, Triad::kGyroscope}) {
    const auto& sensor = calibration.sensors[triad];
    if (!sensor) continue;
    text.append(kBiasComment).append(TriadName(triad)).append(" ");
    text.append(sensor->input_unit).append(": ").append(ListText(sensor->model.bias)).append("\n");
  }
  return text;
}

/// Python's YAML takes 2e-05 for a word, and 2.0e-05 for a number.
std::string RealText(double value) {
  std::string text = NumberText(value);
  const std::size_t exponent = text.find('e');
  if (exponent != std::string::npos && text.find('.') == std::string::npos) {
    text.insert(exponent, ".0");
  }
  return text;
}

/// Noise keys, or what to fill in. A rest that is too short for a random walk still tells the
/// density.
Result<std::string> NoiseText(const std::string& indent,
                              const ExportOptions& options,
                              std::vector<std::string>* warnings) {
  std::string text;
  double rate_hz = 0.0;
  for (const Triad triad : {Triad::kAccelerometer, Triad::kGyroscope}) {
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
    warnings->emplace_back(
        name + (!options.allan ? ": its noise densities are missing; give --allan=FILE, or fill "
                                 "them in"
                : noise ? ": the Allan file does not tell the random walk of every axis (a longer "
                          "rest may); fill it in"
                        : ": the Allan file does not tell white noise of every axis (a longer rest "
                          "may); fill the densities in"));
  }
  if (!(rate_hz > 0.0)) {
    warnings->emplace_back("update_rate is missing; give --allan=FILE, or fill it in");
  }
  text += indent +
          (rate_hz > 0.0 ? "update_rate: " + RealText(rate_hz) + "\n" : "# update_rate: ?  # Hz\n");
  return text;
}

// These files state both sensors.
void WarnOfMissing(const Calibration& calibration, std::vector<std::string>* warnings) {
  for (const Triad triad : {Triad::kAccelerometer, Triad::kGyroscope}) {
    if (calibration.sensors[triad]) continue;
    warnings->emplace_back(std::string(TriadName(triad)) +
                           ": not calibrated; the file, which must state it, holds the identity");
  }
}

constexpr std::string_view kBody =
    "  T_i_b: [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]\n"
    "  time_offset: 0.0\n"
    "  rostopic: /imu0\n";

Result<std::vector<ExportedFile>> WriteKalibr(const WriteRequest& request,
                                              std::vector<std::string>* warnings) {
  TRUETRIAD_ASSIGN_OR_RETURN(const std::string noise, NoiseText("", request.options, warnings));
  return std::vector<ExportedFile>{
      {"", CommentText("# ", request.comment) + "rostopic: /imu0\n" + noise}};
}

Result<std::vector<ExportedFile>> WriteKalibrResult(const WriteRequest& request,
                                                    std::vector<std::string>* warnings) {
  TRUETRIAD_ASSIGN_OR_RETURN(const Chain chain, ChainOf(request.calibration));
  WarnOfMissing(request.calibration, warnings);
  TRUETRIAD_ASSIGN_OR_RETURN(const std::string noise, NoiseText("  ", request.options, warnings));
  const Eigen::Matrix3d A = chain.G * chain.gyroscope.C.transpose();
  std::string text = CommentText("# ", request.comment) + BiasComments(request.calibration) +
                     "imu0:\n  model: scale-misalignment\n" + std::string(kBody) + noise +
                     "  accelerometers:\n    M: " + RowsText(chain.M_a) +
                     "\n  gyroscopes:\n    M: " + RowsText(chain.gyroscope.M) +
                     "\n    A: " + RowsText(A) + "\n    C_gyro_i: " + RowsText(chain.gyroscope.C) +
                     "\n";
  return std::vector<ExportedFile>{{"", std::move(text)}};
}

Result<std::vector<ExportedFile>> WriteOpenVins(const WriteRequest& request,
                                                std::vector<std::string>* warnings) {
  TRUETRIAD_ASSIGN_OR_RETURN(const Chain chain, ChainOf(request.calibration));
  WarnOfMissing(request.calibration, warnings);
  TRUETRIAD_ASSIGN_OR_RETURN(const std::string noise, NoiseText("  ", request.options, warnings));
  std::string text = "%YAML:1.0\n\n" + CommentText("# ", request.comment) +
                     BiasComments(request.calibration) + "imu0:\n  model: \"kalibr\"\n" +
                     std::string(kBody) + noise + "  Tw: " + RowsText(chain.gyroscope.M) +
                     "\n  R_IMUtoGYRO: " + RowsText(chain.gyroscope.C) +
                     "\n  Ta: " + RowsText(chain.M_a) +
                     "\n  R_IMUtoACC: " + RowsText(Eigen::Matrix3d::Identity().eval()) +
                     "\n  Tg: " + RowsText(chain.G) + "\n";
  return std::vector<ExportedFile>{{"", std::move(text)}};
}

/// The biases of the comment; zero, and a note, where there is none.
Eigen::Vector3d BiasFromComment(const std::string& text, Triad triad, Carried* carried) {
  const std::string begin = std::string(kBiasComment) + std::string(TriadName(triad)) + " ";
  Eigen::Vector3d bias = Eigen::Vector3d::Zero();
  const std::size_t at = text.find(begin);
  const std::size_t list = at == std::string::npos ? at : text.find('[', at);
  int read = 0;
  if (list != std::string::npos) {
    const char* from = text.data() + list + 1;
    const char* const end = text.data() + text.size();
    for (; read < 3; ++read) {
      const auto [next, failure] = std::from_chars(from, end, bias[read]);
      if (failure != std::errc()) break;
      for (from = next; from != end && (*from == ',' || *from == ' ');) ++from;
    }
  }
  if (read < 3) {
    bias.setZero();
    carried->notes.emplace_back(std::string(TriadName(triad)) +
                                ": the file contains no bias; assumed zero");
  }
  return bias;
}

Carried CarriedChain(const Chain& chain, const std::string& text) {
  Carried carried;
  const Eigen::Matrix3d S_g = chain.gyroscope.M * chain.gyroscope.C;
  for (const Triad triad : {Triad::kAccelerometer, Triad::kGyroscope}) {
    TriadCalibration& sensor = carried.sensors[triad].emplace();
    sensor.input_unit = sensor.output_unit = TruthUnitName(triad);
    sensor.noise.source = NoiseSource::kConfig;
    sensor.model.bias = BiasFromComment(text, triad, &carried);
    sensor.model.sensitivity = triad == Triad::kAccelerometer ? chain.M_a : S_g;
    if (triad == Triad::kGyroscope && !chain.G.isZero(0.0)) sensor.g_sensitivity = chain.G;
  }
  const Eigen::Vector3d b_a = carried.sensors[Triad::kAccelerometer]->model.bias;
  const Eigen::Vector3d b_g = carried.sensors[Triad::kGyroscope]->model.bias;
  carried.equations[Triad::kAccelerometer] = [=](const Eigen::Vector3d& reading,
                                                 const Eigen::Vector3d& /*force_mps2*/,
                                                 double /*temperature_degc*/) -> Eigen::Vector3d {
    return chain.M_a.inverse() * (reading - b_a);
  };
  carried.equations[Triad::kGyroscope] = [=](const Eigen::Vector3d& reading,
                                             const Eigen::Vector3d& force_mps2,
                                             double /*temperature_degc*/) -> Eigen::Vector3d {
    return chain.gyroscope.C.transpose() *
           (chain.gyroscope.M.inverse() * (reading - b_g - chain.G * force_mps2));
  };
  return carried;
}

/// The block of the first IMU.
YamlReader FirstImu(YamlReader* root) {
  for (const std::string& key : root->Keys()) {
    if (key.starts_with("imu")) return root->Child(key);
  }
  return root->RequireChild("imu0");
}

Status CheckRegular(const Chain& chain, const ExportedFile& file) {
  if (chain.M_a.determinant() != 0.0 && chain.gyroscope.M.determinant() != 0.0) return {};
  return Error(ErrorCode::kSingularMatrix, {file.suffix}, "a matrix of the IMU is singular");
}

/// Its input, which is not corrected, or its result.
Result<Carried> ReadKalibr(const ReadRequest& request) {
  const ExportedFile& file = request.files[0];
  TRUETRIAD_ASSIGN_OR_RETURN(YamlReader root, YamlReader::FromText(file.text, file.suffix));
  Chain chain;
  if (root.Child("rostopic")) {
    Carried carried = CarriedChain(chain, file.text);
    carried.notes = {"Kalibr's input holds noise alone: readings are taken as they are"};
    return carried;
  }
  if (YamlReader imu = FirstImu(&root)) {
    std::string model;
    if (imu.Require("model", &model) && model != "scale-misalignment") {
      imu.Child("model").Fail("`" + model + "` has no matrices; expected `scale-misalignment`");
    }
    if (YamlReader accelerometers = imu.RequireChild("accelerometers")) {
      chain.M_a = ReadRows(accelerometers.RequireChild("M"));
    }
    if (YamlReader gyroscopes = imu.RequireChild("gyroscopes")) {
      chain.gyroscope.M = ReadRows(gyroscopes.RequireChild("M"));
      chain.gyroscope.C = ReadRows(gyroscopes.RequireChild("C_gyro_i"));
      chain.G = ReadRows(gyroscopes.RequireChild("A")) * chain.gyroscope.C;
    }
  }
  TRUETRIAD_RETURN_IF_ERROR(root.status());
  TRUETRIAD_RETURN_IF_ERROR(CheckRegular(chain, file));
  return CarriedChain(chain, file.text);
}

Result<Carried> ReadOpenVins(const ReadRequest& request) {
  const ExportedFile& file = request.files[0];
  // OpenCV's first line is not YAML.
  const std::size_t begin = file.text.starts_with("%YAML:") ? file.text.find('\n') : 0;
  TRUETRIAD_ASSIGN_OR_RETURN(YamlReader root,
                             YamlReader::FromText(file.text.substr(begin), file.suffix));
  Chain chain;
  if (YamlReader imu = FirstImu(&root)) {
    chain.M_a = ReadRows(imu.RequireChild("Ta"));
    chain.gyroscope.M = ReadRows(imu.RequireChild("Tw"));
    chain.gyroscope.C = ReadRows(imu.RequireChild("R_IMUtoGYRO"));
    chain.G = ReadRows(imu.RequireChild("Tg"));
  }
  TRUETRIAD_RETURN_IF_ERROR(root.status());
  TRUETRIAD_RETURN_IF_ERROR(CheckRegular(chain, file));
  return CarriedChain(chain, file.text);
}

Format ChainFormat() {
  Format format;
  format.gauge = Gauge::kAccelX;
  format.capacity[Triad::kAccelerometer] = {.held = true, .reading_unit = "m/s^2"};
  format.capacity[Triad::kGyroscope] = {
      .held = true, .g_sensitivity = true, .reading_unit = "rad/s"};
  return format;
}

}  // namespace

Format KalibrFormat() {
  Format format = ChainFormat();
  format.gauge.reset();
  format.info = {
      "kalibr", "Kalibr imu.yaml, for --imu: noise alone", "imu.yaml", Arithmetic::kFloat64, true};
  for (const Triad triad : {Triad::kAccelerometer, Triad::kGyroscope}) {
    format.capacity[triad].matrix = MatrixForm::kNothing;
    format.capacity[triad].g_sensitivity = false;
  }
  format.write = WriteKalibr;
  format.read = ReadKalibr;
  return format;
}

Format KalibrResultFormat() {
  Format format = ChainFormat();
  format.info = {"kalibr-result",
                 "Kalibr's result, scale-misalignment",
                 "kalibr-imu.yaml",
                 Arithmetic::kFloat64,
                 true};
  format.write = WriteKalibrResult;
  format.read = ReadKalibr;
  return format;
}

Format OpenVinsFormat() {
  Format format = ChainFormat();
  format.info = {
      "openvins", "OpenVINS kalibr_imu_chain.yaml", "kalibr_imu_chain.yaml", Arithmetic::kFloat64};
  format.write = WriteOpenVins;
  format.read = ReadOpenVins;
  return format;
}

}  // namespace truetriad
