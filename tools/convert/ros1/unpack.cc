// SPDX-License-Identifier: Apache-2.0
#include "tools/convert/ros1/unpack.h"

#include <algorithm>

#include <bzlib.h>
#include <lz4frame.h>

namespace truetriad::convert {
namespace {

// Grows with what is unpacked, not with what the chunk says of itself.
constexpr std::size_t kStep = std::size_t{1} << 18U;

bool UnpackBzip2(std::string_view packed, std::size_t size, std::string* unpacked) {
  bz_stream stream{};
  if (BZ2_bzDecompressInit(&stream, 0, 0) != BZ_OK) return false;
  stream.next_in = const_cast<char*>(packed.data());  // Only read from.
  stream.avail_in = static_cast<unsigned>(packed.size());
  int state = BZ_OK;
  std::size_t filled = 0;
  while (state == BZ_OK && filled < size) {
    unpacked->resize(std::min(size, filled + kStep));
    stream.next_out = unpacked->data() + filled;
    stream.avail_out = static_cast<unsigned>(unpacked->size() - filled);
    const unsigned input_before = stream.avail_in;
    state = BZ2_bzDecompress(&stream);
    const std::size_t now = unpacked->size() - stream.avail_out;
    if (now == filled && stream.avail_in == input_before) break;  // Cut: it wants more.
    filled = now;
  }
  unpacked->resize(filled);
  BZ2_bzDecompressEnd(&stream);
  return filled == size;
}

bool UnpackLz4(std::string_view packed, std::size_t size, std::string* unpacked) {
  LZ4F_dctx* context = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&context, LZ4F_VERSION)) != 0) return false;
  std::size_t filled = 0;
  while (!packed.empty() && filled < size) {
    unpacked->resize(std::min(size, filled + kStep));
    std::size_t produced = unpacked->size() - filled;
    std::size_t consumed = packed.size();
    const std::size_t hint = LZ4F_decompress(
        context, unpacked->data() + filled, &produced, packed.data(), &consumed, nullptr);
    if (LZ4F_isError(hint) != 0) break;
    filled += produced;
    packed.remove_prefix(consumed);
    if (produced == 0 && consumed == 0) break;
  }
  unpacked->resize(filled);
  LZ4F_freeDecompressionContext(context);
  return filled == size;
}

}  // namespace

bool Unpack(std::string_view compression,
            std::string_view packed,
            std::size_t size,
            std::string* unpacked) {
  unpacked->clear();
  if (compression == "bz2") return UnpackBzip2(packed, size, unpacked);
  if (compression == "lz4") return UnpackLz4(packed, size, unpacked);
  if (compression != "none") return false;
  unpacked->assign(packed.substr(0, size));
  return packed.size() == size;
}

}  // namespace truetriad::convert
