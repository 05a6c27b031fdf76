// SPDX-License-Identifier: Apache-2.0
#include "tools/convert/ros1/rosbag.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "tools/convert/common/byte_cursor.h"
#include "tools/convert/ros1/unpack.h"

namespace truetriad::convert {
namespace {

constexpr std::string_view kMagic = "#ROSBAG V2.0\n";
constexpr std::size_t kLongestHeader = std::size_t{1} << 20U;
constexpr std::size_t kLongestChunk = std::size_t{1} << 30U;  ///< Unpacked.

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

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

/// x, y, z and a covariance, whose first entry is -1 where there is no reading.
void TakeVector(ByteCursor* cursor, bool with_covariance, double* vector) {
  for (int axis = 0; axis < 3; ++axis) vector[axis] = cursor->Take<double>();
  if (!with_covariance) return;
  if (cursor->Take<double>() == -1.0) vector[0] = vector[1] = vector[2] = kNone;
  for (int i = 1; i < 9; ++i) cursor->Take<double>();
}

}  // namespace

/// One record inside a chunk or of the bag itself.
struct Rosbag::Record {
  std::string_view header;
  std::string_view data;
};

Result<std::unique_ptr<Rosbag>> Rosbag::Open(const std::string& path) {
  TRUETRIAD_ASSIGN_OR_RETURN(std::unique_ptr<ByteStream> bytes, ByteStream::Open(path));
  const std::string_view beginning = bytes->Peek(kMagic.size());
  if (beginning != kMagic) {
    const bool is_other = beginning.starts_with("#ROS");
    return Error(ErrorCode::kWrongFormat,
                 path + (is_other ? ": is a bag of a version other than 2.0; update it "
                                    "with `rosbag fix` or `rosbag migrate`"
                                  : ": is not a ROS 1 bag (.bag): it does not begin with "
                                    "#ROSBAG V2.0"));
  }
  bytes->Skip(kMagic.size());
  return std::unique_ptr<Rosbag>(new Rosbag(std::move(bytes)));
}

void Rosbag::Read(const std::function<void(const Message&)>& consume,
                  const std::function<void(double)>& progress) {
  consume_ = &consume;
  constexpr std::size_t kLength = sizeof(std::uint32_t);
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
}

/// Goes on to the next chunk, or message of one that is not packed, after damage.
bool Rosbag::FindNextRecord() {
  constexpr std::size_t kWindow = std::size_t{1} << 16U;
  constexpr std::size_t kOverlap =
      256;  // A header that the window cuts in two is found in the next.
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
  Message message;
  message.topic = known->second;
  message.received_ns =
      StampNs(LoadNumber<std::uint32_t>(time, 0), LoadNumber<std::uint32_t>(time, 4));
  message.data = record.data;
  Topic& topic = topics_[message.topic];
  if (topic.messages++ == 0) topic.first_ns = message.received_ns;
  topic.last_ns = std::max(topic.last_ns, message.received_ns);
  (*consume_)(message);
}

void Rosbag::UseConnectionsOf(const Rosbag& other) {
  connections_ = other.connections_;
  topics_ = other.topics_;
  for (Topic& topic : topics_) topic.messages = 0;
}

std::optional<ImuMessage> ReadRos1Message(Role role, std::string_view data) {
  ByteCursor cursor(data);
  ImuMessage message;
  cursor.Take<std::uint32_t>();  // Sequence number.
  const auto seconds = cursor.Take<std::uint32_t>();
  const auto nanoseconds = cursor.Take<std::uint32_t>();
  message.stamp_ns = StampNs(seconds, nanoseconds);
  message.frame = cursor.TakeBytes(cursor.Take<std::uint32_t>());
  if (role == Role::kImu) {
    for (int i = 0; i < 4 + 9; ++i) cursor.Take<double>();  // Orientation and its covariance.
    TakeVector(&cursor, true, message.values.data());
    TakeVector(&cursor, true, message.values.data() + 3);
  } else if (role == Role::kMagneticField) {
    TakeVector(&cursor, false, message.values.data());
  } else {
    message.values[0] = cursor.Take<double>();
  }
  return cursor.failed() ? std::nullopt : std::optional(message);
}

}  // namespace truetriad::convert
