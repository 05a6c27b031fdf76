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

/// Paths and texts.
using FileTexts = std::vector<std::pair<std::string, std::string>>;

/// Writes files, all or none.
Status WriteFiles(const FileTexts& files);

/// What a calibration writes into its folder.
inline constexpr std::array<const char*, 3> kResults = {
    "calibration.yaml", "calibration.json", "report.html"};

/// The calibration that a file holds; unset: it is not there, or none.
std::optional<Calibration> CalibrationIn(const std::string& file);

/// Error (bad input), unless --overwrite is stated: `file` is the calibration of another unit than
/// `serial`. One without a serial number is nobody's, nor is a file that is no calibration.
Status CheckIsOfUnit(const std::filesystem::path& file, const std::string& serial);
/// Likewise: `file` has `there`, which is of other sensors than `calibration`.
Status CheckMayReplace(const std::string& file,
                       const std::optional<Calibration>& there,
                       const Calibration& calibration);
/// Likewise: `file`, which an export is to replace, is none of the unit.
Status CheckIsExport(const std::string& file, const std::string& serial);

/// What a result NAME + `rest` becomes that a later one must not replace: NAME.previous + `rest`,
/// or where another is there that has more than it, NAME.previous-2 + `rest`, and so on.
std::string PreviousSuffix(const std::filesystem::path& name, const std::string& rest);
/// Renames what the result to come must not replace: calibration.yaml in `directory` becomes
/// calibration.previous.yaml; says so.
Status MoveAside(const std::filesystem::path& directory, std::span<const std::string> names);

/// Makes the folder of a file to come.
Status EnsureFolderOf(const std::string& file);

/// The path of a file in the folder that --output names.
std::string InOutput(const std::string& name);

/// Finds out before the work starts that the result could not be written, and creates nothing.
Status CheckCanWriteBelow(std::filesystem::path directory);

/// Writes the page that --report names, where it is given, and says so in the result.
Status WriteStatedReport(const std::string& html, VerbResult* result);
/// The result of a verb with this report, whose page is written where --report names one.
Result<VerbResult> Said(const VerbReport& report, Json json, int exit_code = kExitGood);

}  // namespace truetriad
