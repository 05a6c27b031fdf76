// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>

#include "tools/convert/common/converter.h"
#include "tools/convert/common/variables.h"
#include "truetriad/base/result.h"

namespace truetriad::convert {

/// What --columns and --units say, for --help.
std::string_view NamedReadingsHelp();

/// Units by role ("time", "accelerometer", …) as --units says; `counts` for every triad that has no
/// other. `columns`: what the user calls each role, "acc@t" where it has a time of its own.
/// Error (usage): unknown, given twice, or missing.
Result<std::map<std::string, std::string>> ReadUnits(
    const std::map<std::string, std::string>& columns, const Arguments& arguments);

/// Converts, or lists, files of named matrices whose meaning the user states (--columns, --units)
/// or their names make clear. `open` reads one. Runs in a process of its own: a damaged file can
/// bring a library down.
Status ConvertNamedReadings(
    const Arguments& arguments,
    const std::string& format,
    const std::function<Result<std::unique_ptr<VariableFile>>(const std::string& path)>& open);

}  // namespace truetriad::convert
