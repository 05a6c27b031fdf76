// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "truetriad/base/result.h"

namespace truetriad {

/// Finds out before the work starts that the result could not be written, and creates nothing.
Status CheckCanWriteBelow(std::filesystem::path directory);

}  // namespace truetriad
