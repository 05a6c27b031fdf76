// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>

namespace truetriad {

/// The one limit of what tests wait for: no test waits for the machine's speed, and what has not
/// come in ten minutes does not come.
inline constexpr std::chrono::seconds kPatience{600};

/// From its making on.
class Patience {
 public:
  bool Lasts() const { return std::chrono::steady_clock::now() < end_; }

 private:
  std::chrono::steady_clock::time_point end_ = std::chrono::steady_clock::now() + kPatience;
};

}  // namespace truetriad
