// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace truetriad {

/// The version of this library: "0.1.0".
std::string Version();

}  // namespace truetriad
