// SPDX-License-Identifier: Apache-2.0
#include "io/whole_file.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <charconv>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <set>
#include <string_view>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <unistd.h>

#include "io/input_guard.h"

namespace truetriad {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kTemporary = ".tmp-";

/// Identifies the scope in which process numbers are unique: one host, and one container on it.
std::string Numbering() {
  std::array<char, 256> host{};
  gethostname(host.data(), host.size() - 1);
  std::array<char, 64> container{};
  // If this link does not exist, as on other systems, only the host is used.
  if (readlink("/proc/self/ns/pid", container.data(), container.size() - 1) < 0) container[0] = 0;
  std::uint32_t hash = 2166136261U;  // Fowler, Noll and Vo's FNV-1a.
  for (const char c : std::string(host.data()) + container.data()) {
    hash = (hash ^ static_cast<unsigned char>(c)) * 16777619U;
  }
  return std::to_string(hash);
}

/// "4026531836-812-": the part of a temporary name that identifies the process.
std::string WriterName(pid_t process) {
  static const std::string numbering = Numbering();
  return numbering + "-" + std::to_string(process) + "-";
}

int LastFailure() { return errno != 0 ? errno : EIO; }

/// Whether fsync succeeded; a file system that does not support fsync (EINVAL, ENOTSUP) counts as
/// successful.
bool IsOnDisk(int descriptor) {
  return fsync(descriptor) == 0 || errno == EINVAL || errno == ENOTSUP;
}

/// Whether a process runs; a zombie, which waits for its parent, does not.
bool IsRunning(pid_t process) {
  if (kill(process, 0) != 0) return errno != ESRCH;
  std::ifstream stat("/proc/" + std::to_string(process) + "/stat");
  std::string text;
  std::getline(stat, text);
  const std::size_t name_end = text.rfind(')');  // "812 (truetriad) Z …"
  return name_end == std::string::npos || text.compare(name_end, 3, ") Z") != 0;
}

/// Whether the process whose number is in a temporary name (after kTemporary) no longer runs; false
/// for a process of another host or container.
bool IsOfDeadWriter(std::string_view name) {
  const std::size_t at = name.rfind(kTemporary);
  if (at == std::string_view::npos) return false;
  const std::string_view text = name.substr(at + kTemporary.size());
  const std::size_t number = text.find('-') + 1;
  pid_t writer = 0;
  std::from_chars(text.data() + number, text.data() + text.size(), writer);
  return writer > 0 && text.starts_with(WriterName(writer)) && !IsRunning(writer);
}

/// Removes the temporary files that killed processes left in the folder of `path`; once per folder
/// and process.
void SweepFolderOf(const std::string& path) {
  static std::mutex mutex;
  static auto& swept = *new std::set<fs::path>;
  fs::path folder = fs::path(path).parent_path();
  if (folder.empty()) folder = ".";
  // If the folder itself has a temporary name, it is new and belongs to this process.
  if (folder.filename().string().find(kTemporary) != std::string::npos) return;
  {
    const std::scoped_lock lock(mutex);
    if (!swept.insert(folder).second) return;
  }
  std::error_code ignored;
  for (fs::directory_iterator entry(folder, ignored), end; !ignored && entry != end;
       entry.increment(ignored)) {
    std::error_code failure;
    if (!IsOfDeadWriter(entry->path().filename().string())) continue;
    if (entry->is_regular_file(failure) || entry->is_directory(failure)) {
      fs::remove_all(entry->path(), failure);
    }
  }
}

/// Whether a file begins like a fleet's store: of SQLite, or of lines of JSON.
bool IsStore(const std::string& path) {
  constexpr std::array<std::string_view, 2> kBeginnings = {"SQLite format 3",
                                                           R"({"format":"truetriad/runs")"};
  std::array<char, 32> bytes{};
  std::ifstream(path, std::ios::binary).read(bytes.data(), bytes.size());
  const std::string_view begin(bytes.data(), bytes.size());
  return std::ranges::any_of(kBeginnings, [&](auto one) { return begin.starts_with(one); });
}

}  // namespace

bool IsFolderOnDisk(const std::string& path) {
  const fs::path parent = fs::path(path).parent_path();
  const int folder =
      open(parent.empty() ? "." : parent.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (folder < 0) return false;
  const bool is_on_disk = IsOnDisk(folder);
  close(folder);
  return is_on_disk;
}

std::string TemporaryNameBeside(const std::string& path) {
  static std::atomic<int> count = 0;
  SweepFolderOf(path);
  return path + std::string(kTemporary) + WriterName(getpid()) + std::to_string(count++);
}

bool IsTemporaryName(std::string_view name) {
  return name.find(kTemporary) != std::string_view::npos;
}

WholeFile::WholeFile(std::string path, bool replaces_store) : path_(std::move(path)) {
  std::error_code ignored;
  const fs::file_status target = fs::status(path_, ignored);
  const auto in_the_way = [this](const std::string& what) {
    return Error(
        ErrorCode::kOutputInTheWay, {path_}, what + "; remove it or choose another output");
  };
  if (fs::is_directory(target)) {
    refusal_ = in_the_way("is a folder");
  } else if (InputGuard::Holds(path_)) {
    refusal_ = InputGuard::Refusal(path_);
  } else if (!replaces_store && fs::is_regular_file(target) && IsStore(path_)) {
    refusal_ = in_the_way("is a fleet's store, whose runs would be lost");
  }
  if (refusal_) {
    failure_ = EEXIST;
    return;
  }
  const bool is_replaced = !fs::exists(target) || fs::is_regular_file(target);
  const std::string written = is_replaced ? TemporaryNameBeside(path_) : path_;
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
  if (refusal_) return *refusal_;
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

Status WholeFile::Finish() {
  if (!file_) return status();
  if (failure_ == 0 && !temporary_path_.empty() &&
      (std::fflush(file_.get()) != 0 || !IsOnDisk(fileno(file_.get())))) {
    failure_ = LastFailure();
  }
  if (std::fclose(file_.release()) != 0 && failure_ == 0) failure_ = LastFailure();
  return status();
}

Status WholeFile::Commit() {
  TRUETRIAD_RETURN_IF_ERROR(Finish());
  if (temporary_path_.empty()) return {};
  if (std::rename(temporary_path_.c_str(), path_.c_str()) == 0) {
    temporary_path_.clear();
    if (!IsFolderOnDisk(path_)) failure_ = LastFailure();
  } else {
    failure_ = LastFailure();
  }
  return status();
}

Status WholeFiles::Write(const std::string& path, std::string_view text) {
  files_.emplace_back(path).Write(text);
  return files_.back().Finish();
}

Status WholeFiles::Commit() {
  for (WholeFile& file : files_) TRUETRIAD_RETURN_IF_ERROR(file.Commit());
  return {};
}

}  // namespace truetriad
