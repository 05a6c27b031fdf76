// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "truetriad/base/result.h"

namespace truetriad {

/// A text file, plain or gzip (recognised by its first bytes, not its name). It is read once from
/// front to back, some whole lines at a time, and hashed while the bytes are in the cache.
///
/// Memory does not depend on the file's length. The file is read, not mapped into memory: if
/// another program truncates it meanwhile, the result is an error and not a signal, and pages do
/// not accumulate.
class TextFile {
 public:
  /// Bytes read at a time: few enough to be still in the second-level cache when they are parsed
  /// after hashing, and enough to make system calls rare.
  static constexpr std::size_t kChunkBytes = 256U << 10;

  /// Error: the file is missing, unreadable, a folder or device, empty, or of a binary format.
  static Result<std::unique_ptr<TextFile>> Open(const std::string& path,
                                                std::size_t chunk_bytes = kChunkBytes);
  ~TextFile();
  TextFile(const TextFile&) = delete;
  TextFile& operator=(const TextFile&) = delete;

  /// The next lines, each with its '\n' (added if the file's last line lacks it); empty at the end.
  /// A byte-order mark is left out. The text is valid until the next call.
  /// Error: damaged or truncated gzip, read failure, an endless line.
  Result<std::string_view> Next();

  /// Whether Next has returned the last lines and the file does not end with '\n'.
  bool ended_mid_line() const { return ended_mid_line_; }

  /// Share of the file's bytes already read, 0…1.
  double progress() const;

  /// SHA-256, in lower-case hex, of the file's bytes as stored; of a gzip file, the compressed
  /// bytes. Empty until the end of the file is read.
  std::string Sha256() const;

  /// Upper bound of the number of bytes of text: the file's size; the largest size_t if compressed.
  std::size_t MostBytes() const;

  const std::string& path() const { return path_; }

 private:
  class Bytes;
  class Inflater;

  TextFile(std::string path, std::unique_ptr<Bytes> bytes, std::size_t chunk_bytes);
  Status RecogniseContent();
  /// Number of bytes to keep free in the buffer; a small file needs few.
  std::size_t Room() const;
  /// Fills the buffer; sets at_end_ at the end of the file.
  Status Fill();

  std::string path_;
  std::size_t chunk_bytes_;
  std::unique_ptr<Bytes> bytes_;
  std::unique_ptr<Inflater> inflater_;  ///< Null for plain text.
  std::string buffer_;
  std::size_t handed_over_ = 0;  ///< Bytes of the buffer that the last Next returned.
  std::size_t filled_ = 0;       ///< Bytes of the buffer that hold text.
  bool at_end_ = false;
  bool ended_mid_line_ = false;
};

/// The format that the first bytes of a file indicate, as `truetriad convert --from=` names it
/// ("ulog"). Empty if `convert` cannot read the file directly.
std::string_view ForeignFormatOf(const std::string& path);

/// SHA-256 of `bytes`, lower-case hex.
std::string Sha256Hex(std::string_view bytes);

}  // namespace truetriad
