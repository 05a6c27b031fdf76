// SPDX-License-Identifier: Apache-2.0
//
// Converts ROS 1 bags (.bag) to a recording. docs/converting.md.
#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "tools/convert/common/byte_stream.h"
#include "tools/convert/ros/bag_recording.h"
#include "tools/convert/ros/chunked_bag.h"

namespace truetriad::convert {
namespace {

constexpr std::string_view kMagic = "#ROSBAG V2.0\n";
constexpr std::size_t kLength = sizeof(std::uint32_t);  // Bytes of a stated length.

// Op codes of records.
enum Op : std::uint8_t {
  kMessageData = 2,
  kBagHeader = 3,
  kIndexData = 4,
  kChunkData = 5,
  kChunkInfo = 6,
  kConnection = 7,
};

// The first text occurs only in the header of a chunk, the second only in that of a message.
constexpr std::string_view kChunkMark = "compression=";
constexpr std::string_view kMessageMark("\4\0\0\0op=\2", 8);

/// A field of a record's header; empty if missing.
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

/// Whether the header consists of whole fields, one of which is `op`.
bool IsHeader(std::string_view header) {
  ByteCursor cursor(header);
  while (!cursor.at_end() && !cursor.failed()) {
    const auto length = cursor.Take<std::uint32_t>();
    if (cursor.TakeBytes(length).find('=') == std::string_view::npos) return false;
  }
  return !cursor.failed() && NumberOf<std::uint8_t>(header, "op").has_value();
}

/// The position of a record whose short header contains `mark`; npos: none.
std::size_t FindMark(std::string_view data, std::string_view mark) {
  constexpr std::size_t kBefore = 64;  // Most bytes of such a header before the mark.
  for (std::size_t at = data.find(mark); at != std::string_view::npos;
       at = data.find(mark, at + 1)) {
    for (std::size_t begin = at > kBefore ? at - kBefore : 0; begin + kLength <= at; ++begin) {
      const std::size_t size = LoadNumber<std::uint32_t>(data, begin);
      if (size > 2 * kBefore || begin + kLength + size > data.size()) continue;
      if (IsHeader(data.substr(begin + kLength, size))) return begin;
    }
  }
  return std::string_view::npos;
}

/// A ROS 1 bag, version 2.0: a line `#ROSBAG V2.0`, then records of header length, header (fields
/// name=value), data length and data.
class Rosbag : public ChunkedBag {
 public:
  /// Error: unreadable, or not a bag of version 2.0.
  static Result<std::unique_ptr<Bag>> Open(const std::string& path) {
    std::unique_ptr<Rosbag> bag(new Rosbag(path));
    TRUETRIAD_RETURN_IF_ERROR(bag->Survey());
    return std::unique_ptr<Bag>(std::move(bag));
  }

 private:
  using ChunkedBag::ChunkedBag;

  static std::string_view HeaderIn(const Head& head, std::string_view record) {
    return record.substr(kLength, head.size - 2 * kLength);
  }

  Status TakeMagic(ByteStream* bytes) const override {
    const std::string_view beginning = bytes->Peek(kMagic.size());
    if (beginning != kMagic) {
      const bool is_other = beginning.starts_with("#ROS");
      return Error(ErrorCode::kWrongFormat,
                   path_ + (is_other ? ": is a bag of a version other than 2.0; update it "
                                       "with `rosbag fix` or `rosbag migrate`"
                                     : ": is not a ROS 1 bag (.bag): it does not begin with "
                                       "#ROSBAG V2.0"));
    }
    bytes->Skip(kMagic.size());
    return {};
  }

  std::optional<Head> HeadIn(std::string_view bytes) const override {
    ByteCursor cursor(bytes);
    const std::string_view header = cursor.TakeBytes(cursor.Take<std::uint32_t>());
    const std::uint64_t body = cursor.Take<std::uint32_t>();
    if (cursor.failed() || !IsHeader(header)) return std::nullopt;
    Head head{.op = *NumberOf<std::uint8_t>(header, "op"),
              .size = header.size() + 2 * kLength,
              .body = body};
    if (head.op == kChunkData) head.kind = Kind::kChunk;
    if (head.op == kConnection || head.op == kMessageData) head.kind = Kind::kTaken;
    return head;
  }

  std::size_t FindRecord(std::string_view bytes) const override {
    return std::min(FindMark(bytes, kChunkMark), FindMark(bytes, kMessageMark));
  }

  Chunk ChunkIn(const Head& head, std::string_view record) const override {
    const std::string_view header = HeaderIn(head, record);
    return {.compression = FieldOf(header, "compression"),
            .data = record.substr(head.size),
            .size = NumberOf<std::uint32_t>(header, "size").value_or(0)};
  }

  bool TakeRecord(const Head& head, std::string_view record) override {
    const std::string_view header = HeaderIn(head, record), data = record.substr(head.size);
    const std::optional<std::uint32_t> connection = NumberOf<std::uint32_t>(header, "conn");
    if (head.op == kConnection) {
      const Topic topic{.name = std::string(FieldOf(header, "topic")),
                        .type = std::string(FieldOf(data, "type")),
                        .definition = std::string(FieldOf(data, "message_definition"))};
      const bool is_good = connection && !topic.name.empty() && !topic.type.empty();
      if (is_good) AddTopic(*connection, topic);
      return is_good;
    }
    const std::string_view time = FieldOf(header, "time");
    if (!connection || time.size() != 2 * sizeof(std::uint32_t)) return false;
    constexpr std::int64_t kNsPerSecond = 1'000'000'000;  // The time is in seconds and nanoseconds.
    return AddMessage(*connection,
                      LoadNumber<std::uint32_t>(time, 0) * kNsPerSecond +
                          LoadNumber<std::uint32_t>(time, sizeof(std::uint32_t)),
                      data);
  }
};

constexpr BagFormat kFormat = {.converter = "ros1",
                               .source = "ros1-bag",
                               .ending = ".bag",
                               .encoding = Encoding::kRos1,
                               .open = Rosbag::Open};

}  // namespace
}  // namespace truetriad::convert

int main(int argc, char** argv) {
  return truetriad::convert::RunBagConverter(truetriad::convert::kFormat, argc, argv);
}
