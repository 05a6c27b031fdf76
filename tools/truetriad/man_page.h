// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace truetriad {

/// truetriad.1, of the same table of verbs and flags as the help.
std::string ManPage();

}  // namespace truetriad
