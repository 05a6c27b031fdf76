// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

namespace truetriad {

/// Where a recording was put together from pieces, so that no turn leads across.
struct RecordingJoint {
  std::int64_t time_ns = 0;  ///< Of the first reading after it.
  std::int64_t row = 0;      ///< Its data row.
  std::string seen;          ///< What shows it.
  bool is_told = false;      ///< A finding says so already.
};

}  // namespace truetriad
