// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "truetriad/base/result.h"

namespace truetriad {

// The path of a program or module that is installed with this program. Searches the folder that the
// environment variable TRUETRIAD_LIBEXEC names, then the folder of the running program (build
// tree), then ../libexec/truetriad relative to that folder (installed tree). Nullopt if not found.
//
// Code that needs large or third-party libraries is built as such a companion, so that the program
// itself starts quickly and does not link these libraries.
std::optional<std::string> FindCompanion(std::string_view file_name);

// The address of `function` in a companion that is a module. The module is loaded once and kept
// until the program ends. Error (usage): the module is missing, does not load or lacks the
// function.
Result<void*> CompanionFunction(const char* file_name, const char* function);

// The path of a data file that is installed with the program, such as "magnetic/wmm2025.wmm". If
// the environment variable TRUETRIAD_SHARE names a folder, only that folder is searched. Otherwise
// share/truetriad is searched beside the running program (build tree), beside the program's folder
// (installed tree) and beside the module that contains this code (Python). Error (bad input): the
// file is not found; the message lists the folders searched.
Result<std::string> FindSharedFile(std::string_view file_name);

}  // namespace truetriad
