// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace truetriad {

/// All names that ParseLimitName knows, and their beginnings "reference" and "accelerometer" …,
/// below which a file may state the rest of the name.
std::vector<std::string> LimitNames();

}  // namespace truetriad
