// SPDX-License-Identifier: Apache-2.0
#include "tools/convert/dataflash/dataflash_log.h"

#include <algorithm>
#include <cstring>
#include <limits>
#include <utility>

#include "tools/convert/common/byte_stream.h"

namespace truetriad::convert {
namespace {

// The bytes before the type of a record.
constexpr char kMagic0 = '\xA3', kMagic1 = '\x95';
constexpr int kFormatType = 128;             // FMT
constexpr std::size_t kHeader = 3;           // Magic bytes and type.
constexpr std::size_t kLongestRecord = 255;  // The length is one byte of FMT.

/// What the letter of a type means: the number of bytes and the kind of a field.
struct Layout {
  enum Kind { kSigned, kUnsigned, kFloat, kText, kOther };

  char letter;
  std::size_t size;
  Kind kind;
  double factor = 1.0;  ///< Value of one step of the integer.
};
constexpr std::array<Layout, 21> kLayouts = {{
    {'b', 1, Layout::kSigned},         {'B', 1, Layout::kUnsigned},
    {'M', 1, Layout::kUnsigned},       {'h', 2, Layout::kSigned},
    {'H', 2, Layout::kUnsigned},       {'c', 2, Layout::kSigned, 0.01},
    {'C', 2, Layout::kUnsigned, 0.01}, {'g', 2, Layout::kOther},
    {'i', 4, Layout::kSigned},         {'I', 4, Layout::kUnsigned},
    {'e', 4, Layout::kSigned, 0.01},   {'E', 4, Layout::kUnsigned, 0.01},
    {'L', 4, Layout::kSigned, 1e-7},   {'f', 4, Layout::kFloat},
    {'n', 4, Layout::kText},           {'q', 8, Layout::kSigned},
    {'Q', 8, Layout::kUnsigned},       {'d', 8, Layout::kFloat},
    {'N', 16, Layout::kText},          {'Z', 64, Layout::kText},
    {'a', 64, Layout::kOther},
}};

/// The layout of a type letter; zero bytes for an unknown one.
Layout LayoutOf(char letter) {
  const auto* const found = std::find_if(
      kLayouts.begin(), kLayouts.end(), [&](const Layout& one) { return one.letter == letter; });
  return found == kLayouts.end() ? Layout{letter, 0, Layout::kOther} : *found;
}

std::uint64_t BitsIn(const MessageField& field, std::string_view record, std::size_t size) {
  std::uint64_t bits = 0;
  std::memcpy(&bits, record.data() + field.offset, size);
  return bits;
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

/// Parses an FMT record: type, length, name[4], letters[16], labels[64]. Null if these are
/// inconsistent.
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
    const std::size_t size = LayoutOf(letter).size;
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
  const Layout layout = LayoutOf(field.letter);
  if (layout.kind != Layout::kUnsigned || layout.factor != 1.0) return std::nullopt;
  return BitsIn(field, record, layout.size);
}

double NumberIn(const MessageField& field, std::string_view record) {
  const Layout layout = LayoutOf(field.letter);
  if (layout.kind == Layout::kUnsigned)
    return layout.factor * static_cast<double>(BitsIn(field, record, layout.size));
  if (layout.kind == Layout::kSigned) {
    const auto unused = static_cast<unsigned>(8 * (sizeof(std::uint64_t) - layout.size));
    const std::uint64_t bits = BitsIn(field, record, layout.size) << unused;
    return layout.factor * static_cast<double>(static_cast<std::int64_t>(bits) >> unused);
  }
  if (field.letter == 'f') return static_cast<double>(LoadNumber<float>(record, field.offset));
  if (field.letter == 'd') return LoadNumber<double>(record, field.offset);
  return std::numeric_limits<double>::quiet_NaN();
}

std::string_view TextIn(const MessageField& field, std::string_view record) {
  const Layout layout = LayoutOf(field.letter);
  return layout.kind == Layout::kText ? UpToNul(record.substr(field.offset, layout.size))
                                      : std::string_view();
}

DataflashLog::DataflashLog(std::unique_ptr<ByteStream> bytes) : bytes_(std::move(bytes)) {
  // FMT also defines itself, but this definition can be read only if FMT is known.
  auto format = std::make_unique<MessageFormat>();
  format->type = kFormatType;
  format->name = "FMT";
  format->length = 89;
  formats_[kFormatType] = std::move(format);
}

Result<std::unique_ptr<DataflashLog>> DataflashLog::Open(const std::string& path) {
  TRUETRIAD_ASSIGN_OR_RETURN(std::unique_ptr<ByteStream> bytes, ByteStream::Open(path));
  constexpr std::size_t kBeginning = std::size_t{1} << 20U;  // Definitions precede all else.
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
      read_bytes_ += skip;
      bytes_->Skip(skip);
      continue;
    }
    in_damage_ = false;
    ++records_;
    bytes_->Skip(length);
    const std::string_view record = ahead.substr(0, length);
    const auto type = static_cast<std::uint8_t>(record[2]);
    if (type == kFormatType) Describe(record);
    read_bytes_ += length;
    return {formats_[type].get(), record};
  }
  return {};
}

void DataflashLog::Describe(std::string_view record) {
  std::unique_ptr<MessageFormat> format = ParseFormat(record);
  if (!format) return;
  if (format->type == kFormatType) {
    if (std::exchange(has_begun_, true) && next_log_ == 0) next_log_ = read_bytes_;
    return;
  }
  // The first definition of a type is valid; another one later is damage.
  std::unique_ptr<MessageFormat>& known = formats_[static_cast<std::size_t>(format->type)];
  if (!known) known = std::move(format);
}

}  // namespace truetriad::convert
