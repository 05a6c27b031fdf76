// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "truetriad/allan/allan.h"
#include "truetriad/base/result.h"
#include "truetriad/base/triad.h"
#include "truetriad/formats/laboratory.h"
#include "truetriad/model/calibration.h"

namespace truetriad {

/// The numbers that a consumer computes with.
enum class Arithmetic { kFloat32, kFloat64, kIntegers };

/// A parameter file that other programs read.
struct FormatInfo {
  std::string_view name;         ///< "px4", as in --to.
  std::string_view description;  ///< "PX4 parameters (QGroundControl .params)".
  std::string_view file_name;    ///< What such a file is called where nobody says: "px4.params".
  Arithmetic arithmetic = Arithmetic::kFloat64;
  bool can_import = false;
  /// What the first of several equal sensors is called, where one file holds them all.
  std::optional<int> first_instance = {};
};

/// All formats, in the order of the documentation.
std::vector<FormatInfo> Formats();

/// Error (usage): no such format; says which is nearest.
Result<FormatInfo> InfoOfFormat(std::string_view name);

struct ExportOptions {
  /// The program that exports, for the comment: "0.1.0".
  std::string software_version = {};
  /// Name that the file will have: whether MATLAB gets a script (.m) or a .mat.
  std::string file_name = {};
  /// Where a temperature-dependent calibration is evaluated for a format that holds constants only,
  /// degC; unset: at the calibration's reference. Range: inside the calibrated one.
  std::optional<double> temperature_degc = {};
  /// Refuse when some reading would be off by more than this share of the signal. Range: >= 0.
  std::optional<double> max_loss = {};
  /// Units of the readings that the consumer is fed, for formats that leave them open.
  PerTriad<std::optional<std::string>> units = {};
  /// Which of several equal sensors, as the consumer numbers them; unset: `slots`.
  std::optional<int> instance = {};
  /// The consumer's identification of the sensor, for formats that have one; unset: that of the
  /// calibration.
  PerTriad<std::optional<std::int64_t>> device_ids = {};
  /// Where a consumer with several sets of parameters holds those of the sensor with this number,
  /// and its temperature terms (Tags); unset: those of the calibration, else its first.
  PerTriad<std::optional<std::int64_t>> slots = {}, thermal_slots = {};
  /// Which of its temperature terms it does not use, as of Tags; those of other sensors must not
  /// come into use with those of this.
  PerTriad<std::vector<std::int64_t>> idle_thermal_slots = {};
  /// Noise densities and rates for formats that hold them.
  std::optional<AllanResult> allan = {};
  /// What else the files say at their beginning, a line each.
  std::vector<std::string> further_comment = {};
  /// A unit that may not leave is exported, and the files say so.
  bool allows_outside_limits = false;
  /// Who calibrated with what, for the calibration record.
  std::optional<Laboratory> laboratory = {};
};

/// How far the consumer's result is from C(T) (y - b(T)) over a sphere of inputs and the calibrated
/// temperatures, in the consumer's arithmetic, true unit.
struct ExportLoss {
  double signal = 0.0;   ///< Radius of the sphere.
  double largest = 0.0;  ///< Largest length of the difference.
  double rms = 0.0;
  /// Largest ratio of the difference to the σ with which the calibration predicts that reading;
  /// unset when the calibration states none.
  std::optional<double> in_sigmas;
  /// The same while the temperature changes as fast as in the calibration's sweep, up and down and
  /// long enough for its lags to settle; set where the format holds no terms in the rate, and the
  /// calibration states the rates. Largest, RMS.
  struct AtRates {
    Eigen::Vector2d range_degcps = Eigen::Vector2d::Zero();
    double largest = 0.0;
    double rms = 0.0;
  };
  std::optional<AtRates> at_rates;

  double share() const { return largest / signal; }
};

/// A file of an export; `suffix` is appended to the name that the user gave.
struct ExportedFile {
  std::string suffix;
  std::string text;
};

struct Export {
  std::vector<ExportedFile> files = {};
  PerTriad<std::optional<ExportLoss>> loss = {};
  std::vector<std::string> notes = {};  ///< What the format cannot hold, and what its user must do.
  std::vector<std::string> warnings = {};  ///< What makes the result worse than the calibration.
  Findings findings = {};                  ///< As these, what is wrong with a sensor.
  PerTriad<bool> is_turned = {};           ///< Against the others, or swapped.
};

/// The result of some of a device's sensors, and the folder that it is in.
struct ResultOfInstance {
  const Calibration* calibration = nullptr;
  std::string folder;
  int instance = 0;  ///< Which of several equal sensors they are, from 0.
};

/// Texts by the paths of their files.
struct ExportsBeside {
  std::map<std::string, std::string> files;
  std::vector<std::string> warnings;  ///< As of Export.
  Findings findings;                  ///< As well; the value "instance" says whose.
  bool is_whole = true;               ///< No format has left out a usable result.
};

/// What `formats` hold of the usable ones of a device's results: beside each, or, where a format
/// numbers equal sensors, in one file beside the first. One that does not fit a format is left out
/// of it, with a warning. Errors: as ExportCalibration.
Result<ExportsBeside> ExportBeside(const std::vector<ResultOfInstance>& results,
                                   const std::vector<std::string>& formats,
                                   ExportOptions options);

/// Whether a file is an export, whatever it is called, of the unit of this serial number, where one
/// is stated, or of a unit without any. Error (bad input): it cannot be read.
Result<bool> IsExport(const std::filesystem::path& path,
                      const std::optional<std::string>& serial = std::nullopt);

/// Renames what was exported into `folder`, and into its instance-N, under whatever name, to
/// NAME.withdrawn (NAME.withdrawn-2 where there is one), unless a file of `written` is to take its
/// place; gives the names. For a folder whose result changes, or
/// may no longer leave. Errors (bad input): a folder cannot be listed, a file cannot be renamed.
Result<std::vector<std::string>> WithdrawExports(
    const std::string& folder, const std::map<std::string, std::string>& written = {});

/// `calibration` as the text of `format`, read back and compared. Errors: no such format, an option
/// it does not have (usage); a calibration that is not usable, may not leave (kOutsideLimits) or
/// does not fit the format, a loss above options.max_loss (bad input).
Result<Export> ExportCalibration(const Calibration& calibration,
                                 std::string_view format,
                                 const ExportOptions& options = {});

/// The noise of `options.allan` alone as the text of `format`, of sensors that nobody calibrated:
/// bias zero, gains one. Errors: as above; no noise.
Result<Export> ExportNoise(std::string_view format, const ExportOptions& options);

}  // namespace truetriad
