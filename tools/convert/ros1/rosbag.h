// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tools/convert/common/byte_stream.h"
#include "tools/convert/ros/imu_log.h"
#include "truetriad/base/result.h"

namespace truetriad::convert {

/// A ROS 1 bag, version 2.0, read from front to back without its index, so that a bag that was
/// never closed, or was cut, gives what it holds.
///
/// A bag is a line `#ROSBAG V2.0`, then records: header length, header (fields of name=value), data
/// length, data. Chunks hold records of messages and connections, plain or compressed by bz2 or
/// lz4.
class Rosbag {
 public:
  /// Error: unreadable, or no bag of version 2.0.
  static Result<std::unique_ptr<Rosbag>> Open(const std::string& path);

  struct Message {
    std::size_t topic = 0;  ///< In topics().
    std::int64_t received_ns = 0;
    std::string_view data;  ///< Serialised; valid during the call.
  };
  /// Reads the bag to its end, once. `consume` gets each message; `progress` the share read.
  void Read(const std::function<void(const Message&)>& consume,
            const std::function<void(double)>& progress);

  /// Takes over what an earlier reading of the same bag found out, before this one begins.
  void UseConnectionsOf(const Rosbag& other);

  /// Topics of the connections met so far, with how often.
  const std::vector<Topic>& topics() const { return topics_; }

  std::uint64_t damaged_chunks() const { return damaged_chunks_; }
  std::uint64_t damaged_records() const { return damaged_records_; }
  std::uint64_t skipped_bytes() const { return skipped_bytes_; }  ///< Of no whole record.

 private:
  struct Record;
  explicit Rosbag(std::unique_ptr<ByteStream> bytes) : bytes_(std::move(bytes)) {}

  void ReadChunk(std::string_view compression, std::uint32_t size, std::string_view data);
  void ReadRecords(std::string_view data);
  void TakeConnection(const Record& record);
  void TakeMessage(const Record& record);
  bool FindNextRecord();

  std::unique_ptr<ByteStream> bytes_;
  std::vector<Topic> topics_;
  std::map<std::uint32_t, std::size_t> connections_;  ///< To topics_.
  const std::function<void(const Message&)>* consume_ = nullptr;
  std::string unpacked_;
  bool has_unknown_connection_ = false;
  std::uint64_t damaged_chunks_ = 0;
  std::uint64_t damaged_records_ = 0;
  std::uint64_t skipped_bytes_ = 0;
};

/// Reads a message of sensor_msgs as ROS 1 serialises it: fields one after another, little-endian.
std::optional<ImuMessage> ReadRos1Message(Role role, std::string_view data);

}  // namespace truetriad::convert
