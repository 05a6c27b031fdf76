// SPDX-License-Identifier: Apache-2.0
#include "tools/convert/mat/mat_elements.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <matio.h>
#include <zlib.h>

#include "tools/convert/common/byte_stream.h"

namespace truetriad::convert {
namespace {

constexpr std::size_t kTag = 8;  // Type and size, a word each.
constexpr int kDeepest = 64;     ///< Cells in cells; the library calls itself as deep.

std::uint32_t WordAt(std::string_view bytes, std::size_t offset, bool is_swapped) {
  const auto word = LoadNumber<std::uint32_t>(bytes, offset);
  return is_swapped ? __builtin_bswap32(word) : word;
}

/// The bytes of an element, inflated where they are compressed, from front to back.
class Content {
 public:
  Content(ByteStream* file, std::uint64_t size, bool is_compressed)
      : file_(file), left_(size), is_compressed_(is_compressed) {
    if (is_compressed_) is_ready_ = inflateInit(&stream_) == Z_OK;
  }
  ~Content() {
    if (is_compressed_) inflateEnd(&stream_);
  }
  Content(const Content&) = delete;
  Content& operator=(const Content&) = delete;

  /// False where there are not as many, of which some may be taken.
  bool Take(std::size_t count, char* into) {
    if (is_compressed_) return Inflate(count, into);
    const std::string_view bytes = file_->Peek(std::min<std::uint64_t>(count, left_));
    if (bytes.size() < count) return false;
    std::memcpy(into, bytes.data(), count);
    return Skip(count);
  }

  bool Skip(std::uint64_t count) {
    if (!is_compressed_) {
      if (count > left_) return false;
      file_->Skip(count);
      left_ -= count;
      return true;
    }
    std::array<char, kChunk> unseen;
    for (; count > 0; count -= std::min<std::uint64_t>(count, unseen.size())) {
      if (!Inflate(std::min<std::uint64_t>(count, unseen.size()), unseen.data())) return false;
    }
    return true;
  }

 private:
  static constexpr std::size_t kChunk = std::size_t{1} << 14U;  // Is inflated at once.

  bool Inflate(std::size_t count, char* into) {
    if (!is_ready_) return false;
    stream_.next_out = reinterpret_cast<Bytef*>(into);
    stream_.avail_out = static_cast<unsigned>(count);
    while (stream_.avail_out > 0) {
      if (stream_.avail_in == 0) Fill();
      if (inflate(&stream_, Z_NO_FLUSH) != Z_OK) return stream_.avail_out == 0;
    }
    return true;
  }

  void Fill() {
    const std::string_view bytes = file_->Peek(std::min<std::uint64_t>(kChunk, left_));
    input_.assign(bytes);
    file_->Skip(bytes.size());
    left_ -= bytes.size();
    stream_.next_in = reinterpret_cast<Bytef*>(input_.data());
    stream_.avail_in = static_cast<unsigned>(input_.size());
  }

  ByteStream* file_;
  std::uint64_t left_;
  bool is_compressed_;
  bool is_ready_ = false;
  std::string input_;
  z_stream stream_{};
};

/// Goes through a matrix and those in it.
class Walk {
 public:
  /// `cells`: how many there may be yet.
  Walk(Content* content, bool is_swapped, int* cells)
      : content_(content), is_swapped_(is_swapped), cells_(cells) {}

  /// Of a tag that comes next, of at most `left` bytes with it; that is what is left after it.
  bool IsSoundElement(std::uint64_t* left, int depth) {
    const auto words = TakeWords(2, left);
    if (words.empty() || words[0] != MAT_T_MATRIX || words[1] > *left) return false;
    *left -= words[1];
    return IsSoundMatrix(words[1], depth);
  }

  /// Of a matrix whose tag was taken.
  bool IsSoundMatrix(std::uint64_t size, int depth) {
    if (size == 0) return true;
    if (depth > kDeepest) return false;
    const auto flags = TakeNumbers(&size);
    if (flags.empty()) return false;
    const std::uint32_t kind = flags[0] & 0xFFU;
    const bool has_fields = kind == MAT_C_STRUCT || kind == MAT_C_OBJECT;
    const bool is_numeric = kind >= MAT_C_DOUBLE && kind <= MAT_C_UINT64;
    if (!is_numeric && !has_fields && kind != MAT_C_CELL && kind != MAT_C_FUNCTION) {
      return content_->Skip(size);
    }
    const auto dimensions = TakeNumbers(&size);
    if (dimensions.empty() || !SkipElement(&size)) return false;  // its name
    if (is_numeric) {
      const int parts = (flags[0] & kComplexFlag) != 0 ? 2 : 1;
      return AreSoundNumbers(dimensions, parts, &size) && content_->Skip(size);
    }
    if (kind == MAT_C_OBJECT && !SkipElement(&size)) return false;  // its class
    std::uint64_t count = 1;
    if (has_fields) {
      const auto length = TakeNumbers(&size);
      std::uint64_t names = 0;
      if (length.empty() || length[0] == 0 || !SkipElement(&size, &names)) return false;
      count = names / length[0];
    }
    if (std::count(dimensions.begin(), dimensions.end(), 0U) > 0) count = 0;
    for (const std::uint32_t dimension : dimensions) {
      if (count > 0 && dimension > size / kTag / count) return false;
      count *= dimension;
    }
    for (; count > 0; --count) {
      if (--*cells_ < 0 || !IsSoundElement(&size, depth + 1)) return false;
    }
    return content_->Skip(size);
  }

 private:
  static constexpr std::uint32_t kComplexFlag = 0x800U;  // Of the array flags of version 5.

  /// Of a numeric matrix: as many numbers as it says, of a type that numbers have, in each part.
  bool AreSoundNumbers(const std::vector<std::uint32_t>& dimensions,
                       int parts,
                       std::uint64_t* left) {
    std::uint64_t count = 1;
    for (const std::uint32_t dimension : dimensions) {
      if (dimension != 0 && count > *left / dimension) return false;
      count *= dimension;
    }
    if (count == 0) return true;
    for (; parts > 0; --parts) {
      std::uint32_t type = 0;
      std::uint64_t size = 0;
      if (!SkipElement(left, &size, &type)) return false;
      if (SizeOf(type) == 0 || size != count * SizeOf(type)) return false;
    }
    return true;
  }

  /// Zero: no type of numbers, which come before those of text.
  static std::uint64_t SizeOf(std::uint32_t type) {
    return type > MAT_T_UINT64 ? 0 : Mat_SizeOf(static_cast<matio_types>(type));
  }

  std::vector<std::uint32_t> TakeWords(std::size_t count, std::uint64_t* left) {
    std::string bytes(sizeof(std::uint32_t) * count, '\0');
    if (bytes.size() > *left || !content_->Take(bytes.size(), bytes.data())) return {};
    *left -= bytes.size();
    std::vector<std::uint32_t> words;
    for (std::size_t i = 0; i < count; ++i) {
      words.push_back(WordAt(bytes, sizeof(std::uint32_t) * i, is_swapped_));
    }
    return words;
  }

  /// The tag of an element of plain numbers: how many bytes follow, filled up to whole tags. Up to
  /// four bytes stand in the tag itself, whose size is then in its first half.
  struct PlainTag {
    std::uint32_t type = 0;
    std::uint64_t size = 0;
    std::optional<std::uint32_t> inside;
    std::uint64_t stored() const { return inside ? 0 : (size + kTag - 1) / kTag * kTag; }
  };
  std::optional<PlainTag> TakePlainTag(std::uint64_t* left) {
    const auto words = TakeWords(2, left);
    if (words.empty()) return std::nullopt;
    PlainTag tag{words[0], words[1], std::nullopt};
    if (const std::uint32_t size = words[0] >> 16U; size != 0) {
      tag = {words[0] & 0xFFFFU, size, words[1]};
    }
    if (tag.stored() > *left) return std::nullopt;
    return tag;
  }

  bool SkipElement(std::uint64_t* left,
                   std::uint64_t* size = nullptr,
                   std::uint32_t* type = nullptr) {
    const auto tag = TakePlainTag(left);
    if (!tag) return false;
    if (size != nullptr) *size = tag->size;
    if (type != nullptr) *type = tag->type;
    *left -= tag->stored();
    return content_->Skip(tag->stored());
  }

  /// Empty where there are none, or more than any matrix has.
  std::vector<std::uint32_t> TakeNumbers(std::uint64_t* left) {
    constexpr std::size_t kMost = 32;  // Dimensions of NumPy; MATLAB states no bound.
    const auto tag = TakePlainTag(left);
    if (!tag) return {};
    if (tag->inside) return {*tag->inside};
    const std::size_t count = tag->size / sizeof(std::uint32_t);
    if (count == 0 || count > kMost) return {};
    std::vector<std::uint32_t> words = TakeWords(tag->stored() / sizeof(std::uint32_t), left);
    words.resize(std::min(count, words.size()));
    return words;
  }

  Content* content_;
  bool is_swapped_;
  int* cells_;
};

}  // namespace

Elements5 ElementsOf5(ByteStream* file, bool is_swapped) {
  file->Skip(kHeader5);
  Elements5 elements;
  int cells = kMostCells;
  for (; !file->at_end(); ++elements.whole) {
    elements.rest = Elements5::Rest::kDamaged;
    const std::string_view tag = file->Peek(kTag);
    if (tag.size() < kTag) return elements;
    const std::uint32_t type = WordAt(tag, 0, is_swapped);
    const std::uint32_t size = WordAt(tag, sizeof type, is_swapped);
    const bool is_known = type == MAT_T_MATRIX || type == MAT_T_COMPRESSED;
    if (!is_known || size > file->left() - kTag) return elements;
    file->Skip(kTag);
    const std::uint64_t end = file->position() + size;
    Content content(file, size, type == MAT_T_COMPRESSED);
    Walk walk(&content, is_swapped, &cells);
    auto most = std::numeric_limits<std::uint64_t>::max();  // nobody knows before it is inflated
    if (!(type == MAT_T_MATRIX ? walk.IsSoundMatrix(size, 0) : walk.IsSoundElement(&most, 0))) {
      if (cells < 0) elements.rest = Elements5::Rest::kTooManyCells;
      return elements;
    }
    file->Skip(end - file->position());
    elements.rest = Elements5::Rest::kNone;
  }
  return elements;
}

}  // namespace truetriad::convert
