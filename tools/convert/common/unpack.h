// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <string>
#include <string_view>

namespace truetriad::convert {

/// Unpacks `size` bytes by steps, each of which takes of `packed` and says how much of its room it
/// filled, until one is false. False: there are fewer bytes, those that came out before.
template <typename Step>
bool UnpackBy(const Step& step, std::string_view packed, std::size_t size, std::string* unpacked) {
  // Grows with what is unpacked, not with what the chunk says of itself.
  constexpr std::size_t kStep = std::size_t{1} << 18U;
  std::size_t filled = 0;
  for (bool goes_on = true; goes_on && filled < size;) {
    unpacked->resize(std::min(size, filled + kStep));
    std::size_t produced = unpacked->size() - filled;
    const std::size_t before = packed.size();
    goes_on = step(&packed, unpacked->data() + filled, &produced);
    filled += produced;
    if (produced == 0 && packed.size() == before) break;  // Cut: it wants more.
  }
  unpacked->resize(filled);
  return filled == size;
}

}  // namespace truetriad::convert
