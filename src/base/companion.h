// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "truetriad/base/result.h"

namespace truetriad {

// Where a program or module that comes with this one lies: in the folder that the environment
// variable TRUETRIAD_LIBEXEC names, beside the running program (a build tree), or in
// ../libexec/truetriad from there (an installed tree). Nullopt when there is none.
//
// What needs heavy or foreign libraries is a companion, so that the program itself starts quickly
// and does without them.
std::optional<std::string> FindCompanion(std::string_view file_name);

// The address of `function` in a companion that is a module, which is loaded once and kept until
// the program ends. Error (usage): it is not there, or does not load.
Result<void*> CompanionFunction(const char* file_name, const char* function);

// The path of a data file that comes with the program, as "magnetic/wmm2025.wmm": in the folder
// that the environment variable TRUETRIAD_SHARE names, or else in share/truetriad beside the
// running program (a build tree), beside its folder (an installed tree), or beside the module that
// this code is a part of (Python). Error (bad input): there is none; lists the places.
Result<std::string> FindSharedFile(std::string_view file_name);

}  // namespace truetriad
