// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tools/convert/common/byte_stream.h"
#include "truetriad/base/result.h"

namespace truetriad::convert {

/// One field of a message. Type letters are those of ArduPilot's AP_Logger/LogStructure.h.
struct MessageField {
  std::string name;
  char letter = '\0';
  std::size_t offset = 0;  ///< From the record's first byte.
};

/// One kind of message, as defined by the log itself.
struct MessageFormat {
  int type = 0;
  std::string name;
  std::size_t length = 0;  ///< Bytes of a whole record, with its header.
  std::vector<MessageField> fields;

  const MessageField* Find(std::string_view field) const;
};

/// The value of a numeric field; NaN for text.
double NumberIn(const MessageField& field, std::string_view record);
/// The value of an integer field; nullopt for others.
std::optional<std::uint64_t> IntegerIn(const MessageField& field, std::string_view record);
/// The characters of a text field up to its first NUL.
std::string_view TextIn(const MessageField& field, std::string_view record);

/// An ArduPilot DataFlash log, record by record: A3 95 type body; messages of type 128 (FMT) define
/// the others.
///
/// A record counts as complete if it has the magic bytes and a defined type, and if another
/// record's magic bytes or the end of the log follow. After damage, reading continues at the next
/// complete record.
class DataflashLog {
 public:
  /// Error: unreadable, or no definition of a message in the first MiB.
  static Result<std::unique_ptr<DataflashLog>> Open(const std::string& path);

  struct Record {
    const MessageFormat* format = nullptr;  ///< Null at the end.
    std::string_view bytes;                 ///< Valid until the next call.
  };
  Record Next();

  std::uint64_t records() const { return records_; }
  std::uint64_t skipped_bytes() const { return skipped_bytes_; }  ///< Bytes outside records.
  std::uint64_t damages() const { return damages_; }  ///< Number of places with such bytes.
  double progress() const { return bytes_->progress(); }
  /// Position of a second log in the file; 0: none.
  std::uint64_t next_log() const { return next_log_; }
  /// Whether the file could not be read to its end.
  bool read_failed() const { return bytes_->read_failed(); }

 private:
  explicit DataflashLog(std::unique_ptr<ByteStream> bytes);
  /// The length of the complete record at the beginning of `ahead`; 0: there is none.
  std::size_t WholeRecord(std::string_view ahead) const;
  void Describe(std::string_view record);

  std::unique_ptr<ByteStream> bytes_;
  std::array<std::unique_ptr<MessageFormat>, 256> formats_;
  std::uint64_t records_ = 0;
  std::uint64_t skipped_bytes_ = 0;
  std::uint64_t damages_ = 0;
  std::uint64_t read_bytes_ = 0, next_log_ = 0;
  bool has_begun_ = false;  ///< The definition of FMT, with which a log begins, was read.
  bool in_damage_ = false;
};

}  // namespace truetriad::convert
