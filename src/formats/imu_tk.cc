// SPDX-License-Identifier: Apache-2.0
#include <charconv>
#include <cmath>
#include <sstream>
#include <vector>

#include <Eigen/LU>

#include "formats/comment.h"
#include "formats/format.h"
#include "formats/number_text.h"

// imu_tk: x = T K (y - B), T with unit diagonal (of the accelerometer: upper triangular), K
// diagonal, in double. One text file a sensor: T by rows, K by rows, B. What follows is not read.
// imu_tk: include/imu_tk/calibration.h (CalibratedTriad_, load, save).

namespace truetriad {
namespace {

struct ImuTkFile {
  Triad triad;
  std::string_view suffix;  // as imu_tk's own programs name them: test_imu_acc.calib
};
constexpr ImuTkFile kFiles[] = {{Triad::kAccelerometer, "_acc.calib"},
                                {Triad::kGyroscope, "_gyro.calib"}};

std::string Rows(const Eigen::Matrix3d& matrix) {
  std::string text;
  for (int row = 0; row < 3; ++row) {
    for (int col = 0; col < 3; ++col) {
      text += (col > 0 ? " " : "") + NumberText(matrix(row, col));
    }
    text += '\n';
  }
  return text;
}

Result<std::vector<ExportedFile>> WriteImuTk(const WriteRequest& request,
                                             std::vector<std::string>* /*warnings*/) {
  std::vector<ExportedFile> files;
  for (const ImuTkFile& file : kFiles) {
    const std::optional<TriadCalibration>& sensor = request.calibration.sensors[file.triad];
    if (!sensor) continue;
    const Eigen::Matrix3d C = sensor->model.Correction();
    const Eigen::Matrix3d K = C.diagonal().asDiagonal();
    Eigen::Matrix3d T = C * K.inverse();
    T.diagonal().setOnes();
    std::string text = Rows(T) + '\n' + Rows(K) + '\n';
    for (const double value : sensor->model.bias) text += NumberText(value) + '\n';
    // imu_tk stops reading after the numbers.
    text += '\n' + CommentText("# ", request.comment);
    files.push_back({std::string(file.suffix), std::move(text)});
  }
  return files;
}

/// The numbers of a file up to its comment.
Result<std::vector<double>> Numbers(const ExportedFile& file) {
  std::vector<double> numbers;
  std::istringstream lines(file.text);
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    line.resize(std::min(line.find('#'), line.size()));
    std::istringstream words(line);
    for (std::string word; words >> word;) {
      double value = 0.0;
      const auto [end, failure] = std::from_chars(word.data(), word.data() + word.size(), value);
      if (failure != std::errc() || end != word.data() + word.size() || !std::isfinite(value)) {
        return Error(
            ErrorCode::kUnreadableNumber, {file.suffix, number}, "`" + word + "` is not a number");
      }
      numbers.push_back(value);
    }
  }
  return numbers;
}

Result<Carried> ReadImuTk(const ReadRequest& request) {
  using RowMajor = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
  constexpr std::size_t kNumbers = 9 + 9 + 3;  // Two matrices and a bias.
  Carried carried;
  for (const ExportedFile& file : request.files) {
    const ImuTkFile* kind = nullptr;
    for (const ImuTkFile& candidate : kFiles) {
      if (file.suffix.ends_with(candidate.suffix)) kind = &candidate;
    }
    if (kind == nullptr) {
      return Error(ErrorCode::kWrongFormat,
                   {file.suffix},
                   "cannot tell the sensor from the name; expected names ending in "
                   "_acc.calib and _gyro.calib, as written by imu_tk");
    }
    TRUETRIAD_ASSIGN_OR_RETURN(const std::vector<double> numbers, Numbers(file));
    if (numbers.size() != kNumbers) {
      return Error(ErrorCode::kWrongFormat,
                   {file.suffix},
                   "contains " + std::to_string(numbers.size()) +
                       " numbers; expected T (9), K (9) and B (3)");
    }
    const Eigen::Matrix3d T = Eigen::Map<const RowMajor>(numbers.data());
    const Eigen::Matrix3d K = Eigen::Map<const RowMajor>(numbers.data() + 9);
    const Eigen::Vector3d B = Eigen::Map<const Eigen::Vector3d>(numbers.data() + 18);
    const Eigen::Matrix3d TK = T * K;
    if (TK.determinant() == 0.0)
      return Error(ErrorCode::kSingularMatrix, {file.suffix}, "T K is singular");
    carried.equations[kind->triad] = [=](const Eigen::Vector3d& reading,
                                         const Eigen::Vector3d& /*force_mps2*/,
                                         double /*temperature_degc*/) -> Eigen::Vector3d {
      return TK * (reading - B);
    };
    TriadCalibration& sensor = carried.sensors[kind->triad].emplace();
    sensor.input_unit = UnitFromComment(file.text, kind->triad);
    sensor.output_unit = TruthUnitName(kind->triad);
    sensor.model = {TK.inverse(), B};
    if (TK.isUpperTriangular(0.0)) {
      sensor.model.sensitivity = sensor.model.sensitivity.triangularView<Eigen::Upper>();
    }
    sensor.noise.source = NoiseSource::kConfig;
  }
  return carried;
}

}  // namespace

Format ImuTkFormat() {
  Format format;
  format.info = {"imu-tk",
                 "imu_tk, one file each for accelerometer and gyroscope",
                 "imu_tk",
                 Arithmetic::kFloat64,
                 true};
  format.gauge = Gauge::kAccelZ;
  for (const Triad triad : {Triad::kAccelerometer, Triad::kGyroscope}) {
    format.capacity[triad] = {.held = true, .matrix = MatrixForm::kFull, .free_unit = true};
  }
  format.write = WriteImuTk;
  format.read = ReadImuTk;
  return format;
}

}  // namespace truetriad
