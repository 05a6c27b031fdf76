// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
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
#include "truetriad/model/calibration.h"

namespace truetriad {

/// Laboratory, procedure and equipment of a calibration, for its record. A field that is not stated
/// is empty.
struct Equipment {
  std::string name, serial, certificate;
  std::string calibrated;  ///< The day on which the equipment itself was calibrated: "2026-01-31".
  std::string due;         ///< The last day on which the equipment's calibration is valid.
};
struct Laboratory {
  std::string name, address, accreditation, procedure;
  std::vector<Equipment> equipment;
};

/// The keys of laboratory.yaml and of the record, in their order. In each list the first key is
/// required.
template <typename Of>
struct LaboratoryKey {
  std::string_view key;
  std::string Of::*value;
  bool is_day = false;
};
inline constexpr std::array<LaboratoryKey<Laboratory>, 4> kLaboratoryKeys = {
    {{"name", &Laboratory::name},
     {"address", &Laboratory::address},
     {"accreditation", &Laboratory::accreditation},
     {"procedure", &Laboratory::procedure}}};
inline constexpr std::array<LaboratoryKey<Equipment>, 5> kEquipmentKeys = {
    {{"name", &Equipment::name},
     {"serial", &Equipment::serial},
     {"certificate", &Equipment::certificate},
     {"calibrated", &Equipment::calibrated, true},
     {"due", &Equipment::due, true}}};

/// Reads a laboratory.yaml. Errors (bad input), reported together with file and line: a missing
/// name, an invalid day, an unknown key.
Result<Laboratory> ReadLaboratory(const std::string& path);

/// Whether the calibration time `created` (ISO 8601) is after the due day of the equipment; unset
/// if the time or the due day is not stated.
std::optional<bool> IsOverdue(const Equipment& equipment, const std::string& created);

/// The arithmetic in which a program applies an exported file. This program is called the target.
enum class Arithmetic { kFloat32, kFloat64, kIntegers };

/// A kind of parameter file that other programs read.
struct FormatInfo {
  std::string_view name;         ///< "px4", as in --to.
  std::string_view description;  ///< "PX4 parameters (QGroundControl .params)".
  std::string_view file_name;    ///< Default name of such a file: "px4.params".
  Arithmetic arithmetic = Arithmetic::kFloat64;
  bool can_import = false;
  /// If one file holds several equal sensors: the number of the first one.
  std::optional<int> first_instance = {};
};

/// All formats, in the order of the documentation.
std::vector<FormatInfo> Formats();

/// Error (usage): no format has this name; the message suggests the nearest name.
Result<FormatInfo> InfoOfFormat(std::string_view name);

struct ExportOptions {
  /// The version of the exporting program, "0.1.0"; the file's comment states it.
  std::string software_version = {};
  /// The name of the output. For "matlab", the ending .m selects a script instead of a .mat; for
  /// "record", .html or .htm selects a page instead of JSON.
  std::string file_name = {};
  /// Temperature terms that the format cannot hold are evaluated at this temperature, degC. Unset:
  /// at their reference temperature. Range: the calibrated range.
  std::optional<double> temperature_degc = {};
  /// If a sensor's largest error exceeds this share of its signal, refuses the export. Range: >= 0.
  std::optional<double> max_loss = {};
  /// Units of the readings that the target corrects, for formats that do not fix the unit.
  PerTriad<std::optional<std::string>> units = {};
  /// Number of this sensor among several equal ones, as the target counts them. Unset: the first.
  std::optional<int> instance = {};
  /// The sensor's device ID in the target, for formats that state IDs. Unset: the ID in the
  /// calibration's Tags.
  PerTriad<std::optional<std::int64_t>> device_ids = {};
  /// If the target has several sets of parameters: the number of each sensor's set, and of the set
  /// with its temperature terms. Unset: as in the calibration's Tags, otherwise `instance`.
  PerTriad<std::optional<std::int64_t>> slots = {}, thermal_slots = {};
  /// The sets of temperature terms that the target does not use (Tags). Enabling the terms of this
  /// sensor must not enable these sets.
  PerTriad<std::vector<std::int64_t>> idle_thermal_slots = {};
  /// Noise densities and sampling rates, for formats that hold them.
  std::optional<AllanResult> allan = {};
  /// Lines added to the comment of the files.
  std::vector<std::string> further_comment = {};
  /// Whether a unit that may not be delivered is exported as well. Its files then state this.
  bool allows_outside_limits = false;
  /// The laboratory and its equipment, for the calibration record.
  std::optional<Laboratory> laboratory = {};
};

/// The errors, in the true unit, of the results that the target computes with the exported file, in
/// its arithmetic. The whole calibration predicts the readings: for truths on a sphere, at the
/// calibrated temperatures.
struct ExportLoss {
  double signal = 0.0;   ///< Radius of the sphere of truths.
  double largest = 0.0;  ///< Largest length of an error.
  double rms = 0.0;
  /// Largest ratio of the error of a corrected reading to the σ that the calibration's covariance
  /// gives for this reading; unset if no such σ is above zero.
  std::optional<double> in_sigmas;
  /// The errors while the temperature changes steadily, at rates over the range of the
  /// calibration's sweep, after the sensor's lags have settled. Set if the format drops the terms
  /// in the rate or the lags, and the calibration states the range of rates.
  struct AtRates {
    Eigen::Vector2d range_degcps = Eigen::Vector2d::Zero();
    double largest = 0.0;
    double rms = 0.0;
  };
  std::optional<AtRates> at_rates;

  double share() const { return largest / signal; }
};

/// A file of an export. `suffix` is appended to the name of the output that the user gave.
struct ExportedFile {
  std::string suffix;
  std::string text;
};

struct Export {
  std::vector<ExportedFile> files = {};
  PerTriad<std::optional<ExportLoss>> loss = {};
  std::vector<std::string> notes = {};     ///< What is dropped; what the file's user must do.
  std::vector<std::string> warnings = {};  ///< What makes the results of the target worse.
  Findings findings = {};                  ///< Further warnings, each about one sensor.
  PerTriad<bool> is_turned = {};           ///< The format drops a rotation or swap of the axes.
};

/// A device may have several equal sets of sensors: the calibration of one set, and its folder.
struct ResultOfInstance {
  const Calibration* calibration = nullptr;
  std::string folder;
  int instance = 0;  ///< The number of the set, from 0.
};

/// The exports of all results of a device. `files`: the text of each file by its path.
struct ExportsBeside {
  std::map<std::string, std::string> files;
  std::vector<std::string> warnings;  ///< The Export::warnings of all exports.
  Findings findings;                  ///< The Export::findings, with the value "instance".
  bool is_whole = true;               ///< No sensor that a format could hold was left out.
};

/// Exports the usable results of a device to each of `formats`. If a format numbers equal sensors,
/// one file beside the first result holds all; otherwise each result has its own file. If a result
/// does not fit a format, it is left out of this format, with a warning. Errors: as
/// ExportCalibration.
Result<ExportsBeside> ExportBeside(const std::vector<ResultOfInstance>& results,
                                   const std::vector<std::string>& formats,
                                   ExportOptions options);

/// Whether the contents of a file are those of an export. Withdrawn and temporary files do not
/// count. If `serial` is given, exports of units with another serial number do not count either.
/// Error (bad input): the file cannot be read.
Result<bool> IsExport(const std::filesystem::path& path,
                      const std::optional<std::string>& serial = std::nullopt);

/// Renames each export in `folder` and its subfolders instance-N to NAME.withdrawn (if this name is
/// taken: NAME.withdrawn-2) and returns the new names. Paths in `written` are not renamed, as they
/// are replaced. Called if the result of the folder changes or may no longer be delivered. Errors
/// (bad input): a folder cannot be listed; a file cannot be read or renamed.
Result<std::vector<std::string>> WithdrawExports(
    const std::string& folder, const std::map<std::string, std::string>& written = {});

/// Writes `calibration` as the text of `format`, reads the text back and compares. Errors (usage):
/// no such format; an option that the format does not have. Errors (bad input): the calibration is
/// not usable, may not be delivered (kOutsideLimits) or does not fit the format; the loss exceeds
/// options.max_loss.
Result<Export> ExportCalibration(const Calibration& calibration,
                                 std::string_view format,
                                 const ExportOptions& options = {});

/// Writes the noise in `options.allan` as the text of `format`, for uncalibrated sensors: biases
/// are zero and gains one. Errors: as ExportCalibration; options.allan is unset (usage).
Result<Export> ExportNoise(std::string_view format, const ExportOptions& options);

struct ImportOptions {
  /// The version of the importing program: "0.1.0".
  std::string software_version = {};
  /// Units of the calibration's readings. Unset: the true unit if the format fixes a unit,
  /// otherwise the unit that the file states. Must be set if neither format nor file states a unit.
  PerTriad<std::optional<std::string>> units = {};
  /// The number of the imported sensor among several equal ones, as the other program counts them.
  /// Unset: the first.
  std::optional<int> instance = {};
  /// Device IDs that select the sensors in place of `instance`, for formats that state IDs.
  PerTriad<std::optional<std::int64_t>> device_ids = {};
};

struct Import {
  Calibration calibration;
  std::vector<std::string> notes;  ///< The assumptions that were made.
};

/// Imports the calibration that a unit uses today, for comparison and evaluation. The equation of
/// the other program becomes bias and sensitivity; every σ is zero. The gauge follows from the form
/// of the leading triad's matrix. Errors (usage): no such format; a format that cannot be imported;
/// an unknown unit. Errors (bad input): files that cannot be read or hold no calibration.
Result<Import> ImportCalibration(std::string_view format,
                                 const std::vector<std::string>& paths,
                                 const ImportOptions& options = {});

}  // namespace truetriad
