// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cstring>
#include <optional>
#include <string_view>
#include <type_traits>

namespace truetriad::convert {

static_assert(std::endian::native == std::endian::little, "logs are read as little-endian bytes");

/// The little-endian number that begins at byte `offset`, which must be there in full.
template <typename T>
T LoadNumber(std::string_view bytes, std::size_t offset) {
  static_assert(std::is_trivially_copyable_v<T>);
  T value;
  std::memcpy(&value, bytes.data() + offset, sizeof value);
  return value;
}

/// Reads little-endian values one after another; one read beyond the end fails, and all after it.
class ByteCursor {
 public:
  explicit ByteCursor(std::string_view bytes) : left_(bytes) {}

  template <typename T>
  T Take() {
    const std::string_view bytes = TakeBytes(sizeof(T));
    return bytes.size() == sizeof(T) ? LoadNumber<T>(bytes, 0) : T{};
  }

  /// Empty when there are fewer.
  std::string_view TakeBytes(std::size_t count) {
    if (failed_ || count > left_.size()) {
      failed_ = true;
      return {};
    }
    const std::string_view bytes = left_.substr(0, count);
    left_.remove_prefix(count);
    return bytes;
  }

  bool failed() const { return failed_; }
  bool at_end() const { return left_.empty(); }
  std::string_view left() const { return left_; }

 private:
  std::string_view left_;
  bool failed_ = false;
};

}  // namespace truetriad::convert
