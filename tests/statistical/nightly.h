// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdlib>

namespace truetriad {

// Whether to run the whole of what the everyday run samples: the target `nightly` says so.
inline bool IsNightly() { return std::getenv("TRUETRIAD_NIGHTLY") != nullptr; }

}  // namespace truetriad
