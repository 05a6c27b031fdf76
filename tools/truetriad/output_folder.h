// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
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

/// Makes the folder of a file to come.
Status EnsureFolderOf(const std::string& file);

/// Error (bad input): `file` is the calibration of another unit than `serial`; `remedy`: what else
/// to do than to choose another output. One without a serial number is nobody's, nor is a file that
/// is no calibration.
Status CheckIsOfUnit(const std::filesystem::path& file,
                     const std::string& serial,
                     const std::string& remedy = "");

/// The path of a file in the folder that --output names.
std::string InOutput(const std::string& name);

/// Finds out before the work starts that the result could not be written, and creates nothing.
Status CheckCanWriteBelow(std::filesystem::path directory);

/// Writes the page that --report names, where it is given, and says so in the result.
Status WriteStatedReport(const std::string& html, VerbResult* result);
/// The result of a verb with this report, whose page is written where --report names one.
Result<VerbResult> Said(const VerbReport& report, Json json, int exit_code = kExitGood);

/// Error (bad input): both state a unit, or device ids of their sensors, and not the same. `what`:
/// "log.csv: the recording", which states `serial` and `tags`.
Status CheckSameSensors(const std::string& what,
                        const std::string& serial,
                        const Tags& tags,
                        const Calibration& of,
                        const std::string& remedy = "give the calibration of this sensor");
/// The same of two calibrations.
inline Status CheckSameSensors(
    const std::string& file,
    const Calibration& one,
    const Calibration& other,
    const std::string& remedy = "give those of one sensor (`import --id=N` chooses it)") {
  return CheckSameSensors(file, one.serial, one.tags, other, remedy);
}

}  // namespace truetriad
