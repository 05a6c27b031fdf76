// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "tools/convert/common/converter.h"
#include "tools/convert/common/variables.h"
#include "truetriad/base/result.h"

namespace truetriad::convert {

/// What --columns and --units say, for --help.
std::string_view NamedReadingsHelp();

/// Converts, or lists, files of named matrices whose meaning the user states (--columns, --units)
/// or their names make clear. `open` reads one. Runs in a process of its own: a damaged file can
/// bring a library down.
Status ConvertNamedReadings(
    const Arguments& arguments,
    const std::string& format,
    const std::function<Result<std::unique_ptr<VariableFile>>(const std::string& path)>& open);

}  // namespace truetriad::convert
