// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>

namespace truetriad {

/// The limit for everything that tests wait for: no test depends on the machine's speed, and what
/// has not come in ten minutes does not come.
inline constexpr std::chrono::seconds kPatience{600};

/// Lasts for kPatience after it was made.
class Patience {
 public:
  bool Lasts() const { return std::chrono::steady_clock::now() < end_; }

 private:
  std::chrono::steady_clock::time_point end_ = std::chrono::steady_clock::now() + kPatience;
};

}  // namespace truetriad
