// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "truetriad/base/result.h"

namespace truetriad::fleet {

/// A folder that appears under its name only when it is whole. What stands there is replaced if
/// such a folder wrote it: a list of its files is in it, and it has no others.
class WholeFolder {
 public:
  /// Error (bad input): `path` is none, has files of something else, or cannot be written.
  static Result<WholeFolder> Begin(const std::string& path);
  WholeFolder(WholeFolder&& other) noexcept;
  WholeFolder& operator=(WholeFolder&&) = delete;
  ~WholeFolder();  ///< Leaves nothing behind unless committed.

  /// Writes a file; `name` with / for folders in it. Error (bad input): it cannot be written.
  Status Write(const std::string& name, std::string_view text);
  /// On the disk, and under its name, when it returns.
  Status Commit();

 private:
  WholeFolder() = default;
  Status Swap() const;

  std::string path_;
  std::string draft_;  ///< Empty: committed, or moved from.
  std::vector<std::string> names_;
};

}  // namespace truetriad::fleet
