// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>
#include <vector>

#include "truetriad/base/triad.h"

namespace truetriad {

/// All names of units that ParseTriadUnit knows.
std::vector<std::string_view> TriadUnitNames(Triad triad);

}  // namespace truetriad
