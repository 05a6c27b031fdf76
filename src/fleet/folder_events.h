// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "truetriad/base/result.h"

namespace truetriad::fleet {

/// What happens in folders, as Linux tells it (inotify). About 200 bytes a folder.
class FolderEvents {
 public:
  enum class Kind {
    kWhole,      ///< A file was closed after writing, or got this name.
    kAppeared,   ///< A link to a file was made: nobody will close it.
    kNewFolder,  ///< A folder was made, or got this name.
    kGone,       ///< A folder that is watched was removed or renamed.
    kLost,       ///< More has happened than could be kept; no path.
  };
  struct Event {
    Kind kind = Kind::kLost;
    std::filesystem::path path = {};
  };

  /// Error (bad input): the system has no more of them.
  static Result<std::unique_ptr<FolderEvents>> Open();
  ~FolderEvents();
  FolderEvents(const FolderEvents&) = delete;
  FolderEvents& operator=(const FolderEvents&) = delete;

  /// Tells of `folder` from now on, not of those below it. Error (bad input): it cannot be watched,
  /// or the system watches as many as it is set to.
  Status Watch(const std::filesystem::path& folder);
  /// What has happened since.
  std::vector<Event> Take();

 private:
  explicit FolderEvents(int stream) : stream_(stream) {}
  /// Forgets a folder that has another name now, and those below it.
  void Forget(const std::filesystem::path& folder);

  int stream_;
  std::unordered_map<int, std::filesystem::path> folders_;  ///< By watch.
};

/// "NFS", "FUSE", …: a file system that says nothing of what other machines, or programs behind it,
/// write to `folder`. Else empty.
std::string_view FileSystemWithoutEvents(const std::string& folder);

}  // namespace truetriad::fleet
