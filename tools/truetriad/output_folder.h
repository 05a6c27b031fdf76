// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "tools/truetriad/command.h"
#include "truetriad/base/result.h"
#include "truetriad/model/calibration.h"

namespace truetriad {

/// Pairs of path and text.
using FileTexts = std::vector<std::pair<std::string, std::string>>;

/// Writes files, all or none.
Status WriteFiles(const FileTexts& files);

/// The files that a calibration writes into its folder.
inline constexpr std::array<const char*, 3> kResults = {
    "calibration.yaml", "calibration.json", "report.html"};

/// The calibration in a file; unset: the file is missing or not a calibration.
std::optional<Calibration> CalibrationIn(const std::string& file);

/// Error (bad input), unless --overwrite is given: `file` is a calibration of another unit than
/// `serial`. A calibration without serial number is not protected, nor is any other file.
Status CheckIsOfUnit(const std::filesystem::path& file, const std::string& serial);
/// Error as CheckIsOfUnit: `file` holds the calibration `there`, which is of other sensors.
Status CheckMayReplace(const std::string& file,
                       const std::optional<Calibration>& there,
                       const Calibration& calibration);
/// Error as CheckIsOfUnit: `file`, which an export would replace, is no export of the unit
/// `serial`.
Status CheckIsExport(const std::string& file, const std::string& serial);

/// The suffix for a result to be kept: `name` + `rest` becomes `name` + suffix + `rest`. The suffix
/// is ".previous", or ".previous-2" and so on if an earlier kept result holds more than this one.
std::string PreviousSuffix(const std::filesystem::path& name, const std::string& rest);
/// Renames the files `names` in `directory`, which a new result must not replace: calibration.yaml
/// becomes calibration.previous.yaml. Prints a note.
Status MoveAside(const std::filesystem::path& directory, std::span<const std::string> names);

/// Creates the folder of a new file.
Status EnsureFolderOf(const std::string& file);

/// The path of a file in the folder that --output names.
std::string InOutput(const std::string& name);

/// Error: a result below `directory` could not be written. For use before the work; creates
/// nothing.
Status CheckCanWriteBelow(std::filesystem::path directory);

/// If --report is given, writes the page there and records it in the result.
Status WriteStatedReport(const std::string& html, VerbResult* result);
/// The result of a verb with `report`. If --report is given, writes the page of the report.
Result<VerbResult> Said(const VerbReport& report, Json json, int exit_code = kExitGood);

}  // namespace truetriad
