// SPDX-License-Identifier: Apache-2.0
#include "tools/convert/common/byte_stream.h"

#include <algorithm>
#include <cerrno>
#include <cstring>

#include <glog/logging.h>
#include <sys/stat.h>

namespace truetriad::convert {

Result<std::unique_ptr<ByteStream>> ByteStream::Open(const std::string& path) {
  std::unique_ptr<ByteStream> stream(new ByteStream());
  stream->path_ = path;
  stream->file_.reset(std::fopen(path.c_str(), "rbe"));
  if (!stream->file_)
    return Error(
        ErrorCode::kUnreadableFile, {path}, std::string("cannot be read: ") + std::strerror(errno));
  struct stat status {};
  if (fstat(fileno(stream->file_.get()), &status) != 0 || !S_ISREG(status.st_mode)) {
    return Error(
        ErrorCode::kUnreadableFile, {path}, "is not a regular file; give the path of a log file");
  }
  if (status.st_size == 0) return Error(ErrorCode::kEmptyFile, {path}, "is empty");
  stream->size_ = static_cast<std::uint64_t>(status.st_size);
  return stream;
}

std::unique_ptr<ByteStream> ByteStream::Of(std::string bytes) {
  std::unique_ptr<ByteStream> stream(new ByteStream());
  stream->size_ = stream->end_ = bytes.size();
  stream->buffer_ = std::move(bytes);
  return stream;
}

void ByteStream::Fill(std::size_t count) {
  // A small file needs only a small buffer. If the file grows, the chunks keep their size.
  constexpr std::uint64_t kLeastChunk = std::uint64_t{1} << 12U,
                          kMostChunk = std::uint64_t{1} << 20U;
  const auto chunk = static_cast<std::size_t>(std::clamp(size_, kLeastChunk, kMostChunk));
  std::memmove(buffer_.data(), buffer_.data() + begin_, end_ - begin_);
  end_ -= begin_;
  begin_ = 0;
  // The buffer grows with the file's data, not with `count`.
  while (end_ < count && !read_failed_) {
    if (buffer_.size() < end_ + chunk) buffer_.resize(end_ + chunk);
    const std::size_t got =
        std::fread(buffer_.data() + end_, 1, buffer_.size() - end_, file_.get());
    end_ += got;
    if (got == 0) {
      // The file was truncated meanwhile or can no longer be read, so it ends here.
      read_failed_ = std::ferror(file_.get()) != 0;
      size_ = position_ + end_;
      break;
    }
  }
}

std::string_view ByteStream::Peek(std::size_t count) {
  CHECK_LE(count, kLookAhead);
  count = static_cast<std::size_t>(std::min<std::uint64_t>(count, left()));
  if (end_ - begin_ < count) Fill(count);
  return {buffer_.data() + begin_, std::min(count, end_ - begin_)};
}

void ByteStream::Skip(std::uint64_t count) {
  count = std::min(count, left());
  const std::uint64_t buffered = end_ - begin_;
  if (count <= buffered) {
    begin_ += static_cast<std::size_t>(count);
  } else {
    begin_ = end_ = 0;
    if (fseeko(file_.get(), static_cast<off_t>(position_ + count), SEEK_SET) != 0) {
      read_failed_ = true;
      size_ = position_ + count;
    }
  }
  position_ += count;
}

}  // namespace truetriad::convert
