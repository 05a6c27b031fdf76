// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "truetriad/base/result.h"

namespace truetriad {

// The path of a program or module that is installed with this one: in the folder that the
// environment variable TRUETRIAD_LIBEXEC names, beside the running program (a build tree), or in
// ../libexec/truetriad from there (an installed tree). Nullopt when there is none.
//
// Code that needs large or third-party libraries is a companion, so that the program itself starts
// quickly and does not link them.
std::optional<std::string> FindCompanion(std::string_view file_name);

// The address of `function` in a companion that is a module. The module is loaded once and kept
// until the program ends. Error (usage): it is missing or does not load.
Result<void*> CompanionFunction(const char* file_name, const char* function);

// The path of a data file that is installed with the program, such as "magnetic/wmm2025.wmm": in
// the folder that the environment variable TRUETRIAD_SHARE names, or else in share/truetriad beside
// the running program (a build tree), beside its folder (an installed tree), or beside the module
// that contains this code (Python). Error (bad input): there is no such file; its message lists the
// places.
Result<std::string> FindSharedFile(std::string_view file_name);

}  // namespace truetriad
