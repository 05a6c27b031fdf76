// SPDX-License-Identifier: Apache-2.0
#include "tools/convert/ros/chunked_bag.h"

#include <algorithm>
#include <utility>

#include <bzlib.h>
#include <lz4frame.h>
#include <zlib.h>
#include <zstd.h>

#include "tools/convert/common/unpack.h"
#include "tools/truetriad/progress.h"

namespace truetriad::convert {
namespace {

constexpr std::size_t kLongestChunk = std::size_t{1} << 30U;  ///< Bytes, unpacked.

bool UnpackBzip2(std::string_view packed, std::size_t size, std::string* unpacked) {
  bz_stream stream{};
  if (BZ2_bzDecompressInit(&stream, 0, 0) != BZ_OK) return false;
  const auto step = [&](std::string_view* rest, char* room, std::size_t* produced) {
    stream.next_in = const_cast<char*>(rest->data());  // bzlib does not write there.
    stream.avail_in = static_cast<unsigned>(rest->size());
    stream.next_out = room;
    stream.avail_out = static_cast<unsigned>(*produced);
    const int state = BZ2_bzDecompress(&stream);
    rest->remove_prefix(rest->size() - stream.avail_in);
    *produced -= stream.avail_out;
    return state == BZ_OK;
  };
  const bool is_whole = UnpackBy(step, packed, size, unpacked);
  BZ2_bzDecompressEnd(&stream);
  return is_whole;
}

bool UnpackLz4(std::string_view packed, std::size_t size, std::string* unpacked) {
  LZ4F_dctx* context = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&context, LZ4F_VERSION)) != 0) return false;
  const auto step = [&](std::string_view* rest, char* room, std::size_t* produced) {
    std::size_t consumed = rest->size();
    const std::size_t hint =
        LZ4F_decompress(context, room, produced, rest->data(), &consumed, nullptr);
    if (LZ4F_isError(hint) != 0) *produced = consumed = 0;
    rest->remove_prefix(consumed);
    return true;
  };
  const bool is_whole = UnpackBy(step, packed, size, unpacked);
  LZ4F_freeDecompressionContext(context);
  return is_whole;
}

bool UnpackZstd(std::string_view packed, std::size_t size, std::string* unpacked) {
  ZSTD_DStream* const stream = ZSTD_createDStream();
  const auto step = [&](std::string_view* rest, char* room, std::size_t* produced) {
    ZSTD_outBuffer out = {room, *produced, 0};
    ZSTD_inBuffer in = {rest->data(), rest->size(), 0};
    const bool is_good = ZSTD_isError(ZSTD_decompressStream(stream, &out, &in)) == 0;
    rest->remove_prefix(in.pos);
    *produced = is_good ? out.pos : 0;
    return is_good;
  };
  const bool is_whole = stream != nullptr && UnpackBy(step, packed, size, unpacked);
  ZSTD_freeDStream(stream);
  return is_whole;
}

/// Unpacks the data of a chunk, to the `size` bytes that it states. False: the chunk is damaged, or
/// its compression is not supported; `unpacked` holds the bytes before the damage.
bool Unpack(std::string_view compression,
            std::string_view packed,
            std::size_t size,
            std::string* unpacked) {
  if (compression == "bz2") return UnpackBzip2(packed, size, unpacked);
  if (compression == "lz4") return UnpackLz4(packed, size, unpacked);
  if (compression == "zstd") return UnpackZstd(packed, size, unpacked);
  if (compression != "none" && !compression.empty()) return false;
  unpacked->assign(packed.substr(0, size));
  return packed.size() == size;
}

}  // namespace

Status ChunkedBag::Read(const Wants& wants, const Take& take) {
  ProgressLine line("Converting");
  return ReadAll(
      [&](std::size_t topic, std::int64_t received_ns, std::string_view message) {
        if (wants(topic)) take(topic, received_ns, message);
      },
      line.callback());
}

std::map<std::string, std::uint64_t> ChunkedBag::Damage() const {
  return {{"incomplete chunks", damaged_chunks_}, {"incomplete records", damaged_records_}};
}

Status ChunkedBag::Survey() {
  TRUETRIAD_RETURN_IF_ERROR(ReadAll([](std::size_t, std::int64_t, std::string_view) {}, {}));
  if (damaged_chunks_ + damaged_records_ > 0) {
    Note(path_ + ": damaged: " + Counted(damaged_chunks_, "chunk") + " and " +
         Counted(damaged_records_, "record") + " incomplete, " + Counted(skipped_bytes_, "byte") +
         " skipped");
  }
  return {};
}

/// Reads the bag to its end and passes its messages to `take`. Topics already known are kept.
Status ChunkedBag::ReadAll(const Take& take, const std::function<void(double)>& progress) {
  TRUETRIAD_ASSIGN_OR_RETURN(const std::unique_ptr<ByteStream> bytes, ByteStream::Open(path_));
  TRUETRIAD_RETURN_IF_ERROR(TakeMagic(bytes.get()));
  take_ = &take;
  damaged_chunks_ = damaged_records_ = skipped_bytes_ = 0;
  ReadRecords(bytes.get(), /*in_chunk=*/false, progress);
  // If the connection of a message was unknown, counts may be too low: the index at the end of the
  // bag may name topics whose first definition was lost.
  for (Topic& topic : topics_) topic.is_counted = !has_unknown_connection_;
  return {};
}

void ChunkedBag::ReadRecords(ByteStream* bytes,
                             bool in_chunk,
                             const std::function<void(double)>& progress) {
  constexpr std::size_t kLongestHead = std::size_t{1} << 20U;  // Longer heads are damaged.
  while (!bytes->at_end()) {
    if (progress) progress(bytes->progress());
    const std::optional<Head> head = HeadIn(bytes->Peek(kLongestHead));
    const bool is_whole = head && head->body <= bytes->left() - head->size;
    if (!head || (!is_whole && head->kind != Kind::kChunk)) {
      if (!GoOn(bytes)) return;
      continue;
    }
    if (head->kind == Kind::kEnd) return;
    const bool is_chunk = head->kind == Kind::kChunk && !in_chunk;
    const bool is_too_long = head->body > ByteStream::kLookAhead - head->size;
    if (is_chunk && is_too_long) {
      ++damaged_chunks_;
    } else if (is_chunk) {
      ReadChunk(ChunkIn(*head, bytes->Peek(head->size + head->body)), is_whole);
    } else if (head->kind == Kind::kTaken) {
      const bool is_good = !is_too_long && TakeRecord(*head, bytes->Peek(head->size + head->body));
      if (!is_good) ++damaged_records_;
    }
    bytes->Skip(head->size);
    bytes->Skip(head->body);
  }
}

void ChunkedBag::ReadChunk(const Chunk& chunk, bool is_whole) {
  std::string unpacked;
  const bool is_good =
      chunk.size <= kLongestChunk && Unpack(chunk.compression, chunk.data, chunk.size, &unpacked);
  const auto* const content = reinterpret_cast<const Bytef*>(unpacked.data());
  const bool is_other =
      is_whole && chunk.crc != 0 && crc32_z(0, content, unpacked.size()) != chunk.crc;
  if (!is_good || is_other) ++damaged_chunks_;
  if (!is_other) ReadRecords(ByteStream::Of(std::move(unpacked)).get(), /*in_chunk=*/true, {});
}

/// Skips damage up to the next unambiguous record. False: there is none.
bool ChunkedBag::GoOn(ByteStream* bytes) {
  // Windows overlap, so that a head cut by the end of one is found in the next.
  constexpr std::size_t kWindow = std::size_t{1} << 16U, kOverlap = 256;
  ++damaged_records_;
  bytes->Skip(1);
  ++skipped_bytes_;
  while (!bytes->at_end()) {
    const std::string_view ahead = bytes->Peek(kWindow);
    const std::size_t begin = FindRecord(ahead);
    const bool is_found = begin != std::string_view::npos;
    const std::size_t skip = is_found                  ? begin
                             : ahead.size() > kOverlap ? ahead.size() - kOverlap
                                                       : ahead.size();
    skipped_bytes_ += skip;
    bytes->Skip(skip);
    if (is_found) return true;
  }
  return false;
}

void ChunkedBag::AddTopic(std::uint32_t connection, const Topic& topic) {
  // Each publisher of a topic has its own connection, and the index repeats them.
  const auto found = std::find_if(topics_.begin(), topics_.end(), [&](const Topic& known) {
    return known.name == topic.name && known.type == topic.type;
  });
  connections_.emplace(connection, static_cast<std::size_t>(found - topics_.begin()));
  if (found == topics_.end()) topics_.push_back(topic);
}

bool ChunkedBag::AddMessage(std::uint32_t connection,
                            std::int64_t received_ns,
                            std::string_view message) {
  const auto known = connections_.find(connection);
  if (known == connections_.end()) {
    has_unknown_connection_ = true;
    return false;
  }
  Topic& topic = topics_[known->second];
  const bool is_first = topic.messages++ == 0;
  topic.first_ns = is_first ? received_ns : std::min(topic.first_ns, received_ns);
  topic.last_ns = is_first ? received_ns : std::max(topic.last_ns, received_ns);
  (*take_)(known->second, received_ns, message);
  return true;
}

}  // namespace truetriad::convert
