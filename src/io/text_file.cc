// SPDX-License-Identifier: Apache-2.0
#include "io/text_file.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <limits>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <nettle/sha2.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include "io/input_guard.h"

namespace truetriad {
namespace {

/// Longest line in bytes. Logs have shorter ones; binary data without '\n' would otherwise fill the
/// memory.
constexpr std::size_t kMaxLineBytes = 4U << 20;
/// Least free room in the buffer: even in a small file, the read that finds the end needs some.
constexpr std::size_t kLeastRoom = 8U << 10;

struct Magic {
  std::string_view bytes;
  std::string_view format;
  std::string_view convert_from = {};  // For `convert --from=`; empty if convert cannot read it.
  std::string_view decode_first = {};  // What to do before `truetriad convert`; may be empty.
};

using std::string_view_literals::operator""sv;

/// First bytes of formats that users may give by mistake.
constexpr std::array<Magic, 22> kForeignFormats = {{
    {"ULog\x01\x12\x35"sv, "a PX4 ULog file", "ulog"},
    {"\xA3\x95"sv, "an ArduPilot DataFlash log", "dataflash"},
    {"#ROSBAG V"sv, "a ROS 1 bag", "ros1"},
    {"SQLite format 3\0"sv, "an SQLite file (a ROS 2 bag?)", "ros2-db3"},
    {"\x89MCAP"sv, "an MCAP file", "mcap"},
    {"\x89HDF"sv, "an HDF5 file (or MATLAB v7.3)", "mat"},
    {"MATLAB 5.0 MAT-file"sv, "a MATLAB .mat file", "mat"},
    {"MATLAB 7.3 MAT-file"sv, "a MATLAB .mat file", "mat"},
    {"$VN"sv, "a log of VectorNav's sentences", "vectornav"},
    {"H Product:Blackbox"sv,
     "a Betaflight blackbox log",
     "blackbox --input=LOG.01.csv",
     "decode it with Betaflight's own blackbox_decode --unit-rotation rad/s --unit-acceleration "
     "m/s2 LOG.BBL, then"},
    {"PAR1"sv, "a Parquet file", "parquet"},
    {"PK\x03\x04"sv, "a zip archive (or a spreadsheet)"},
    {"BZh"sv, "a bzip2 file"},
    {"\xFD\x37zXZ"sv, "an xz file"},
    {"\x28\xB5\x2F\xFD"sv, "a zstd file"},
    {"\xFF\xFE"sv, "UTF-16 text (save it as UTF-8)"},
    {"\xFE\xFF"sv, "UTF-16 text (save it as UTF-8)"},
    {"{"sv, "a JSON file", "json"},
    {"["sv, "a JSON file", "json"},
    {"<!DOCTYPE"sv, "a web page (HTML)"},
    {"<html"sv, "a web page (HTML)"},
    {"<?xml"sv, "an XML file"},
}};

}  // namespace

/// Computes a SHA-256. Not in the unnamed namespace: TextFile::Bytes has a member of this type.
class Hasher {
 public:
  Hasher() { sha256_init(&context_); }
  void Update(std::string_view bytes) {
    sha256_update(&context_, bytes.size(), reinterpret_cast<const std::uint8_t*>(bytes.data()));
  }
  std::string Finish() {
    std::array<std::uint8_t, SHA256_DIGEST_SIZE> digest{};
    sha256_digest(&context_, digest.size(), digest.data());
    constexpr std::string_view kHex = "0123456789abcdef";
    std::string hex;
    for (const std::uint8_t byte : digest) hex += {kHex[byte >> 4U], kHex[byte & 15U]};
    return hex;
  }

 private:
  sha256_ctx context_;
};

/// The file's bytes as stored, hashed as they are read.
class TextFile::Bytes {
 public:
  Bytes(int descriptor, std::int64_t size) : descriptor_(descriptor), size_(size) {}
  ~Bytes() { close(descriptor_); }
  Bytes(const Bytes&) = delete;
  Bytes& operator=(const Bytes&) = delete;

  /// Reads up to `capacity` bytes; 0 at the end, -1 with errno on failure.
  ssize_t Read(char* data, std::size_t capacity) {
    ssize_t count = 0;
    do {
      count = read(descriptor_, data, capacity);
    } while (count < 0 && errno == EINTR);
    if (count > 0) {
      hash_.Update({data, static_cast<std::size_t>(count)});
      read_ += count;
    } else if (count == 0 && digest_.empty()) {
      digest_ = hash_.Finish();
    }
    return count;
  }

  double progress() const {
    return size_ > 0 ? std::min(1.0, static_cast<double>(read_) / static_cast<double>(size_)) : 1.0;
  }
  const std::string& digest() const { return digest_; }
  std::int64_t size() const { return size_; }

 private:
  int descriptor_;
  std::int64_t size_;
  std::int64_t read_ = 0;
  Hasher hash_;
  std::string digest_;
};

/// Streaming gzip decompression. If a file has several gzip members, their texts are joined.
class TextFile::Inflater {
 public:
  explicit Inflater(std::string_view first_bytes)
      : input_(std::max(kChunkBytes, first_bytes.size())) {
    std::copy(first_bytes.begin(), first_bytes.end(), input_.begin());
    stream_.next_in = Input();
    stream_.avail_in = static_cast<unsigned>(first_bytes.size());
    constexpr int kGzipWithLargestWindow = 15 + 16;  // 15: 2^15 bytes; + 16: a gzip header.
    ready_ = inflateInit2(&stream_, kGzipWithLargestWindow) == Z_OK;
  }
  ~Inflater() { inflateEnd(&stream_); }
  Inflater(const Inflater&) = delete;
  Inflater& operator=(const Inflater&) = delete;

  /// Fills `data` with `capacity` bytes of text decompressed from `bytes`; fewer only at the end.
  Result<std::size_t> Read(Bytes* bytes, char* data, std::size_t capacity) {
    if (!ready_)
      return Error(ErrorCode::kUnreadableFile, "cannot be decompressed: no memory for zlib");
    stream_.next_out = reinterpret_cast<Bytef*>(data);
    stream_.avail_out = static_cast<unsigned>(capacity);
    while (stream_.avail_out > 0) {
      if (stream_.avail_in == 0) {
        const ssize_t count = bytes->Read(input_.data(), input_.size());
        if (count < 0)
          return Error(ErrorCode::kUnreadableFile,
                       std::string("cannot be read: ") + std::strerror(errno));
        if (count == 0) {
          if (!between_members_) {
            return Error(ErrorCode::kDamagedFile,
                         "is an incomplete gzip file; copy it again, or close the log properly");
          }
          break;
        }
        stream_.next_in = Input();
        stream_.avail_in = static_cast<unsigned>(count);
      }
      if (between_members_) inflateReset(&stream_);
      const int status = inflate(&stream_, Z_NO_FLUSH);
      if (status != Z_OK && status != Z_STREAM_END) {
        return Error(ErrorCode::kDamagedFile,
                     std::string("is a damaged gzip file: ") +
                         (stream_.msg != nullptr ? stream_.msg : zError(status)));
      }
      between_members_ = status == Z_STREAM_END;
    }
    return capacity - stream_.avail_out;
  }

 private:
  Bytef* Input() { return reinterpret_cast<Bytef*>(input_.data()); }

  std::vector<char> input_;
  z_stream stream_{};
  bool ready_ = false;
  bool between_members_ = false;
};

Result<std::unique_ptr<TextFile>> TextFile::Open(const std::string& path, std::size_t chunk_bytes) {
  const int descriptor = open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (descriptor < 0)
    return Error(ErrorCode::kUnreadableFile,
                 {path},
                 std::string("cannot be opened: ") + std::strerror(errno));
  struct stat about {};
  const bool known = fstat(descriptor, &about) == 0;
  auto bytes = std::make_unique<Bytes>(descriptor, known ? about.st_size : 0);
  if (known && S_ISDIR(about.st_mode)) {
    return Error(ErrorCode::kUnreadableFile,
                 {path},
                 "is a folder; give a CSV file or a recording.yaml in it");
  }
  if (!known || !S_ISREG(about.st_mode)) {
    return Error(
        ErrorCode::kUnreadableFile, {path}, "is not a regular file; write the log to a file first");
  }
  InputGuard::Add(path);
  posix_fadvise(descriptor, 0, 0, POSIX_FADV_SEQUENTIAL);  // A hint; its failure does no harm.
  std::unique_ptr<TextFile> file(new TextFile(path, std::move(bytes), chunk_bytes));
  TRUETRIAD_RETURN_IF_ERROR(file->RecogniseContent());
  return file;
}

TextFile::TextFile(std::string path, std::unique_ptr<Bytes> bytes, std::size_t chunk_bytes)
    : path_(std::move(path)),
      chunk_bytes_(chunk_bytes),
      bytes_(std::move(bytes)),
      buffer_(Room(), '\0') {}

std::size_t TextFile::Room() const {
  if (inflater_ != nullptr) return 2 * chunk_bytes_;
  // Room follows from the file's size when it was opened, even if the file grows while it is read.
  const auto stored = static_cast<std::size_t>(std::max<std::int64_t>(0, bytes_->size()));
  return std::min(stored, chunk_bytes_) + std::min(stored, chunk_bytes_) + kLeastRoom;
}

std::size_t TextFile::MostBytes() const {
  if (inflater_ != nullptr) return std::numeric_limits<std::size_t>::max();
  return static_cast<std::size_t>(std::max<std::int64_t>(0, bytes_->size()));
}

TextFile::~TextFile() = default;

Status TextFile::RecogniseContent() {
  TRUETRIAD_RETURN_IF_ERROR(Fill());
  constexpr std::string_view kGzip = "\x1F\x8B";
  if (std::string_view(buffer_.data(), filled_).starts_with(kGzip)) {
    inflater_ = std::make_unique<Inflater>(std::string_view(buffer_.data(), filled_));
    filled_ = 0;
    at_end_ = false;
    TRUETRIAD_RETURN_IF_ERROR(Fill());
  }
  const std::string_view start(buffer_.data(), filled_);
  if (start.empty())
    return Error(ErrorCode::kEmptyFile, {path_}, "is empty; expected a log with a header");
  for (const Magic& magic : kForeignFormats) {
    if (start.starts_with(magic.bytes)) {
      std::string message = "is " + std::string(magic.format) + ", not CSV; ";
      message += magic.decode_first.empty() ? "convert it first" : magic.decode_first;
      if (!magic.convert_from.empty()) {
        message += magic.decode_first.empty() ? ": " : " ";
        message +=
            "truetriad convert --from=" + std::string(magic.convert_from) +
            (magic.decode_first.empty()
                 ? " --input=" + path_ + " --output=recording (`calibrate` does it by itself)"
                 : " --output=recording");
      }
      return Error(ErrorCode::kWrongFormat, {path_}, message);
    }
  }
  constexpr std::size_t kSample = 4096;  // Bytes searched; the parser reports a later NUL.
  if (start.substr(0, kSample).find('\0') != std::string_view::npos) {
    return Error(ErrorCode::kWrongFormat, {path_}, "is a binary file; expected CSV text");
  }
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  if (start.starts_with(kByteOrderMark)) handed_over_ = kByteOrderMark.size();
  return {};
}

Status TextFile::Fill() {
  const std::size_t wanted = std::min(buffer_.size() - filled_, chunk_bytes_);
  std::size_t count = 0;
  if (inflater_ != nullptr) {
    const Result<std::size_t> inflated =
        inflater_->Read(bytes_.get(), buffer_.data() + filled_, wanted);
    if (!inflated) return Error(inflated.error().code, {path_}, inflated.error().message);
    count = *inflated;
  } else {
    const ssize_t read = bytes_->Read(buffer_.data() + filled_, wanted);
    if (read < 0)
      return Error(ErrorCode::kUnreadableFile,
                   {path_},
                   std::string("cannot be read: ") + std::strerror(errno));
    count = static_cast<std::size_t>(read);
  }
  filled_ += count;
  at_end_ = count == 0;
  return {};
}

Result<std::string_view> TextFile::Next() {
  // The text after the last complete line moves to the front.
  std::copy(buffer_.begin() + static_cast<std::ptrdiff_t>(handed_over_),
            buffer_.begin() + static_cast<std::ptrdiff_t>(filled_),
            buffer_.begin());
  filled_ -= handed_over_;
  handed_over_ = 0;
  std::size_t searched = 0;
  for (;;) {
    const std::string_view fresh(buffer_.data() + searched, filled_ - searched);
    const std::size_t newline = fresh.rfind('\n');
    if (newline != std::string_view::npos) {
      handed_over_ = searched + newline + 1;
      break;
    }
    if (at_end_) {
      if (filled_ == 0) break;
      ended_mid_line_ = true;
      buffer_.resize(std::max(buffer_.size(), filled_ + 1));
      buffer_[filled_++] = '\n';
      handed_over_ = filled_;
      break;
    }
    searched = filled_;
    if (filled_ > kMaxLineBytes) {
      return Error(ErrorCode::kWrongFormat,
                   {path_},
                   "has a line of more than " + std::to_string(kMaxLineBytes) +
                       " bytes; expected a text log");
    }
    if (buffer_.size() - filled_ < std::min(Room(), chunk_bytes_)) buffer_.resize(filled_ + Room());
    TRUETRIAD_RETURN_IF_ERROR(Fill());
  }
  return std::string_view(buffer_.data(), handed_over_);
}

double TextFile::progress() const { return bytes_->progress(); }

std::string TextFile::Sha256() const { return bytes_->digest(); }

std::string_view ForeignFormatOf(const std::string& path) {
  std::string start(64, '\0');  // More bytes than an entry of kForeignFormats has.
  std::ifstream file(path, std::ios::binary);
  file.read(start.data(), static_cast<std::streamsize>(start.size()));
  for (const Magic& magic : kForeignFormats) {
    if (magic.decode_first.empty() && start.starts_with(magic.bytes)) return magic.convert_from;
  }
  return "";
}

std::string Sha256Hex(std::string_view bytes) {
  Hasher hash;
  hash.Update(bytes);
  return hash.Finish();
}

}  // namespace truetriad
