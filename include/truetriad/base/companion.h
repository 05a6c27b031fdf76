// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace truetriad {

// Where a program or module that comes with this one lies: in the folder that the environment
// variable TRUETRIAD_LIBEXEC names, beside the running program (a build tree), or in
// ../libexec/truetriad from there (an installed tree). Nullopt when there is none.
//
// What needs heavy or foreign libraries is a companion, so that the program itself starts quickly
// and does without them.
std::optional<std::string> FindCompanion(std::string_view file_name);

}  // namespace truetriad
