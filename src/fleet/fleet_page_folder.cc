// SPDX-License-Identifier: Apache-2.0
#include "fleet/fleet_page_folder.h"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <optional>
#include <set>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "io/whole_file.h"
#include "io/yaml_reader.h"
#include "truetriad/io/calibration_file.h"

namespace truetriad::fleet {
namespace {

namespace fs = std::filesystem;

/// What of a folder is its own, a name a line below the first.
constexpr std::string_view kContents = "contents.txt";
constexpr std::string_view kFirstLine = "Files of a page of `truetriad fleet report`:";

Error CannotWrite(const std::string& path, int failure) {
  return Error(
      ErrorCode::kCannotWrite, {path}, std::string("cannot be written: ") + std::strerror(failure));
}

/// A file in `folder` that is not in its list of contents; unset: all are.
Result<std::optional<std::string>> ForeignFileIn(const fs::path& folder) {
  std::set<std::string> own = {std::string(kContents)};
  std::error_code failure;
  bool has_list = false;
  if (fs::is_regular_file(folder / kContents, failure)) {
    TRUETRIAD_ASSIGN_OR_RETURN(const std::string list,
                               ReadSmallFile((folder / kContents).string()));
    has_list = list.starts_with(kFirstLine);
    for (std::size_t begin = 0; begin < list.size();) {
      const std::size_t end = std::min(list.find('\n', begin), list.size());
      own.insert(list.substr(begin, end - begin));
      begin = end + 1;
    }
  }
  fs::recursive_directory_iterator entry(folder, failure);
  for (const fs::recursive_directory_iterator end; !failure && entry != end;
       entry.increment(failure)) {
    const std::string name = entry->path().lexically_relative(folder).generic_string();
    std::error_code ignored;
    if (entry->is_directory(ignored) && !entry->is_symlink(ignored)) continue;
    if (!has_list || !own.contains(name)) return std::optional(name);
  }
  if (failure) return CannotWrite(folder.string(), failure.value());
  return std::optional<std::string>();
}

}  // namespace

Result<WholeFolder> WholeFolder::Begin(const std::string& path) {
  WholeFolder folder;
  std::error_code failure;
  fs::path target = fs::weakly_canonical(fs::absolute(path), failure).lexically_normal();
  if (target.filename().empty()) target = target.parent_path();
  if (fs::exists(target, failure)) {
    if (!fs::is_directory(target, failure)) {
      return Error(ErrorCode::kOutputInTheWay, {path}, "is a file; name a folder");
    }
    TRUETRIAD_ASSIGN_OR_RETURN(const std::optional<std::string> foreign, ForeignFileIn(target));
    if (foreign) {
      return Error(ErrorCode::kOutputInTheWay,
                   {path},
                   "has a file that no page has written (" + *foreign +
                       "); name another folder for the page, as in " +
                       (fs::path(path) / "page").string());
    }
  }
  TRUETRIAD_RETURN_IF_ERROR(EnsureWritableDirectory(target.parent_path().string()));
  folder.path_ = target.string();
  folder.draft_ =
      TemporaryNameBeside((target.parent_path() / ("." + target.filename().string())).string());
  if (mkdir(folder.draft_.c_str(), 0777) != 0) {
    const int reason = errno;
    folder.draft_.clear();
    return CannotWrite(path, reason);
  }
  return folder;
}

WholeFolder::WholeFolder(WholeFolder&& other) noexcept
    : path_(std::move(other.path_)),
      draft_(std::exchange(other.draft_, "")),
      names_(std::move(other.names_)) {}

WholeFolder::~WholeFolder() {
  std::error_code ignored;
  if (!draft_.empty()) fs::remove_all(draft_, ignored);
}

Status WholeFolder::Write(const std::string& name, std::string_view text) {
  const fs::path path = fs::path(draft_) / name;
  std::error_code failure;
  fs::create_directories(path.parent_path(), failure);
  if (failure) return CannotWrite((fs::path(path_) / name).string(), failure.value());
  std::FILE* const file = std::fopen(path.c_str(), "wbe");
  if (file == nullptr) return CannotWrite((fs::path(path_) / name).string(), errno);
  errno = 0;
  bool is_written = std::fwrite(text.data(), 1, text.size(), file) == text.size();
  is_written = std::fclose(file) == 0 && is_written;
  if (!is_written) {
    return CannotWrite((fs::path(path_) / name).string(), errno != 0 ? errno : EIO);
  }
  names_.push_back(name);
  return {};
}

Status WholeFolder::Swap() const {
  if (rename(draft_.c_str(), path_.c_str()) == 0) return {};  // There is none, or an empty one.
  if (renameat2(AT_FDCWD, draft_.c_str(), AT_FDCWD, path_.c_str(), RENAME_EXCHANGE) == 0) return {};
  if (errno != EINVAL && errno != ENOSYS) return CannotWrite(path_, errno);
  // A file system that cannot exchange two names.
  const std::string aside =
      TemporaryNameBeside((fs::path(path_).parent_path() / ".replaced").string());
  if (rename(path_.c_str(), aside.c_str()) != 0) return CannotWrite(path_, errno);
  if (rename(draft_.c_str(), path_.c_str()) != 0) {
    const int reason = errno;
    rename(aside.c_str(), path_.c_str());
    return CannotWrite(path_, reason);
  }
  rename(aside.c_str(), draft_.c_str());
  return {};
}

Status WholeFolder::Commit() {
  std::string contents = std::string(kFirstLine) + '\n';
  std::sort(names_.begin(), names_.end());
  for (const std::string& name : names_) contents += name + '\n';
  TRUETRIAD_RETURN_IF_ERROR(Write(std::string(kContents), contents));
  const int folder = open(draft_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (folder >= 0) {
    syncfs(folder);  // Hundreds of files: one wait instead of as many.
    close(folder);
  }
  TRUETRIAD_RETURN_IF_ERROR(Swap());
  std::error_code ignored;
  fs::remove_all(draft_, ignored);  // Where the folder of before is now.
  draft_.clear();
  return {};
}

}  // namespace truetriad::fleet
