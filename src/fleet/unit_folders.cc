// SPDX-License-Identifier: Apache-2.0
#include "fleet/unit_folders.h"

#include <cerrno>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include "fleet/run_check.h"
#include "io/whole_file.h"
#include "json/plain_yaml.h"
#include "truetriad/io/calibration_file.h"

namespace truetriad::fleet {
namespace {

namespace fs = std::filesystem;

constexpr char kUnfinished[] = ".unfinished";

Error CannotWrite(const std::string& path) {
  return Error(
      ErrorCode::kCannotWrite, {path}, std::string("cannot be written: ") + std::strerror(errno));
}

/// It is marked so, or was made and no more.
bool IsUnfinished(const fs::path& folder) {
  std::error_code failure;
  return fs::exists(folder / kUnfinished, failure) || fs::is_empty(folder, failure);
}

/// The store that the run of an unfinished folder was to go into; unset: nobody said so yet.
std::optional<std::string> StoreOf(const fs::path& folder) {
  std::ifstream mark(folder / kUnfinished, std::ios::binary);
  std::string store(std::istreambuf_iterator<char>(mark), {});
  return store.empty() ? std::nullopt : std::optional(std::move(store));
}

/// Folders of runs that are unfinished, in units' folders that have changed since.
std::vector<fs::path> UnfinishedSince(const std::string& units, fs::file_time_type since) {
  std::vector<fs::path> found;
  std::error_code failure, vanished;
  for (fs::directory_iterator unit(units, failure), end; !failure && unit != end;
       unit.increment(failure)) {
    if (!unit->is_directory(vanished) || unit->last_write_time(vanished) < since) continue;
    for (fs::directory_iterator run(unit->path(), vanished); !vanished && run != end;
         run.increment(vanished)) {
      // Nothing else is ever removed, or asked for.
      if (IsRunId(run->path().filename().string()) && IsUnfinished(run->path())) {
        found.push_back(run->path());
      }
    }
  }
  return found;
}

/// Removes those that have no run, of runs for that store. False: the store cannot say.
bool Sweep(const std::vector<fs::path>& unfinished, Store& store, const std::string& name) {
  for (const fs::path& folder : unfinished) {
    if (StoreOf(folder).value_or(name) != name) continue;
    const Result<bool> has_run = store.Has(folder.filename().string());
    if (!has_run) return false;
    if (*has_run) {
      FinishFolder(folder.string());
      continue;
    }
    std::error_code ignored;
    fs::remove_all(folder, ignored);
    // A worker that had not ended yet may have written there meanwhile: the next removes that.
    if (fs::exists(folder, ignored)) static_cast<void>(BeginFolder(folder.string(), name));
    fs::remove(folder.parent_path(), ignored);  // Unless it holds other runs.
  }
  return true;
}

}  // namespace

Status BeginFolder(const std::string& folder, const std::string& store) {
  std::error_code failure;
  fs::create_directories(folder, failure);
  if (failure) {
    return Error(ErrorCode::kCannotWrite, {folder}, "cannot be created: " + failure.message());
  }
  const std::string mark = (fs::path(folder) / kUnfinished).string();
  const int file = open(mark.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0644);
  if (file < 0) return CannotWrite(mark);
  const bool is_written =
      write(file, store.data(), store.size()) == static_cast<ssize_t>(store.size());
  const Error error = CannotWrite(mark);
  close(file);
  return is_written ? Status() : Status(error);
}

void FinishFolder(const std::string& folder) {
  if (!folder.empty()) unlink((fs::path(folder) / kUnfinished).c_str());
}

Status WriteResult(const std::string& folder,
                   const Calibration& calibration,
                   const std::optional<std::string>& report) {
  const auto path = [&](std::string_view name) { return (fs::path(folder) / name).string(); };
  WholeFiles files;
  if (report) TRUETRIAD_RETURN_IF_ERROR(files.Write(path("report.html"), *report));
  const std::string yaml = CalibrationToYaml(calibration);
  TRUETRIAD_RETURN_IF_ERROR(files.Write(path("calibration.json"), TextOf(JsonOfPlainYaml(yaml))));
  TRUETRIAD_RETURN_IF_ERROR(files.Write(path("calibration.yaml"), yaml));
  return files.Commit();
}

Result<FolderClaim> FolderClaim::Share(const std::string& units,
                                       Store& store,
                                       const std::string& name) {
  const std::string path = (fs::path(units) / ".lock").string();
  const int file = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
  if (file < 0) return CannotWrite(path);
  FolderClaim claim(file);
  if (flock(file, LOCK_EX | LOCK_NB) == 0) {
    // Clocks of a folder's disk may be a little behind.
    constexpr auto kClocksS = std::chrono::seconds(2);
    struct stat about {};
    std::error_code failure;
    const bool is_first = fstat(file, &about) != 0 || about.st_size == 0;
    const fs::file_time_type last = fs::last_write_time(path, failure);
    const bool is_swept = Sweep(
        UnfinishedSince(units, is_first || failure ? fs::file_time_type::min() : last - kClocksS),
        store,
        name);
    // What it says does not matter: when it was written does.
    if (is_swept && pwrite(file, "\n", 1, 0) != 1) return CannotWrite(path);
  }
  if (flock(file, LOCK_SH) != 0 && errno != EINTR) return CannotWrite(path);
  return claim;
}

Result<FolderClaim> FolderClaim::TakeAlone(const std::string& folder, const Shard& shard) {
  std::string name = ".lock";
  if (shard.count > 1) {
    name += "-" + std::to_string(shard.index) + "-of-" + std::to_string(shard.count);
  }
  const std::string path = (fs::path(folder) / name).string();
  const int file = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
  if (file < 0) return CannotWrite(path);
  FolderClaim claim(file);
  if (flock(file, LOCK_EX | LOCK_NB) == 0) return claim;
  if (errno != EWOULDBLOCK) return CannotWrite(path);
  return Error(ErrorCode::kOutputInTheWay,
               {folder},
               "is in the hands of another fleet watch or fleet run --resume; wait for its end, or "
               "choose another --output");
}

FolderClaim FolderClaim::WaitFor(const std::string& folder) {
  const int file = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (file >= 0) flock(file, LOCK_EX);
  return FolderClaim(file);
}

Status RenameFolder(const std::string& name, std::string* folder) {
  if (folder->empty()) return {};
  const std::string to = (fs::path(*folder).parent_path() / name).string();
  std::error_code failure;
  fs::rename(*folder, to, failure);
  if (failure) return Error(ErrorCode::kCannotWrite, {to}, "cannot be made: " + failure.message());
  *folder = to;
  return {};
}

FolderClaim::~FolderClaim() {
  if (file_ >= 0) close(file_);
}

FolderClaim::FolderClaim(FolderClaim&& other) noexcept : file_(std::exchange(other.file_, -1)) {}

}  // namespace truetriad::fleet
