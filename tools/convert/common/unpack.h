// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <string>
#include <string_view>

namespace truetriad::convert {

/// Unpacks up to `size` bytes by calls of `step`. A call consumes part of `packed`, sets the number
/// of bytes produced, and returns false if it was the last. Returns false if fewer than `size`
/// bytes were unpacked.
template <typename Step>
bool UnpackBy(const Step& step, std::string_view packed, std::size_t size, std::string* unpacked) {
  // The memory grows with the data produced, not with the size that the chunk states.
  constexpr std::size_t kStep = std::size_t{1} << 18U;
  std::size_t filled = 0;
  for (bool goes_on = true; goes_on && filled < size;) {
    unpacked->resize(std::min(size, filled + kStep));
    std::size_t produced = unpacked->size() - filled;
    const std::size_t before = packed.size();
    goes_on = step(&packed, unpacked->data() + filled, &produced);
    filled += produced;
    if (produced == 0 && packed.size() == before) break;  // Truncated data.
  }
  unpacked->resize(filled);
  return filled == size;
}

}  // namespace truetriad::convert
