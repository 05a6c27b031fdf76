// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <map>
#include <sstream>

#include "formats/format.h"
#include "formats/number_text.h"

// Betaflight's and INAV's command lines; whole numbers in counts.
//
//   Betaflight  accelerometer, magnetometer   align(y) - zero
//   INAV        accelerometer                 (y - acczero) accgain / 4096
//               magnetometer                  (y - magzero) 1024 / maggain
//
// betaflight: src/main/sensors/{acceleration,compass}.c, src/main/cli/settings.c;
// inav: src/main/sensors/{acceleration,compass}.c.

namespace truetriad {
namespace {

constexpr std::string_view kSet = "set ";
// INAV: gains are shares of 4096 and of 1024; 8192 is the end of the setting's range
// (settings.yaml).
constexpr double kAccGainUnity = 4096.0;
constexpr double kMagGainUnity = 1024.0;
constexpr int kMaxGain = 8192;
constexpr std::array<Triad, 2> kHeld = {Triad::kAccelerometer, Triad::kMagnetometer};

/// Half away from zero.
Result<int> Whole(const std::string& what, double value, int low, int high) {
  const double rounded = std::round(value);
  if (!(rounded >= low && rounded <= high)) {
    return Error(ErrorCode::kNotRepresentable,
                 what + " would be " + RoundedText(value, 6) + ", outside " + std::to_string(low) +
                     " to " + std::to_string(high));
  }
  return static_cast<int>(rounded);
}

Result<std::array<int, 3>> WholeOffsets(Triad triad, const TriadCalibration& sensor) {
  std::array<int, 3> offsets{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    TRUETRIAD_ASSIGN_OR_RETURN(const int offset,
                               Whole("the " + std::string(TriadName(triad)) + "'s offset",
                                     sensor.model.bias[static_cast<Eigen::Index>(axis)],
                                     std::numeric_limits<std::int16_t>::min(),
                                     std::numeric_limits<std::int16_t>::max()));
    offsets[axis] = offset;
  }
  return offsets;
}

Result<std::vector<ExportedFile>> WriteBetaflight(const WriteRequest& request,
                                                  std::vector<std::string>* warnings) {
  std::string text = CommentText("# ", request.comment);
  for (const Triad triad : kHeld) {
    const std::optional<TriadCalibration>& sensor = request.calibration.sensors[triad];
    if (!sensor) continue;
    TRUETRIAD_ASSIGN_OR_RETURN(const auto zero, WholeOffsets(triad, *sensor));
    const bool is_acc = triad == Triad::kAccelerometer;
    text += std::string(kSet) + (is_acc ? "acc" : "mag") +
            "_calibration = " + std::to_string(zero[0]) + "," + std::to_string(zero[1]) + "," +
            std::to_string(zero[2]) + (is_acc ? ",1\n" : "\n");
  }
  warnings->emplace_back(
      "Betaflight subtracts offsets after aligning the sensors to the board, so these are valid "
      "only for readings recorded that way, as in its own log");
  return std::vector<ExportedFile>{{"", text + "save\n"}};
}

Result<std::vector<ExportedFile>> WriteInav(const WriteRequest& request,
                                            std::vector<std::string>* warnings) {
  std::string text = CommentText("# ", request.comment);
  for (const Triad triad : kHeld) {
    const std::optional<TriadCalibration>& sensor = request.calibration.sensors[triad];
    if (!sensor) continue;
    TRUETRIAD_ASSIGN_OR_RETURN(const auto zero, WholeOffsets(triad, *sensor));
    const bool is_acc = triad == Triad::kAccelerometer;
    const std::string name = is_acc ? "acc" : "mag";
    const Eigen::Vector3d C = sensor->model.Correction().diagonal();
    for (std::size_t axis = 0; axis < 3; ++axis) {
      text += std::string(kSet) + name + "zero_" + AxisLetter(axis) + " = " +
              std::to_string(zero[axis]) + "\n";
    }
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      TRUETRIAD_ASSIGN_OR_RETURN(const int gain,
                                 Whole("the " + std::string(TriadName(triad)) + "'s gain",
                                       is_acc ? kAccGainUnity * C[axis] : kMagGainUnity / C[axis],
                                       1,
                                       kMaxGain));
      text += std::string(kSet) + name + "gain_" + AxisLetter(axis) + " = " + std::to_string(gain) +
              "\n";
    }
  }
  warnings->emplace_back(
      "INAV corrects before aligning the sensors to the board, so these are valid only for "
      "readings in the chip's own axes");
  return std::vector<ExportedFile>{{"", text + "save\n"}};
}

/// The numbers of each `set name = n,n,n`.
Result<std::map<std::string, std::vector<int>>> Settings(const ExportedFile& file) {
  std::map<std::string, std::vector<int>> settings;
  std::istringstream lines(file.text);
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    if (!line.starts_with(kSet)) continue;
    const std::size_t equals = line.find(" = ");
    if (equals == std::string::npos) continue;
    std::vector<int>& values = settings[line.substr(kSet.size(), equals - kSet.size())];
    std::istringstream items(line.substr(equals + 3));
    for (std::string item; std::getline(items, item, ',');) {
      int value = 0;
      const auto [end, failure] = std::from_chars(item.data(), item.data() + item.size(), value);
      if (failure != std::errc() || end != item.data() + item.size()) {
        return Error(ErrorCode::kUnreadableNumber,
                     {file.suffix, number},
                     "`" + item + "` is not a whole number");
      }
      values.push_back(value);
    }
  }
  return settings;
}

Equation GainedEquation(const Eigen::Vector3d& zero, const Eigen::Vector3d& gain) {
  return [=](const Eigen::Vector3d& reading,
             const Eigen::Vector3d& /*force_mps2*/,
             double /*temperature_degc*/) -> Eigen::Vector3d {
    return (reading - zero).cwiseProduct(gain);
  };
}

Result<Carried> ReadBetaflight(const ReadRequest& request) {
  TRUETRIAD_ASSIGN_OR_RETURN(const auto settings, Settings(request.files[0]));
  Carried carried;
  for (const Triad triad : kHeld) {
    const auto found =
        settings.find(triad == Triad::kAccelerometer ? "acc_calibration" : "mag_calibration");
    if (found == settings.end() || found->second.size() < 3) continue;
    const std::vector<int>& zero = found->second;
    carried.equations[triad] = GainedEquation(
        Eigen::Vector3i(zero[0], zero[1], zero[2]).cast<double>(), Eigen::Vector3d::Ones());
  }
  return carried;
}

Result<Carried> ReadInav(const ReadRequest& request) {
  TRUETRIAD_ASSIGN_OR_RETURN(const auto settings, Settings(request.files[0]));
  Carried carried;
  for (const Triad triad : kHeld) {
    const bool is_acc = triad == Triad::kAccelerometer;
    const std::string name = is_acc ? "acc" : "mag";
    Eigen::Vector3d zero, gain;
    bool whole = true;
    for (int axis = 0; axis < 3; ++axis) {
      const auto found_zero = settings.find(name + "zero_" + AxisLetter(axis));
      const auto found_gain = settings.find(name + "gain_" + AxisLetter(axis));
      whole = whole && found_zero != settings.end() && found_zero->second.size() == 1 &&
              found_gain != settings.end() && found_gain->second.size() == 1;
      if (!whole) break;
      zero[axis] = found_zero->second[0];
      const double number = found_gain->second[0];
      gain[axis] = is_acc ? number / kAccGainUnity : kMagGainUnity / number;
    }
    if (whole) carried.equations[triad] = GainedEquation(zero, gain);
  }
  return carried;
}

Format CountsFormat(MatrixForm form) {
  Format format;
  for (const Triad triad : kHeld) {
    format.capacity[triad] = {
        .held = true, .matrix = form, .reading_unit = "counts", .result_in_reading_unit = true};
  }
  return format;
}

}  // namespace

Format BetaflightFormat() {
  Format format = CountsFormat(MatrixForm::kNone);
  format.info = {"betaflight",
                 "Betaflight command line, offsets only",
                 "betaflight.txt",
                 Arithmetic::kIntegers};
  format.write = WriteBetaflight;
  format.read = ReadBetaflight;
  return format;
}

Format InavFormat() {
  Format format = CountsFormat(MatrixForm::kDiagonal);
  format.info = {"inav", "INAV command line, offsets and gains", "inav.txt", Arithmetic::kIntegers};
  format.write = WriteInav;
  format.read = ReadInav;
  return format;
}

}  // namespace truetriad
