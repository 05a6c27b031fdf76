// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdio>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "truetriad/base/error.h"
#include "truetriad/base/result.h"

namespace truetriad {

/// A name beside `path` that no other writer uses, for a file or folder that is to get its name
/// when it is whole. What writers left in that folder that were killed, on this machine, is removed
/// first.
std::string TemporaryNameBeside(const std::string& path);
/// Whether `name` is one of those: what has it is not whole yet.
bool IsTemporaryName(std::string_view name);
/// Flushes the folder of a file, which has its name on the disk then. False, and errno: it cannot.
bool IsFolderOnDisk(const std::string& path);

/// A file that appears under its name only when it is whole, and is then on the disk: written
/// beside it, flushed, renamed, and its folder flushed. A power cut or a kill leaves the file that
/// was there before, or the new one; what a killed writer left beside it the next one removes. A
/// device or pipe (/dev/stdout) is written to directly: replacing it by a file is not what anybody
/// means. Nor is it a folder, an input (InputGuard), or a fleet's store, which nothing makes again.
class WholeFile {
 public:
  explicit WholeFile(std::string path, bool replaces_store = false);
  ~WholeFile();  ///< Leaves nothing behind unless committed.
  WholeFile(const WholeFile&) = delete;
  WholeFile& operator=(const WholeFile&) = delete;

  void Write(std::string_view text);

  /// Why the file cannot be written, if so; as an `errno` (0: it can), and in words.
  int failure() const { return failure_; }
  Status status() const;

  /// Closes the file, which is then on the disk, without its name. Nothing can be written
  /// afterwards.
  Status Finish();
  /// Finishes the file and gives it its name.
  Status Commit();

 private:
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };

  std::string path_;
  std::string temporary_path_;  ///< Empty when there is none (any more).
  std::unique_ptr<std::FILE, Close> file_;
  int failure_ = 0;
  std::optional<Error> refusal_;  ///< Why nothing is to be written there.
};

/// Files that get their names when all of them are whole: where one cannot be written, every name
/// keeps what it has.
class WholeFiles {
 public:
  Status Write(const std::string& path, std::string_view text);
  /// Gives them their names, in the order in which they were written.
  Status Commit();

 private:
  std::deque<WholeFile> files_;
};

}  // namespace truetriad
