// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "tools/convert/common/byte_stream.h"
#include "tools/convert/ros/bag_recording.h"

namespace truetriad::convert {

/// A bag of records, each with a head and a body; chunks hold further records, often compressed.
///
/// The bag is read sequentially without its index, so that unclosed and truncated bags can be used.
/// Topics are defined between messages. The bag is therefore read twice, first for the topics.
class ChunkedBag : public Bag {
 public:
  Status Read(const Wants& wants, const Take& take) final;
  std::map<std::string, std::uint64_t> Damage() const final;

 protected:
  explicit ChunkedBag(std::string path) : path_(std::move(path)) {}

  /// Reads the topics of the bag. Error: unreadable, or another format.
  Status Survey();

  enum class Kind { kOther, kChunk, kTaken, kEnd };
  struct Head {
    Kind kind = Kind::kOther;
    std::uint8_t op = 0;     ///< The record type of the format.
    std::size_t size = 0;    ///< Bytes of the head.
    std::uint64_t body = 0;  ///< Bytes after the head.
  };
  struct Chunk {
    std::string_view compression;  ///< "bz2", "lz4" or "zstd"; "none" or "": not compressed.
    std::string_view data;
    std::uint64_t size = 0;  ///< Bytes after unpacking.
    std::uint32_t crc = 0;   ///< CRC-32 of the unpacked data; 0: not stated.
  };

  /// Adds a topic with the id `connection`; a known id keeps its topic.
  void AddTopic(std::uint32_t connection, const Topic& topic);
  /// Passes on a message. False: no topic has the id `connection`.
  bool AddMessage(std::uint32_t connection, std::int64_t received_ns, std::string_view message);

  std::string path_;
  std::map<std::uint32_t, std::size_t> connections_;  ///< Indices in topics_, by id.

 private:
  /// Skips the beginning of the file. Error: another format.
  virtual Status TakeMagic(ByteStream* bytes) const = 0;
  /// The head of the record at the beginning of `bytes`; nullopt: no record begins there.
  virtual std::optional<Head> HeadIn(std::string_view bytes) const = 0;
  /// The first position in `bytes` of an unambiguous record; npos: none.
  virtual std::size_t FindRecord(std::string_view bytes) const = 0;
  virtual Chunk ChunkIn(const Head& head, std::string_view record) const = 0;
  /// Takes a complete record of Kind::kTaken with its head. False: it is damaged.
  virtual bool TakeRecord(const Head& head, std::string_view record) = 0;

  Status ReadAll(const Take& take, const std::function<void(double)>& progress);
  void ReadRecords(ByteStream* bytes, bool in_chunk, const std::function<void(double)>& progress);
  void ReadChunk(const Chunk& chunk, bool is_whole);
  bool GoOn(ByteStream* bytes);

  const Take* take_ = nullptr;
  bool has_unknown_connection_ = false;
  std::uint64_t damaged_chunks_ = 0;
  std::uint64_t damaged_records_ = 0;
  std::uint64_t skipped_bytes_ = 0;  ///< Bytes outside complete records.
};

}  // namespace truetriad::convert
