// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdlib>

namespace truetriad {

// Whether to run the whole of what the everyday run samples: tools/bench/accuracy.py says so. It
// takes printed lines "@NAME | … |" as rows for the table that docs/ marks with
// `<!-- rows: NAME -->`.
inline bool IsNightly() { return std::getenv("TRUETRIAD_NIGHTLY") != nullptr; }

}  // namespace truetriad
