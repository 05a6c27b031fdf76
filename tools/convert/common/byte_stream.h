// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <memory>
#include <string>
#include <string_view>
#include <type_traits>

#include "truetriad/base/result.h"

namespace truetriad::convert {

/// A binary file that is read sequentially, with a view of the bytes ahead. The memory depends on
/// the length of this view, and not on the length of the file or on sizes that the file states.
class ByteStream {
 public:
  /// Error: missing, unreadable, empty, or not a regular file.
  static Result<std::unique_ptr<ByteStream>> Open(const std::string& path);
  /// A stream of bytes in memory.
  static std::unique_ptr<ByteStream> Of(std::string bytes);
  ByteStream(const ByteStream&) = delete;
  ByteStream& operator=(const ByteStream&) = delete;

  /// The next `count` bytes, or fewer at the end. Valid until the next call. Range: <= kLookAhead.
  std::string_view Peek(std::size_t count);
  /// Advances by `count` bytes, or to the end.
  void Skip(std::uint64_t count);

  /// The largest number of bytes that can be viewed ahead; a longer record is treated as damage.
  static constexpr std::size_t kLookAhead = std::size_t{512} << 20U;

  std::uint64_t position() const { return position_; }  ///< Position of the next byte.
  std::uint64_t size() const { return size_; }
  std::uint64_t left() const { return size_ - position_; }
  bool at_end() const { return position_ >= size_; }
  double progress() const { return static_cast<double>(position_) / static_cast<double>(size_); }
  const std::string& path() const { return path_; }
  bool read_failed() const { return read_failed_; }

 private:
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };

  ByteStream() = default;
  void Fill(std::size_t count);

  std::string path_;
  std::unique_ptr<std::FILE, Close> file_;
  std::uint64_t size_ = 0;
  std::uint64_t position_ = 0;
  std::string buffer_;
  std::size_t begin_ = 0;  ///< Number of consumed bytes in the buffer.
  std::size_t end_ = 0;    ///< End of the file's bytes in the buffer.
  bool read_failed_ = false;
};

static_assert(std::endian::native == std::endian::little, "logs are read as little-endian bytes");

/// The little-endian number at byte `offset`. Range: all its bytes are there.
template <typename T>
T LoadNumber(std::string_view bytes, std::size_t offset) {
  static_assert(std::is_trivially_copyable_v<T>);
  T value;
  std::memcpy(&value, bytes.data() + offset, sizeof value);
  return value;
}

/// Reads little-endian values one after another; a read beyond the end and all later ones fail.
class ByteCursor {
 public:
  explicit ByteCursor(std::string_view bytes) : left_(bytes) {}

  template <typename T>
  T Take() {
    const std::string_view bytes = TakeBytes(sizeof(T));
    return bytes.size() == sizeof(T) ? LoadNumber<T>(bytes, 0) : T{};
  }

  /// The next `count` bytes; empty if fewer are left.
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
