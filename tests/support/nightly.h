// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdlib>

namespace truetriad {

// Whether to run all of what the everyday run only samples: tools/bench/accuracy.py asks for it. It
// takes printed lines "@NAME | … |" as rows for the table that docs/ marks with
// `<!-- rows: NAME -->`.
inline bool IsNightly() { return std::getenv("TRUETRIAD_NIGHTLY") != nullptr; }

}  // namespace truetriad
