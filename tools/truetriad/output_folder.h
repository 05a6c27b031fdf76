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
/// `serial`. A calibration without serial number, or another file, is not protected.
Status CheckIsOfUnit(const std::filesystem::path& file, const std::string& serial);
/// Error as above: `file` holds the calibration `there`, of other sensors than `calibration`.
Status CheckMayReplace(const std::string& file,
                       const std::optional<Calibration>& there,
                       const Calibration& calibration);
/// Error as above: `file`, which an export would replace, is not an export of the unit.
Status CheckIsExport(const std::string& file, const std::string& serial);

/// The suffix for a result NAME + `rest` that must be kept as NAME + suffix + `rest`: ".previous",
/// or ".previous-2" and so on if an earlier result of that name holds more than this one.
std::string PreviousSuffix(const std::filesystem::path& name, const std::string& rest);
/// Renames the files `names` that a new result must not replace: calibration.yaml in `directory`
/// becomes calibration.previous.yaml, with a note.
Status MoveAside(const std::filesystem::path& directory, std::span<const std::string> names);

/// Creates the folder of a new file.
Status EnsureFolderOf(const std::string& file);

/// The path of a file in the folder that --output names.
std::string InOutput(const std::string& name);

/// Error: a result below `directory` could not be written. Asked before work; creates nothing.
Status CheckCanWriteBelow(std::filesystem::path directory);

/// Writes the page for --report, if given, and records it in the result.
Status WriteStatedReport(const std::string& html, VerbResult* result);
/// The result of a verb with this report, whose page is written if --report is given.
Result<VerbResult> Said(const VerbReport& report, Json json, int exit_code = kExitGood);

}  // namespace truetriad
