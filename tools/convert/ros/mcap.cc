// SPDX-License-Identifier: Apache-2.0
//
// Converts ROS 2 bags in MCAP to a recording. docs/converting.md.
#include <algorithm>
#include <cstdint>
#include <limits>
#include <map>
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

constexpr std::string_view kMagic("\x89MCAP0\r\n", 8);
constexpr std::size_t kHeadSize = 9;  // Op code and length.

// Op codes of records.
enum Op : std::uint8_t {
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunkRecord = 0x06,
  kDataEnd = 0x0f,  // The last op code of the format itself.
  kFirstOfOthers = 0x80,
};

std::string_view TakeText(ByteCursor* cursor) {
  return cursor->TakeBytes(cursor->Take<std::uint32_t>());
}

class Mcap : public ChunkedBag {
 public:
  /// Error: unreadable, or not an MCAP file.
  static Result<std::unique_ptr<Bag>> Open(const std::string& path) {
    std::unique_ptr<Mcap> bag(new Mcap(path));
    TRUETRIAD_RETURN_IF_ERROR(bag->Survey());
    std::sort(bag->topics_.begin(), bag->topics_.end(), [](const Topic& a, const Topic& b) {
      return a.name < b.name;
    });
    bag->connections_.clear();  // Channels precede their messages and are read again.
    return std::unique_ptr<Bag>(std::move(bag));
  }

 private:
  struct Schema {
    std::string name, encoding, text;
  };
  using ChunkedBag::ChunkedBag;

  Status TakeMagic(ByteStream* bytes) const override {
    if (bytes->Peek(kMagic.size()) != kMagic) {
      return Error(ErrorCode::kWrongFormat,
                   {path_},
                   "does not start like an MCAP file; it is another format, or its start is "
                   "missing");
    }
    bytes->Skip(kMagic.size());
    return {};
  }

  std::optional<Head> HeadIn(std::string_view bytes) const override {
    if (bytes.size() < kHeadSize) return std::nullopt;
    const auto op = static_cast<std::uint8_t>(bytes[0]);
    Head head{.op = op, .size = kHeadSize, .body = LoadNumber<std::uint64_t>(bytes, 1)};
    if (op == 0 || (op > kDataEnd && op < kFirstOfOthers)) return std::nullopt;
    if (op == kFooter || op == kDataEnd) head.kind = Kind::kEnd;
    if (op == kSchema || op == kChannel || op == kMessage) head.kind = Kind::kTaken;
    if (op != kChunkRecord) return head;
    head.kind = Kind::kChunk;
    // A chunk states its length twice, and both must agree.
    constexpr std::size_t kFixed = 40;  // Times, size, CRC-32, and two lengths.
    ByteCursor cursor(bytes.substr(kHeadSize));
    cursor.TakeBytes(kFixed - 12);
    const std::size_t compression = TakeText(&cursor).size();
    const auto data = cursor.Take<std::uint64_t>();
    if (cursor.failed() || head.body - kFixed - compression != data) return std::nullopt;
    return head;
  }

  std::size_t FindRecord(std::string_view bytes) const override {
    for (std::size_t at = bytes.find(kChunkRecord); at != std::string_view::npos;
         at = bytes.find(kChunkRecord, at + 1)) {
      if (HeadIn(bytes.substr(at))) return at;
    }
    return std::string_view::npos;
  }

  Chunk ChunkIn(const Head& head, std::string_view record) const override {
    ByteCursor cursor(record.substr(head.size));
    cursor.TakeBytes(16);  // Times of the chunk's first and last message.
    Chunk chunk;
    chunk.size = cursor.Take<std::uint64_t>();
    chunk.crc = cursor.Take<std::uint32_t>();
    chunk.compression = TakeText(&cursor);
    cursor.Take<std::uint64_t>();
    chunk.data = cursor.left();
    return chunk;
  }

  bool TakeRecord(const Head& head, std::string_view record) override {
    ByteCursor cursor(record.substr(head.size));
    const auto id = cursor.Take<std::uint16_t>();
    if (head.op == kSchema) {
      Schema schema;
      for (std::string* const text : {&schema.name, &schema.encoding, &schema.text})
        *text = TakeText(&cursor);
      if (!cursor.failed()) schemas_.emplace(id, std::move(schema));
    } else if (head.op == kChannel) {
      const auto schema = schemas_.find(cursor.Take<std::uint16_t>());
      const std::string topic(TakeText(&cursor)), encoding(TakeText(&cursor));
      if (!cursor.failed())
        AddTopic(id,
                 TopicOf(topic, encoding, schema == schemas_.end() ? Schema() : schema->second));
    } else {
      cursor.Take<std::uint32_t>();  // The message's sequence number.
      // A damaged time may exceed a signed 64-bit integer.
      constexpr std::uint64_t kLast = std::numeric_limits<std::int64_t>::max();
      const auto logged_ns = std::min(cursor.Take<std::uint64_t>(), kLast);
      cursor.Take<std::uint64_t>();  // Time of publication.
      return !cursor.failed() &&
             AddMessage(id, static_cast<std::int64_t>(logged_ns), cursor.left());
    }
    return !cursor.failed();
  }

  /// If a topic is not of ROS 2, its type is a text that says so.
  static Topic TopicOf(const std::string& name, const std::string& encoding, const Schema& schema) {
    const bool is_defined = schema.encoding == "ros2msg";
    const bool is_ros2 = encoding == "cdr" && (is_defined || schema.encoding == "ros2idl");
    return {.name = name,
            .type = is_ros2 ? schema.name
                            : (schema.name.empty() ? "nothing" : schema.name) + " as " + encoding +
                                  ", not ROS 2 (CDR)",
            .definition = is_defined ? schema.text : ""};
  }

  std::map<std::uint16_t, Schema> schemas_;
};

constexpr BagFormat kFormat = {.converter = "mcap",
                               .source = "mcap",
                               .ending = ".mcap",
                               .encoding = Encoding::kCdr,
                               .open = Mcap::Open};

}  // namespace
}  // namespace truetriad::convert

int main(int argc, char** argv) {
  return truetriad::convert::RunBagConverter(truetriad::convert::kFormat, argc, argv);
}
