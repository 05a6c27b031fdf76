// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdio>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "truetriad/base/result.h"

namespace truetriad {

/// A name beside `path` that no other writer uses, for a file or folder that is renamed when it is
/// complete. Temporary files that killed processes of this machine left in the folder are removed
/// first.
std::string TemporaryNameBeside(const std::string& path);
/// Whether `name` is a temporary name: its file is not complete yet.
bool IsTemporaryName(std::string_view name);
/// Flushes the folder of a file, so that the name of the file is on the disk. If this fails,
/// returns false and sets errno.
bool IsFolderOnDisk(const std::string& path);

/// A file that appears under its name only when it is complete and on the disk: it is written
/// beside the target, flushed and renamed, and its folder is flushed. After a power cut or a kill,
/// the name has the old content or all of the new; the next writer removes the temporary file that
/// remains. A device or pipe (/dev/stdout) is written directly. A folder, an input (InputGuard) and
/// a fleet's store, which cannot be made again, are never replaced.
class WholeFile {
 public:
  explicit WholeFile(std::string path, bool replaces_store = false);
  ~WholeFile();  ///< Removes the temporary file unless committed.
  WholeFile(const WholeFile&) = delete;
  WholeFile& operator=(const WholeFile&) = delete;

  void Write(std::string_view text);

  /// Why the file cannot be written, as an `errno` (0: it can) and in words.
  int failure() const { return failure_; }
  Status status() const;

  /// Closes the file, which is then on the disk under its temporary name. Nothing can be written
  /// afterwards.
  Status Finish();
  /// Finishes the file and renames it.
  Status Commit();

 private:
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };

  std::string path_;
  std::string temporary_path_;  ///< Empty after renaming, or if there is none.
  std::unique_ptr<std::FILE, Close> file_;
  int failure_ = 0;
  std::optional<Error> refusal_;  ///< Why the target must not be written.
};

/// Files that are renamed when all of them are complete: if one cannot be written, no target
/// changes.
class WholeFiles {
 public:
  Status Write(const std::string& path, std::string_view text);
  /// Renames the files in the order in which they were written.
  Status Commit();

 private:
  std::deque<WholeFile> files_;
};

}  // namespace truetriad
