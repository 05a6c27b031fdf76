// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

namespace truetriad {

/// A place where a recording was joined from pieces, so that no turn may be integrated across it.
struct RecordingJoint {
  std::int64_t time_ns = 0;  ///< Time of the first reading after the joint.
  std::int64_t row = 0;      ///< Data row of that reading.
  std::string seen;          ///< The evidence for the joint, in words.
  bool is_told = false;      ///< Whether a finding already reports the joint.
};

}  // namespace truetriad
