// SPDX-License-Identifier: Apache-2.0
#include "tools/convert/dataflash/dataflash_log.h"

#include <limits>
#include <utility>

#include "tools/convert/common/byte_cursor.h"

namespace truetriad::convert {
namespace {

constexpr char kMagic0 = '\xA3';
constexpr char kMagic1 = '\x95';
constexpr int kFormatType = 128;
constexpr std::size_t kHeader = 3;
constexpr std::size_t kLongestRecord = 255;  // The length is one byte of FMT.

/// Bytes of a field; 0 for a letter that is not known.
std::size_t SizeOf(char letter) {
  switch (letter) {
    case 'b':
    case 'B':
    case 'M':
      return 1;
    case 'h':
    case 'H':
    case 'c':
    case 'C':
    case 'g':
      return 2;
    case 'i':
    case 'I':
    case 'e':
    case 'E':
    case 'L':
    case 'f':
    case 'n':
      return 4;
    case 'q':
    case 'Q':
    case 'd':
      return 8;
    case 'N':
      return 16;
    case 'Z':
    case 'a':
      return 64;
    default:
      return 0;
  }
}

std::string_view UpToNul(std::string_view text) { return text.substr(0, text.find('\0')); }

bool IsName(std::string_view name) {
  if (name.empty()) return false;
  for (const char c : name) {
    const bool known =
        (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_';
    if (!known) return false;
  }
  return true;
}

/// Format, name, letters and labels of an FMT record: type, length, name[4], letters[16],
/// labels[64]. Null when they contradict each other.
std::unique_ptr<MessageFormat> ParseFormat(std::string_view record) {
  ByteCursor cursor(record.substr(kHeader));
  auto format = std::make_unique<MessageFormat>();
  format->type = cursor.Take<std::uint8_t>();
  format->length = cursor.Take<std::uint8_t>();
  format->name = UpToNul(cursor.TakeBytes(4));
  const std::string_view letters = UpToNul(cursor.TakeBytes(16));
  std::string_view labels = UpToNul(cursor.TakeBytes(64));
  if (!IsName(format->name)) return nullptr;
  std::size_t offset = kHeader;
  for (const char letter : letters) {
    const std::size_t comma = labels.find(',');
    const std::size_t size = SizeOf(letter);
    if (size == 0) return nullptr;
    format->fields.push_back({std::string(labels.substr(0, comma)), letter, offset});
    labels.remove_prefix(comma == std::string_view::npos ? labels.size() : comma + 1);
    offset += size;
  }
  return offset == format->length ? std::move(format) : nullptr;
}

}  // namespace

const MessageField* MessageFormat::Find(std::string_view field) const {
  for (const MessageField& candidate : fields) {
    if (candidate.name == field) return &candidate;
  }
  return nullptr;
}

std::optional<std::uint64_t> IntegerIn(const MessageField& field, std::string_view record) {
  switch (field.letter) {
    case 'B':
    case 'M':
      return LoadNumber<std::uint8_t>(record, field.offset);
    case 'H':
      return LoadNumber<std::uint16_t>(record, field.offset);
    case 'I':
      return LoadNumber<std::uint32_t>(record, field.offset);
    case 'Q':
      return LoadNumber<std::uint64_t>(record, field.offset);
    default:
      return std::nullopt;
  }
}

double NumberIn(const MessageField& field, std::string_view record) {
  constexpr double kHundredth = 0.01;
  constexpr double kLatitude = 1e-7;
  switch (field.letter) {
    case 'b':
      return LoadNumber<std::int8_t>(record, field.offset);
    case 'B':
    case 'M':
      return LoadNumber<std::uint8_t>(record, field.offset);
    case 'h':
      return LoadNumber<std::int16_t>(record, field.offset);
    case 'H':
      return LoadNumber<std::uint16_t>(record, field.offset);
    case 'i':
      return LoadNumber<std::int32_t>(record, field.offset);
    case 'I':
      return LoadNumber<std::uint32_t>(record, field.offset);
    case 'q':
      return static_cast<double>(LoadNumber<std::int64_t>(record, field.offset));
    case 'Q':
      return static_cast<double>(LoadNumber<std::uint64_t>(record, field.offset));
    case 'c':
      return kHundredth * LoadNumber<std::int16_t>(record, field.offset);
    case 'C':
      return kHundredth * LoadNumber<std::uint16_t>(record, field.offset);
    case 'e':
      return kHundredth * LoadNumber<std::int32_t>(record, field.offset);
    case 'E':
      return kHundredth * LoadNumber<std::uint32_t>(record, field.offset);
    case 'L':
      return kLatitude * LoadNumber<std::int32_t>(record, field.offset);
    case 'f':
      return static_cast<double>(LoadNumber<float>(record, field.offset));
    case 'd':
      return LoadNumber<double>(record, field.offset);
    default:
      return std::numeric_limits<double>::quiet_NaN();
  }
}

std::string_view TextIn(const MessageField& field, std::string_view record) {
  const bool is_text = field.letter == 'n' || field.letter == 'N' || field.letter == 'Z';
  return is_text ? UpToNul(record.substr(field.offset, SizeOf(field.letter))) : std::string_view();
}

DataflashLog::DataflashLog(std::unique_ptr<ByteStream> bytes) : bytes_(std::move(bytes)) {
  // FMT describes itself too, but has to be known before.
  auto format = std::make_unique<MessageFormat>();
  format->type = kFormatType;
  format->name = "FMT";
  format->length = 89;
  formats_[kFormatType] = std::move(format);
}

Result<std::unique_ptr<DataflashLog>> DataflashLog::Open(const std::string& path) {
  TRUETRIAD_ASSIGN_OR_RETURN(std::unique_ptr<ByteStream> bytes, ByteStream::Open(path));
  constexpr std::size_t kBeginning = std::size_t{1} << 20U;
  const std::string_view beginning = bytes->Peek(kBeginning);
  constexpr std::string_view kFormatHeader = "\xA3\x95\x80";
  if (beginning.find(kFormatHeader) == std::string_view::npos) {
    return Error(
        ErrorCode::kWrongFormat,
        {path},
        "is not an ArduPilot DataFlash log: no FMT record (A3 95 80) near its start; use the "
        "binary .bin from the autopilot, not the text .log or a .tlog");
  }
  return std::unique_ptr<DataflashLog>(new DataflashLog(std::move(bytes)));
}

std::size_t DataflashLog::WholeRecord(std::string_view ahead) const {
  if (ahead.size() < kHeader || ahead[0] != kMagic0 || ahead[1] != kMagic1) return 0;
  const auto& format = formats_[static_cast<std::uint8_t>(ahead[2])];
  if (!format || format->length > ahead.size()) return 0;
  const std::size_t length = format->length;
  if (ahead.size() > length && ahead[length] != kMagic0) return 0;
  if (ahead.size() > length + 1 && ahead[length + 1] != kMagic1) return 0;
  return length;
}

DataflashLog::Record DataflashLog::Next() {
  while (!bytes_->at_end()) {
    const std::string_view ahead = bytes_->Peek(kLongestRecord + 2);
    const std::size_t length = WholeRecord(ahead);
    if (length == 0) {
      if (ahead.empty()) break;
      if (!in_damage_) ++damages_;
      in_damage_ = true;
      const std::size_t next = ahead.find(kMagic0, 1);
      const std::size_t skip = next == std::string_view::npos ? ahead.size() : next;
      skipped_bytes_ += skip;
      bytes_->Skip(skip);
      continue;
    }
    in_damage_ = false;
    ++records_;
    bytes_->Skip(length);
    const std::string_view record = ahead.substr(0, length);
    const auto type = static_cast<std::uint8_t>(record[2]);
    if (type == kFormatType) Describe(record);
    return {formats_[type].get(), record};
  }
  return {};
}

void DataflashLog::Describe(std::string_view record) {
  std::unique_ptr<MessageFormat> format = ParseFormat(record);
  if (!format || format->type == kFormatType) return;
  // The first word counts: a second one for the same type is damaged.
  std::unique_ptr<MessageFormat>& known = formats_[static_cast<std::size_t>(format->type)];
  if (!known) known = std::move(format);
}

const MessageFormat* DataflashLog::Find(std::string_view name) const {
  for (const auto& format : formats_) {
    if (format && format->name == name) return format.get();
  }
  return nullptr;
}

}  // namespace truetriad::convert
