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

/// A bag of records, each a head and a body, of which chunks hold others, plain or packed.
///
/// It is read from front to back without its index, so that a bag that was never closed, or was
/// cut, gives what it holds. A bag lists its topics as it goes, so it is read twice: once for what
/// it holds.
class ChunkedBag : public Bag {
 public:
  Status Read(const Wants& wants, const Take& take) final;
  std::map<std::string, std::uint64_t> Damage() const final;

 protected:
  explicit ChunkedBag(std::string path) : path_(std::move(path)) {}

  /// Reads the bag for its topics. Error: unreadable, or of another format.
  Status Survey();

  enum class Kind { kOther, kChunk, kTaken, kEnd };
  struct Head {
    Kind kind = Kind::kOther;
    std::uint8_t op = 0;     ///< As the format counts its records.
    std::size_t size = 0;    ///< Of the head.
    std::uint64_t body = 0;  ///< Bytes behind the head.
  };
  struct Chunk {
    std::string_view compression;  ///< "" and "none", bz2, lz4 or zstd.
    std::string_view data;
    std::uint64_t size = 0;  ///< Unpacked.
    std::uint32_t crc = 0;   ///< CRC-32 of what is unpacked; 0: not stated.
  };

  /// Of a topic that messages call `connection`; one that is known stays.
  void AddTopic(std::uint32_t connection, const Topic& topic);
  /// False where no topic has that number.
  bool AddMessage(std::uint32_t connection, std::int64_t received_ns, std::string_view message);

  std::string path_;
  std::map<std::uint32_t, std::size_t> connections_;  ///< To topics_.

 private:
  /// Passes over what the file begins with. Error: it is another format.
  virtual Status TakeMagic(ByteStream* bytes) const = 0;
  /// The head of the record that begins with `bytes`; nullopt: none begins there.
  virtual std::optional<Head> HeadIn(std::string_view bytes) const = 0;
  /// Where in `bytes` a record begins that is told from chance; npos: nowhere.
  virtual std::size_t FindRecord(std::string_view bytes) const = 0;
  virtual Chunk ChunkIn(const Head& head, std::string_view record) const = 0;
  /// Of Kind::kTaken, a whole record with its head. False: it is damaged.
  virtual bool TakeRecord(const Head& head, std::string_view record) = 0;

  Status ReadAll(const Take& take, const std::function<void(double)>& progress);
  void ReadRecords(ByteStream* bytes, bool in_chunk, const std::function<void(double)>& progress);
  void ReadChunk(const Chunk& chunk, bool is_whole);
  bool GoOn(ByteStream* bytes);

  const Take* take_ = nullptr;
  bool has_unknown_connection_ = false;
  std::uint64_t damaged_chunks_ = 0;
  std::uint64_t damaged_records_ = 0;
  std::uint64_t skipped_bytes_ = 0;  ///< Of no whole record.
};

}  // namespace truetriad::convert
