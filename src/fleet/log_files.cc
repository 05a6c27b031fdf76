// SPDX-License-Identifier: Apache-2.0
#include "fleet/log_files.h"

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <system_error>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "io/whole_file.h"

namespace truetriad::fleet {
namespace {

namespace fs = std::filesystem;

bool IsHiddenOrHalf(const std::string& name) {
  return name.starts_with('.') || IsTemporaryName(name);
}

std::optional<LogStamp> StampOfFile(const fs::path& file) {
  struct stat about {};
  if (stat(file.c_str(), &about) != 0) return std::nullopt;
  return LogStamp{about.st_size,
                  std::int64_t{about.st_mtim.tv_sec} * 1'000'000'000 + about.st_mtim.tv_nsec};
}

void Visit(const fs::path& folder,
           const std::function<bool(const fs::path&)>& enters,
           const std::function<void(const fs::path&)>& on_log,
           std::error_code* failure) {
  if (!enters(folder)) return;
  std::error_code missing;
  if (fs::exists(folder / kManifestName, missing)) {
    on_log(folder / kManifestName);
    return;
  }
  for (fs::directory_iterator at(folder, *failure), end; !*failure && at != end;
       at.increment(*failure)) {
    std::error_code vanished;
    if (!at->is_directory(vanished)) {
      if (!vanished && IsTable(at->path())) on_log(at->path());
    } else if (!at->is_symlink(vanished) && IsEntered(at->path())) {
      Visit(at->path(), enters, on_log, &vanished);
    }
  }
}

}  // namespace

bool IsTable(const fs::path& path) {
  const std::string name = path.filename().string();
  return (name.ends_with(".csv") || name.ends_with(".csv.gz")) && !IsHiddenOrHalf(name);
}

bool IsEntered(const fs::path& folder) {
  return folder.extension() != ".truetriad" && !IsHiddenOrHalf(folder.filename().string());
}

Status ForEachLog(const fs::path& folder,
                  const std::function<bool(const fs::path&)>& enters,
                  const std::function<void(const fs::path&)>& on_log) {
  std::error_code failure;
  Visit(folder, enters, on_log, &failure);
  if (!failure) return {};
  return Error(
      ErrorCode::kUnreadableFile, {folder.string()}, "cannot be read: " + failure.message());
}

LogStamp StampOfFolder(const fs::path& folder) {
  LogStamp all;
  std::error_code failure;
  for (fs::directory_iterator at(folder, failure), end; !failure && at != end;
       at.increment(failure)) {
    if (!IsTable(at->path()) && at->path().filename() != kManifestName) continue;
    const std::optional<LogStamp> own = StampOfFile(at->path());
    if (!own) continue;
    all.bytes += own->bytes;
    all.modified_ns = std::max(all.modified_ns, own->modified_ns);
  }
  return all;
}

std::optional<LogStamp> StampOf(const std::string& log) {
  const fs::path path = log;
  const std::optional<LogStamp> own = StampOfFile(path);
  if (!own || path.filename() != kManifestName) return own;
  return StampOfFolder(path.has_parent_path() ? path.parent_path() : fs::path("."));
}

bool IsBeingWritten(const std::string& file) {
  const int descriptor = open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (descriptor < 0) return false;
  // A read lease is refused where somebody has the file open to write. Whoever opens it in this
  // very moment waits until it is given back; the signal that would tell us so is ignored.
  fcntl(descriptor, F_SETSIG, SIGURG);
  const bool is_refused = fcntl(descriptor, F_SETLEASE, F_RDLCK) != 0 && errno == EAGAIN;
  fcntl(descriptor, F_SETLEASE, F_UNLCK);
  close(descriptor);
  return is_refused;
}

}  // namespace truetriad::fleet
