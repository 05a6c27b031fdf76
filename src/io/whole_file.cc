// SPDX-License-Identifier: Apache-2.0
#include "io/whole_file.h"

#include <atomic>
#include <cerrno>
#include <charconv>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <mutex>
#include <set>
#include <string_view>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <unistd.h>

namespace truetriad {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kTemporary = ".tmp-";

/// A name beside `path` that no other writer uses.
std::string TemporaryName(const std::string& path) {
  static std::atomic<int> count = 0;
  return path + std::string(kTemporary) + std::to_string(getpid()) + "-" + std::to_string(count++);
}

int LastFailure() { return errno != 0 ? errno : EIO; }

/// A file system that cannot do it (EINVAL, ENOTSUP) has nothing to lose by it.
bool IsOnDisk(int descriptor) {
  return fsync(descriptor) == 0 || errno == EINVAL || errno == ENOTSUP;
}

/// The name of a file is on the disk when its folder is.
bool IsFolderOnDisk(const std::string& path) {
  const fs::path parent = fs::path(path).parent_path();
  const int folder =
      open(parent.empty() ? "." : parent.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (folder < 0) return false;
  const bool is_on_disk = IsOnDisk(folder);
  close(folder);
  return is_on_disk;
}

/// The writer whose number a temporary name holds, kTemporary and what follows it, was killed.
bool IsOfDeadWriter(std::string_view name) {
  const std::size_t at = name.rfind(kTemporary);
  if (at == std::string_view::npos) return false;
  const std::string_view number = name.substr(at + kTemporary.size());
  pid_t writer = 0;
  const auto read = std::from_chars(number.data(), number.data() + number.size(), writer);
  return read.ec == std::errc() && read.ptr != number.data() + number.size() && *read.ptr == '-' &&
         writer > 0 && kill(writer, 0) != 0 && errno == ESRCH;
}

/// Removes what killed writers left in a folder; once for each that this process writes to.
void SweepFolderOf(const std::string& path) {
  static std::mutex mutex;
  static auto& swept = *new std::set<fs::path>;
  fs::path folder = fs::path(path).parent_path();
  if (folder.empty()) folder = ".";
  {
    const std::scoped_lock lock(mutex);
    if (!swept.insert(folder).second) return;
  }
  std::error_code ignored;
  for (fs::directory_iterator entry(folder, ignored), end; !ignored && entry != end;
       entry.increment(ignored)) {
    std::error_code failure;
    if (IsOfDeadWriter(entry->path().filename().string()) && entry->is_regular_file(failure)) {
      fs::remove(entry->path(), failure);
    }
  }
}

}  // namespace

WholeFile::WholeFile(std::string path) : path_(std::move(path)) {
  std::error_code ignored;
  const fs::file_status target = fs::status(path_, ignored);
  if (fs::is_directory(target)) {
    failure_ = EISDIR;
    return;
  }
  const bool is_replaced = !fs::exists(target) || fs::is_regular_file(target);
  if (is_replaced) SweepFolderOf(path_);
  const std::string written = is_replaced ? TemporaryName(path_) : path_;
  file_.reset(std::fopen(written.c_str(), "wbe"));
  if (!file_) {
    failure_ = LastFailure();
  } else if (is_replaced) {
    temporary_path_ = written;
  }
}

WholeFile::~WholeFile() {
  if (!temporary_path_.empty()) std::remove(temporary_path_.c_str());
}

void WholeFile::Write(std::string_view text) {
  if (failure_ == 0 && std::fwrite(text.data(), 1, text.size(), file_.get()) != text.size()) {
    failure_ = LastFailure();
  }
}

Status WholeFile::status() const {
  if (failure_ == 0) return {};
  if (failure_ == EISDIR) {
    return Error(ErrorCode::kOutputInTheWay, {path_}, "is a folder; give a file name");
  }
  const fs::path parent = fs::path(path_).parent_path();
  std::error_code ignored;
  if (!parent.empty() && !fs::is_directory(parent, ignored)) {
    return Error(ErrorCode::kCannotWrite,
                 {path_},
                 "cannot be written: there is no folder " + parent.string() +
                     "; create it or choose another");
  }
  return Error(ErrorCode::kCannotWrite,
               {path_},
               std::string("cannot be written: ") + std::strerror(failure_));
}

Status WholeFile::Commit() {
  const bool is_replaced = !temporary_path_.empty();
  if (failure_ == 0 && is_replaced &&
      (std::fflush(file_.get()) != 0 || !IsOnDisk(fileno(file_.get())))) {
    failure_ = LastFailure();
  }
  if (failure_ == 0 && std::fclose(file_.release()) != 0) failure_ = LastFailure();
  if (failure_ == 0 && is_replaced) {
    if (std::rename(temporary_path_.c_str(), path_.c_str()) == 0) {
      temporary_path_.clear();
      if (!IsFolderOnDisk(path_)) failure_ = LastFailure();
    } else {
      failure_ = LastFailure();
    }
  }
  return status();
}

}  // namespace truetriad
