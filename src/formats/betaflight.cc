// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <map>

#include "formats/format.h"
#include "formats/text.h"

// Command lines of Betaflight and INAV; whole numbers in counts.
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
// The settings of INAV that mean a gain of 1, and the largest allowed setting (settings.yaml).
constexpr double kAccGainUnity = 4096.0, kMagGainUnity = 1024.0;
constexpr int kMaxGain = 8192;  // Twice the 4096 that means 1.
constexpr std::array<Triad, 2> kHeld = {Triad::kAccelerometer, Triad::kMagnetometer};

/// Rounds to a whole number, halves away from zero. Error: the result is outside low to high.
Result<int> Whole(const std::string& what, double value, int low, int high) {
  const double rounded = std::round(value);
  if (!(rounded >= low && rounded <= high)) {
    return Error(ErrorCode::kNotRepresentable,
                 what + " would be " + RoundedText(value, 6) + ", outside " + std::to_string(low) +
                     " to " + std::to_string(high));
  }
  return static_cast<int>(rounded);
}

/// A setting of a sensor, in the order of writing. `unity`: the value of an INAV gain that means 1.
struct Setting {
  std::string_view name;  ///< `*` stands for the axis; without it, one setting holds all three.
  Quantity quantity;
  double unity = 1.0;
  bool is_inverse = false;
  std::string_view end = {};
};
struct Settings {
  PerTriad<std::vector<Setting>> of;
  std::string_view warning;
};
const Settings& Betaflight() {
  // The trailing 1 marks the calibration as done.
  static const auto& settings = *new Settings{
      {{{{{"acc_calibration", Quantity::kBias, 1.0, false, ",1"}},
         {},
         {{"mag_calibration", Quantity::kBias}}}}},
      "Betaflight subtracts offsets after aligning the sensors to the board, so these offsets are "
      "valid only for aligned readings, as in Betaflight's own log"};
  return settings;
}
const Settings& Inav() {
  static const auto& settings = *new Settings{
      {{{{{"acczero_*", Quantity::kBias}, {"accgain_*", Quantity::kDiagonal, kAccGainUnity}},
         {},
         {{"magzero_*", Quantity::kBias},
          {"maggain_*", Quantity::kDiagonal, kMagGainUnity, /*is_inverse=*/true}}}}},
      "INAV corrects before aligning the sensors to the board, so these values are valid only "
      "for readings in the chip's own axes"};
  return settings;
}

/// The name of the setting with the letter of the axis in place of `*`: "acczero_x".
std::string SettingName(const Setting& setting, Eigen::Index axis) {
  std::string name(setting.name);
  if (const std::size_t star = name.find('*'); star != std::string::npos)
    name[star] = AxisLetter(axis);
  return name;
}

Result<Files> WriteSettings(const Settings& settings, const WriteRequest& request) {
  std::string text = CommentText("# ", request.comment);
  for (const Triad triad : kHeld) {
    const std::optional<TriadCalibration>& sensor = request.calibration.sensors[triad];
    if (!sensor) continue;
    for (const Setting& setting : settings.of[triad]) {
      const bool is_offset = setting.quantity == Quantity::kBias;
      const bool is_list = setting.name.find('*') == std::string_view::npos;
      const Eigen::VectorXd values = ValueOf(setting.quantity, *sensor);
      for (Eigen::Index axis = 0; axis < 3; ++axis) {
        TRUETRIAD_ASSIGN_OR_RETURN(
            const int whole,
            Whole("the " + std::string(TriadName(triad)) + (is_offset ? "'s offset" : "'s gain"),
                  setting.is_inverse ? setting.unity / values[axis] : setting.unity * values[axis],
                  is_offset ? std::numeric_limits<std::int16_t>::min() : 1,
                  is_offset ? std::numeric_limits<std::int16_t>::max() : kMaxGain));
        const bool begins = !is_list || axis == 0;
        text += begins ? std::string(kSet) + SettingName(setting, axis) + " = " : std::string(",");
        text += std::to_string(whole);
        if (!is_list || axis == 2) text.append(setting.end) += '\n';
      }
    }
  }
  request.warnings.emplace_back(settings.warning);
  return Files{{"", text + "save\n"}};
}

/// The numbers of each setting, from its line `set name = n,n,n`.
Result<std::map<std::string, std::vector<int>>> StoredSettings(const ExportedFile& file) {
  std::map<std::string, std::vector<int>> settings;
  for (const auto& [place, line, words] : WordLines(file)) {
    if (!line.starts_with(kSet) || words.size() < 3 || words[2] != "=") continue;
    for (std::size_t i = 3; i < words.size(); ++i) {
      const std::optional<int> value = ParseNumber<int>(words[i]);
      if (!value) {
        return Error(
            ErrorCode::kUnreadableNumber, place, "`" + words[i] + "` is not a whole number");
      }
      settings[words[1]].push_back(*value);
    }
  }
  return settings;
}

Result<Carried> ReadSettings(const Settings& settings, const ReadRequest& request) {
  TRUETRIAD_ASSIGN_OR_RETURN(const auto stored, StoredSettings(request.files[0]));
  Carried carried;
  for (const Triad triad : kHeld) {
    Stated stated;
    for (const Setting& setting : settings.of[triad]) {
      Eigen::Vector3d values;
      bool whole = true;
      for (Eigen::Index axis = 0; axis < 3 && whole; ++axis) {
        const std::string name = SettingName(setting, axis);
        const std::size_t place = name == setting.name ? static_cast<std::size_t>(axis) : 0;
        const auto found = stored.find(name);
        whole = found != stored.end() && place < found->second.size();
        if (!whole) break;
        const double number = found->second[place];
        values[axis] = setting.is_inverse ? setting.unity / number : number / setting.unity;
      }
      if (whole) stated[setting.quantity] = values;
    }
    if (stated.size() == settings.of[triad].size())
      carried.parts[triad] = CorrectionParts::Of(stated);
  }
  return carried;
}

}  // namespace

std::vector<Format> CountsFormats() {
  const auto held = [](MatrixForm matrix) -> PerTriad<TriadCapacity> {
    const TriadCapacity counts = {
        .held = true, .matrix = matrix, .reading_unit = "counts", .result_in_reading_unit = true};
    return {{counts, {}, counts}};
  };
  return {
      {.info = {"betaflight",
                "Betaflight command line, offsets only",
                "betaflight.txt",
                Arithmetic::kIntegers},
       .capacity = held(MatrixForm::kNone),
       .write = std::bind_front(WriteSettings, std::cref(Betaflight())),
       .read = std::bind_front(ReadSettings, std::cref(Betaflight()))},
      {.info = {"inav", "INAV command line, offsets and gains", "inav.txt", Arithmetic::kIntegers},
       .capacity = held(MatrixForm::kDiagonal),
       .write = std::bind_front(WriteSettings, std::cref(Inav())),
       .read = std::bind_front(ReadSettings, std::cref(Inav()))}};
}

}  // namespace truetriad
