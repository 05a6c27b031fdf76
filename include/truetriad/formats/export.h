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

/// The arithmetic of a consumer, the program that uses an exported file.
enum class Arithmetic { kFloat32, kFloat64, kIntegers };

/// A kind of parameter file that other programs read.
struct FormatInfo {
  std::string_view name;         ///< "px4", as in --to.
  std::string_view description;  ///< "PX4 parameters (QGroundControl .params)".
  std::string_view file_name;    ///< Default name of such a file: "px4.params".
  Arithmetic arithmetic = Arithmetic::kFloat64;
  bool can_import = false;
  /// The number of the first of several equal sensors, if one file holds them all.
  std::optional<int> first_instance = {};
};

/// All formats, in the order of the documentation.
std::vector<FormatInfo> Formats();

/// Error (usage): no such format; the message names the nearest one.
Result<FormatInfo> InfoOfFormat(std::string_view name);

struct ExportOptions {
  /// The version of the exporting program, for the comment: "0.1.0".
  std::string software_version = {};
  /// The name of the file selects a script (.m) or a .mat for MATLAB.
  std::string file_name = {};
  /// The temperature at which a calibration is evaluated for a format that holds only constants,
  /// degC; unset: the calibration's reference. Range: inside the calibrated range.
  std::optional<double> temperature_degc = {};
  /// Refuse if some reading has an error above this share of the signal. Range: >= 0.
  std::optional<double> max_loss = {};
  /// Units of the readings that the consumer gets, for formats that leave them open.
  PerTriad<std::optional<std::string>> units = {};
  /// The number of one of several equal sensors in the consumer's counting; unset: `slots`.
  std::optional<int> instance = {};
  /// The consumer's identification of the sensor, for formats that have one; unset: that of the
  /// calibration.
  PerTriad<std::optional<std::int64_t>> device_ids = {};
  /// For a consumer with several sets of parameters: the set of the sensor with this number, and
  /// that of its temperature terms (Tags); unset: those of the calibration, else the first.
  PerTriad<std::optional<std::int64_t>> slots = {}, thermal_slots = {};
  /// The sets of temperature terms that the consumer does not use (Tags). Enabling the terms of
  /// this sensor must not enable these sets.
  PerTriad<std::vector<std::int64_t>> idle_thermal_slots = {};
  /// Noise densities and rates for formats that hold them.
  std::optional<AllanResult> allan = {};
  /// Further lines at the beginning of the files.
  std::vector<std::string> further_comment = {};
  /// Also exports a unit that may not be delivered; the files say so.
  bool allows_outside_limits = false;
  /// The laboratory and its equipment, for the calibration record.
  std::optional<Laboratory> laboratory = {};
};

/// The difference of the consumer's result, in its arithmetic, from C(T) (y - b(T)) over a sphere
/// of inputs and the calibrated temperatures, true unit.
struct ExportLoss {
  double signal = 0.0;   ///< Radius of the sphere.
  double largest = 0.0;  ///< Largest length of the difference.
  double rms = 0.0;
  /// Largest ratio of the difference to the σ with which the calibration predicts that reading;
  /// unset if the calibration states none.
  std::optional<double> in_sigmas;
  /// The difference while the temperature changes at rates of the calibration's sweep, up and down,
  /// after its lags have settled. Set if the format holds no terms in the rate and the calibration
  /// states the rates.
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
  std::vector<std::string> notes = {};     ///< What the format cannot hold; what its user must do.
  std::vector<std::string> warnings = {};  ///< What degrades the result.
  Findings findings = {};                  ///< Warnings about sensors.
  PerTriad<bool> is_turned = {};           ///< The sensor's axes are rotated or swapped.
};

/// The calibration of one set of a device's sensors, and its folder.
struct ResultOfInstance {
  const Calibration* calibration = nullptr;
  std::string folder;
  int instance = 0;  ///< The number of the set of equal sensors, from 0.
};

/// The texts of exported files by their paths.
struct ExportsBeside {
  std::map<std::string, std::string> files;
  std::vector<std::string> warnings;  ///< As Export::warnings.
  Findings findings;                  ///< As Export::findings; "instance" names the sensors.
  bool is_whole = true;               ///< Each usable result was exported to each format.
};

/// The usable results of a device in each of `formats`: one file beside each result, or, where a
/// format numbers equal sensors, one file beside the first. A result that does not fit a format is
/// left out of it with a warning. Errors: as ExportCalibration.
Result<ExportsBeside> ExportBeside(const std::vector<ResultOfInstance>& results,
                                   const std::vector<std::string>& formats,
                                   ExportOptions options);

/// Whether a file, whatever its name, is an export of the unit of this serial number (if given) or
/// of a unit without a serial number. Error (bad input): the file cannot be read.
Result<bool> IsExport(const std::filesystem::path& path,
                      const std::optional<std::string>& serial = std::nullopt);

/// Renames each export in `folder` and its subfolders instance-N to NAME.withdrawn (then
/// NAME.withdrawn-2), unless a file of `written` replaces it, and returns the names. Called for a
/// folder whose result changes or may no longer be delivered. Errors (bad input): a folder cannot
/// be listed, a file cannot be renamed.
Result<std::vector<std::string>> WithdrawExports(
    const std::string& folder, const std::map<std::string, std::string>& written = {});

/// `calibration` as the text of `format`, read back and compared. Errors: no such format, an option
/// it lacks (usage); a calibration that is not usable, may not be delivered (kOutsideLimits) or
/// does not fit the format, a loss above options.max_loss (bad input).
Result<Export> ExportCalibration(const Calibration& calibration,
                                 std::string_view format,
                                 const ExportOptions& options = {});

/// Only the noise of `options.allan` as the text of `format`, for uncalibrated sensors: bias zero,
/// gains one. Errors: as ExportCalibration; no noise.
Result<Export> ExportNoise(std::string_view format, const ExportOptions& options);

}  // namespace truetriad
