// SPDX-License-Identifier: Apache-2.0
#include "fleet/folder_events.h"

#include <array>
#include <cerrno>
#include <cstring>

#include <sys/inotify.h>
#include <sys/stat.h>
#include <sys/vfs.h>
#include <unistd.h>

#include "fleet/sqlite_store.h"

namespace truetriad::fleet {
namespace {

namespace fs = std::filesystem;

constexpr std::uint32_t kWatched = IN_CLOSE_WRITE | IN_MOVED_TO | IN_MOVED_FROM | IN_CREATE |
                                   IN_DELETE_SELF | IN_MOVE_SELF | IN_ONLYDIR | IN_EXCL_UNLINK;

/// Another name of a file that was there: it is not made by writing, so nobody closes it.
bool IsLink(const fs::path& path) {
  struct stat about {};
  return lstat(path.c_str(), &about) == 0 && (S_ISLNK(about.st_mode) || about.st_nlink > 1);
}

}  // namespace

Result<std::unique_ptr<FolderEvents>> FolderEvents::Open() {
  const int stream = inotify_init1(IN_CLOEXEC | IN_NONBLOCK);
  if (stream < 0) {
    return Error(ErrorCode::kSystemFailure,
                 std::string("folders cannot be watched: ") + std::strerror(errno));
  }
  return std::unique_ptr<FolderEvents>(new FolderEvents(stream));
}

FolderEvents::~FolderEvents() { close(stream_); }

Status FolderEvents::Watch(const fs::path& folder) {
  const int watch = inotify_add_watch(stream_, folder.c_str(), kWatched);
  if (watch >= 0) {
    folders_[watch] = folder;
    return {};
  }
  if (errno == ENOSPC) {
    return Error(ErrorCode::kSystemFailure,
                 {folder.string()},
                 "is one folder more than this system watches (" + std::to_string(folders_.size()) +
                     " are); raise fs.inotify.max_user_watches");
  }
  return Error(ErrorCode::kUnreadableFile,
               {folder.string()},
               std::string("cannot be watched: ") + std::strerror(errno));
}

void FolderEvents::Forget(const fs::path& folder) {
  const std::string below = folder.string() + "/";
  std::erase_if(folders_, [&](const auto& item) {
    const bool is_within = item.second == folder || item.second.string().starts_with(below);
    if (is_within) inotify_rm_watch(stream_, item.first);
    return is_within;
  });
}

std::vector<FolderEvents::Event> FolderEvents::Take() {
  std::vector<Event> events;
  alignas(inotify_event) std::array<char, 65536> buffer;
  for (;;) {
    const ssize_t size = read(stream_, buffer.data(), buffer.size());
    if (size < 0 && errno == EINTR) continue;
    if (size <= 0) return events;
    for (ssize_t at = 0; at < size;) {
      const auto* const event = reinterpret_cast<const inotify_event*>(buffer.data() + at);
      at += static_cast<ssize_t>(sizeof(inotify_event) + event->len);
      if ((event->mask & IN_Q_OVERFLOW) != 0) {
        events.push_back({.kind = Kind::kLost});
        continue;
      }
      const auto folder = folders_.find(event->wd);
      if (folder == folders_.end()) continue;
      if ((event->mask & (IN_DELETE_SELF | IN_MOVE_SELF | IN_UNMOUNT | IN_IGNORED)) != 0) {
        const fs::path path = folder->second;
        events.push_back({Kind::kGone, path});
        Forget(path);
        continue;
      }
      const fs::path path = folder->second / event->name;
      if ((event->mask & IN_ISDIR) != 0) {
        if ((event->mask & (IN_CREATE | IN_MOVED_TO)) != 0) {
          events.push_back({Kind::kNewFolder, path});
        } else if ((event->mask & IN_MOVED_FROM) != 0) {
          Forget(path);
        }
      } else if ((event->mask & (IN_CLOSE_WRITE | IN_MOVED_TO)) != 0) {
        events.push_back({Kind::kWhole, path});
      } else if ((event->mask & IN_CREATE) != 0 && IsLink(path)) {
        events.push_back({Kind::kAppeared, path});
      }
    }
  }
}

std::string_view FileSystemWithoutEvents(const std::string& folder) {
  struct statfs about {};
  if (statfs(folder.c_str(), &about) != 0) return "";
  switch (static_cast<unsigned long>(about.f_type) & 0xFFFFFFFFUL) {
    case 0x65735546:
      return "FUSE";
    case 0x786F4256:
      return "VirtualBox";
    case 0x73757245:
      return "Coda";
    default:
      return NetworkFileSystemName(about.f_type);
  }
}

}  // namespace truetriad::fleet
