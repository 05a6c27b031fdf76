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
constexpr ImuTkFile kImuTkFiles[] = {{Triad::kAccelerometer, "_acc.calib"},
                                     {Triad::kGyroscope, "_gyro.calib"}};

// In their order in a file: T, K, B.
constexpr Quantity kImuTkQuantities[] = {
    Quantity::kMisalignment, Quantity::kGainsMatrix, Quantity::kBias};
constexpr Eigen::Index kImuTkNumbers = 9 + 9 + 3;

Result<std::vector<ExportedFile>> WriteImuTk(const WriteRequest& request,
                                             std::vector<std::string>* /*warnings*/) {
  std::vector<ExportedFile> files;
  for (const ImuTkFile& file : kImuTkFiles) {
    const std::optional<TriadCalibration>& sensor = request.calibration.sensors[file.triad];
    if (!sensor) continue;
    std::string text;
    for (const Quantity quantity : kImuTkQuantities) {
      const Eigen::VectorXd numbers = ValueOf(quantity, *sensor);
      // Rows of a matrix, or a number a line.
      const Eigen::Index columns = numbers.size() / 3;
      for (Eigen::Index i = 0; i < numbers.size(); ++i)
        text += NumberText(numbers[i]) + ((i + 1) % columns == 0 ? '\n' : ' ');
      text += '\n';
    }
    // imu_tk stops reading after the numbers.
    text += CommentText("# ", request.comment);
    files.push_back({std::string(file.suffix), std::move(text)});
  }
  return files;
}

/// The numbers of a file up to its comment.
Result<std::vector<double>> NumbersOfFile(const ExportedFile& file) {
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
  Carried carried;
  for (const ExportedFile& file : request.files) {
    const ImuTkFile* kind = nullptr;
    for (const ImuTkFile& candidate : kImuTkFiles) {
      if (file.suffix.ends_with(candidate.suffix)) kind = &candidate;
    }
    if (kind == nullptr) {
      return Error(ErrorCode::kWrongFormat,
                   {file.suffix},
                   "cannot tell the sensor from the name; expected names ending in "
                   "_acc.calib and _gyro.calib, as written by imu_tk");
    }
    TRUETRIAD_ASSIGN_OR_RETURN(const std::vector<double> numbers, NumbersOfFile(file));
    if (numbers.size() != static_cast<std::size_t>(kImuTkNumbers)) {
      return Error(ErrorCode::kWrongFormat,
                   {file.suffix},
                   "contains " + std::to_string(numbers.size()) +
                       " numbers; expected T (9), K (9) and B (3)");
    }
    const Eigen::Map<const Eigen::VectorXd> all(numbers.data(), kImuTkNumbers);
    Stated stated;
    Eigen::Index at = 0;
    for (const Quantity quantity : kImuTkQuantities) {
      stated[quantity] = all.segment(at, SizeOf(quantity));
      at += SizeOf(quantity);
    }
    CorrectionParts& parts = carried.parts[kind->triad].emplace(CorrectionParts::Of(stated));
    if (parts.matrix.determinant() == 0.0)
      return Error(ErrorCode::kSingularMatrix, {file.suffix}, "T K is singular");
    parts.reading_unit = UnitFromComment(file.text, kind->triad);
    if (parts.matrix.isUpperTriangular(0.0))
      parts.sensitivity = parts.matrix.inverse().triangularView<Eigen::Upper>();
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
