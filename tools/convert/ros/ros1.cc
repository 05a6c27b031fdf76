// SPDX-License-Identifier: Apache-2.0
//
// ROS 1 bags (.bag) to a recording. docs/converting.md.
#include <algorithm>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include <bzlib.h>
#include <lz4frame.h>

#include "tools/convert/common/byte_stream.h"
#include "tools/convert/ros/bag_recording.h"
#include "tools/truetriad/progress.h"

namespace truetriad::convert {
namespace {

// Grows with what is unpacked, not with what the chunk says of itself.
constexpr std::size_t kStep = std::size_t{1} << 18U;

bool UnpackBzip2(std::string_view packed, std::size_t size, std::string* unpacked) {
  bz_stream stream{};
  if (BZ2_bzDecompressInit(&stream, 0, 0) != BZ_OK) return false;
  stream.next_in = const_cast<char*>(packed.data());  // Only read from.
  stream.avail_in = static_cast<unsigned>(packed.size());
  int state = BZ_OK;
  std::size_t filled = 0;
  while (state == BZ_OK && filled < size) {
    unpacked->resize(std::min(size, filled + kStep));
    stream.next_out = unpacked->data() + filled;
    stream.avail_out = static_cast<unsigned>(unpacked->size() - filled);
    const unsigned input_before = stream.avail_in;
    state = BZ2_bzDecompress(&stream);
    const std::size_t now = unpacked->size() - stream.avail_out;
    if (now == filled && stream.avail_in == input_before) break;  // Cut: it wants more.
    filled = now;
  }
  unpacked->resize(filled);
  BZ2_bzDecompressEnd(&stream);
  return filled == size;
}

bool UnpackLz4(std::string_view packed, std::size_t size, std::string* unpacked) {
  LZ4F_dctx* context = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&context, LZ4F_VERSION)) != 0) return false;
  std::size_t filled = 0;
  while (!packed.empty() && filled < size) {
    unpacked->resize(std::min(size, filled + kStep));
    std::size_t produced = unpacked->size() - filled;
    std::size_t consumed = packed.size();
    const std::size_t hint = LZ4F_decompress(
        context, unpacked->data() + filled, &produced, packed.data(), &consumed, nullptr);
    if (LZ4F_isError(hint) != 0) break;
    filled += produced;
    packed.remove_prefix(consumed);
    if (produced == 0 && consumed == 0) break;
  }
  unpacked->resize(filled);
  LZ4F_freeDecompressionContext(context);
  return filled == size;
}

/// Unpacks the data of a chunk; false when it is damaged, then `unpacked` holds what came out
/// before. Never unpacks more than `size` bytes, the chunk's stated size. `compression`: none, bz2,
/// lz4.
bool Unpack(std::string_view compression,
            std::string_view packed,
            std::size_t size,
            std::string* unpacked) {
  unpacked->clear();
  if (compression == "bz2") return UnpackBzip2(packed, size, unpacked);
  if (compression == "lz4") return UnpackLz4(packed, size, unpacked);
  if (compression != "none") return false;
  unpacked->assign(packed.substr(0, size));
  return packed.size() == size;
}

constexpr std::string_view kMagic = "#ROSBAG V2.0\n";
constexpr std::size_t kLongestHeader = std::size_t{1} << 20U;  ///< Of a record; others lie.
constexpr std::size_t kLongestChunk = std::size_t{1} << 30U;   ///< Unpacked.

// Op codes of records.
enum Op : std::uint8_t {
  kMessageData = 2,
  kBagHeader = 3,
  kIndexData = 4,
  kChunk = 5,
  kChunkInfo = 6,
  kConnection = 7,
};

// What stands in the header of a chunk, and in that of a message, only.
constexpr std::string_view kChunkMark = "compression=";
constexpr std::string_view kMessageMark("\4\0\0\0op=\2", 8);

/// A field of a record's header; empty where there is none.
std::string_view FieldOf(std::string_view header, std::string_view name) {
  ByteCursor cursor(header);
  while (!cursor.at_end() && !cursor.failed()) {
    const auto length = cursor.Take<std::uint32_t>();
    const std::string_view field = cursor.TakeBytes(length);
    if (field.size() > name.size() && field[name.size()] == '=' && field.starts_with(name)) {
      return field.substr(name.size() + 1);
    }
  }
  return {};
}

template <typename T>
std::optional<T> NumberOf(std::string_view header, std::string_view name) {
  const std::string_view field = FieldOf(header, name);
  if (field.size() != sizeof(T)) return std::nullopt;
  return LoadNumber<T>(field, 0);
}

/// Whether a header is one: fields that fill it exactly, with an op among them.
bool IsHeader(std::string_view header) {
  ByteCursor cursor(header);
  while (!cursor.at_end() && !cursor.failed()) {
    const auto length = cursor.Take<std::uint32_t>();
    if (cursor.TakeBytes(length).find('=') == std::string_view::npos) return false;
  }
  return !cursor.failed() && NumberOf<std::uint8_t>(header, "op").has_value();
}

/// Where, from `from` on, a record begins in whose header `mark` stands; npos when none does.
/// Headers with a mark are short.
std::size_t FindRecord(std::string_view data, std::string_view mark, std::size_t from) {
  constexpr std::size_t kBefore = 64;  // Of a header, at most, before the mark.
  for (std::size_t at = data.find(mark, from); at != std::string_view::npos;
       at = data.find(mark, at + 1)) {
    for (std::size_t begin = std::max(from, at > kBefore ? at - kBefore : 0); begin + 4 <= at;
         ++begin) {
      const std::size_t size = LoadNumber<std::uint32_t>(data, begin);
      if (size > 2 * kBefore || begin + 4 + size > data.size()) continue;
      if (IsHeader(data.substr(begin + 4, size))) return begin;
    }
  }
  return std::string_view::npos;
}

/// A ROS 1 bag, version 2.0, read from front to back without its index, so that a bag that was
/// never closed, or was cut, gives what it holds.
///
/// A bag is a line `#ROSBAG V2.0`, then records: header length, header (fields of name=value), data
/// length, data. Chunks hold records of messages and connections, plain or compressed by bz2 or
/// lz4. A bag lists its topics as it goes, so it is read twice: once for what it holds.
class Rosbag : public Bag {
 public:
  /// Error: unreadable, or no bag of version 2.0.
  static Result<std::unique_ptr<Bag>> Open(const std::string& path);

  Status Read(const Wants& wants, const Take& take) override {
    ProgressLine line("Converting");
    return ReadAll(
        [&](std::size_t topic, std::int64_t received_ns, std::string_view message) {
          if (wants(topic)) take(topic, received_ns, message);
        },
        line.callback());
  }

  std::map<std::string, std::uint64_t> Damage() const override {
    return {{"incomplete chunks", damaged_chunks_}, {"incomplete records", damaged_records_}};
  }

 private:
  struct Record {
    std::string_view header;
    std::string_view data;
  };
  explicit Rosbag(std::string path) : path_(std::move(path)) {}

  Status ReadAll(const Take& take, const std::function<void(double)>& progress);
  void ReadChunk(std::string_view compression, std::uint32_t size, std::string_view data);
  void ReadRecords(std::string_view data);
  void TakeConnection(const Record& record);
  void TakeMessage(const Record& record);
  bool FindNextRecord();

  std::string path_;
  std::unique_ptr<ByteStream> bytes_;
  std::map<std::uint32_t, std::size_t> connections_;  ///< To topics_.
  const Take* take_ = nullptr;
  std::string unpacked_;
  bool has_unknown_connection_ = false;
  std::uint64_t damaged_chunks_ = 0;
  std::uint64_t damaged_records_ = 0;
  std::uint64_t skipped_bytes_ = 0;  ///< Of no whole record.
};

Result<std::unique_ptr<Bag>> Rosbag::Open(const std::string& path) {
  std::unique_ptr<Rosbag> bag(new Rosbag(path));
  TRUETRIAD_RETURN_IF_ERROR(bag->ReadAll([](std::size_t, std::int64_t, std::string_view) {}, {}));
  if (bag->damaged_chunks_ + bag->damaged_records_ > 0) {
    Note(path + ": damaged: " + Count(bag->damaged_chunks_, "chunk", "chunks") + " and " +
         Count(bag->damaged_records_, "record", "records") + " incomplete, " +
         Count(bag->skipped_bytes_, "byte", "bytes") + " skipped");
  }
  return std::unique_ptr<Bag>(std::move(bag));
}

/// Reads the bag to its end; the topics that it has met before stay known.
Status Rosbag::ReadAll(const Take& take, const std::function<void(double)>& progress) {
  TRUETRIAD_ASSIGN_OR_RETURN(bytes_, ByteStream::Open(path_));
  const std::string_view beginning = bytes_->Peek(kMagic.size());
  if (beginning != kMagic) {
    const bool is_other = beginning.starts_with("#ROS");
    return Error(ErrorCode::kWrongFormat,
                 path_ + (is_other ? ": is a bag of a version other than 2.0; update it "
                                     "with `rosbag fix` or `rosbag migrate`"
                                   : ": is not a ROS 1 bag (.bag): it does not begin with "
                                     "#ROSBAG V2.0"));
  }
  bytes_->Skip(kMagic.size());
  take_ = &take;
  damaged_chunks_ = damaged_records_ = skipped_bytes_ = 0;
  constexpr std::size_t kLength = sizeof(std::uint32_t);  // Of header and data.
  while (!bytes_->at_end()) {
    if (progress) progress(bytes_->progress());
    // The header first, then, where it is one, the data.
    std::string_view ahead = bytes_->Peek(kLength);
    const std::size_t header_size =
        ahead.size() == kLength ? LoadNumber<std::uint32_t>(ahead, 0) : kLongestHeader + 1;
    if (header_size <= kLongestHeader) ahead = bytes_->Peek(kLength + header_size + kLength);
    if (header_size > kLongestHeader || ahead.size() < kLength + header_size + kLength ||
        !IsHeader(ahead.substr(kLength, header_size))) {
      if (!FindNextRecord()) break;
      continue;
    }
    const std::string header(ahead.substr(kLength, header_size));
    const std::uint64_t data_size = LoadNumber<std::uint32_t>(ahead, kLength + header_size);
    const std::uint8_t op = *NumberOf<std::uint8_t>(header, "op");
    const bool is_whole = data_size <= bytes_->left() - (kLength + header_size + kLength);
    if (!is_whole && op != kChunk) {
      if (!FindNextRecord()) break;
      continue;
    }
    bytes_->Skip(kLength + header_size + kLength);
    const bool wanted = op == kChunk || op == kConnection || op == kMessageData;
    if (!wanted || data_size > ByteStream::kLookAhead) {
      if (wanted) ++(op == kChunk ? damaged_chunks_ : damaged_records_);
      bytes_->Skip(data_size);
      continue;
    }
    const std::string_view data = bytes_->Peek(static_cast<std::size_t>(data_size));
    if (op == kChunk) {
      ReadChunk(FieldOf(header, "compression"),
                NumberOf<std::uint32_t>(header, "size").value_or(0),
                data);
    } else if (op == kConnection) {
      TakeConnection({header, data});
    } else {
      TakeMessage({header, data});
    }
    bytes_->Skip(data_size);
  }
  // The index at the end may name what the beginning had lost.
  for (Topic& topic : topics_) topic.is_counted = !has_unknown_connection_;
  return {};
}

/// Goes on to the next chunk, or message of one that is not packed, after damage.
bool Rosbag::FindNextRecord() {
  // A header that the window cuts in two is found in the next.
  constexpr std::size_t kWindow = std::size_t{1} << 16U, kOverlap = 256;
  ++damaged_records_;
  bytes_->Skip(1);
  ++skipped_bytes_;
  while (!bytes_->at_end()) {
    const std::string_view ahead = bytes_->Peek(kWindow);
    const std::size_t begin =
        std::min(FindRecord(ahead, kChunkMark, 0), FindRecord(ahead, kMessageMark, 0));
    const bool is_found = begin != std::string_view::npos;
    const std::size_t skip = is_found                  ? begin
                             : ahead.size() > kOverlap ? ahead.size() - kOverlap
                                                       : ahead.size();
    skipped_bytes_ += skip;
    bytes_->Skip(skip);
    if (is_found) return true;
  }
  return false;
}

void Rosbag::ReadChunk(std::string_view compression, std::uint32_t size, std::string_view data) {
  if (size > kLongestChunk) {
    ++damaged_chunks_;
    return;
  }
  if (!Unpack(compression, data, size, &unpacked_)) ++damaged_chunks_;
  ReadRecords(unpacked_);
}

void Rosbag::ReadRecords(std::string_view data) {
  ByteCursor cursor(data);
  while (!cursor.at_end()) {
    const std::string_view rest = cursor.left();
    const std::string_view header = cursor.TakeBytes(cursor.Take<std::uint32_t>());
    const std::string_view body = cursor.TakeBytes(cursor.Take<std::uint32_t>());
    if (cursor.failed() || !IsHeader(header)) {
      // On to the next message; what lies between is lost.
      ++damaged_records_;
      const std::size_t next = FindRecord(rest, kMessageMark, 1);
      if (next == std::string_view::npos) return;
      skipped_bytes_ += next;
      cursor = ByteCursor(rest.substr(next));
      continue;
    }
    const std::uint8_t op = *NumberOf<std::uint8_t>(header, "op");
    if (op == kConnection) TakeConnection({header, body});
    if (op == kMessageData) TakeMessage({header, body});
  }
}

void Rosbag::TakeConnection(const Record& record) {
  const std::optional<std::uint32_t> connection = NumberOf<std::uint32_t>(record.header, "conn");
  const std::string name(FieldOf(record.header, "topic"));
  const std::string type(FieldOf(record.data, "type"));
  if (!connection || name.empty() || type.empty()) {
    ++damaged_records_;
    return;
  }
  // Several publishers of a topic are connections of their own; the index repeats them.
  const auto found = std::find_if(topics_.begin(), topics_.end(), [&](const Topic& topic) {
    return topic.name == name && topic.type == type;
  });
  const auto index = static_cast<std::size_t>(found - topics_.begin());
  if (found == topics_.end()) {
    topics_.push_back({.name = name, .type = type});
    topics_.back().definition = FieldOf(record.data, "message_definition");
  }
  connections_.emplace(*connection, index);
}

void Rosbag::TakeMessage(const Record& record) {
  const std::optional<std::uint32_t> connection = NumberOf<std::uint32_t>(record.header, "conn");
  const std::string_view time = FieldOf(record.header, "time");
  const auto known = connection ? connections_.find(*connection) : connections_.end();
  if (known == connections_.end() || time.size() != 8) {
    ++damaged_records_;
    has_unknown_connection_ = true;
    return;
  }
  const std::int64_t received_ns =
      LoadNumber<std::uint32_t>(time, 0) * std::int64_t{1'000'000'000} +
      LoadNumber<std::uint32_t>(time, 4);
  Topic& topic = topics_[known->second];
  if (topic.messages++ == 0) topic.first_ns = received_ns;
  topic.last_ns = std::max(topic.last_ns, received_ns);
  (*take_)(known->second, received_ns, record.data);
}

constexpr BagFormat kFormat = {.converter = "ros1",
                               .input = "a ROS 1 bag (.bag, version 2.0)",
                               .source = "ros1-bag",
                               .ending = ".bag",
                               .encoding = Encoding::kRos1,
                               .open = Rosbag::Open};

}  // namespace
}  // namespace truetriad::convert

int main(int argc, char** argv) {
  return truetriad::convert::RunBagConverter(truetriad::convert::kFormat, argc, argv);
}
