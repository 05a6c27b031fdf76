// SPDX-License-Identifier: Apache-2.0
#include "fleet/unit_folders.h"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include "fleet/unit_work.h"
#include "io/calibration_tree.h"
#include "io/whole_file.h"
#include "io/yaml_reader.h"
#include "truetriad/formats/export.h"
#include "truetriad/io/calibration_file.h"
#include "truetriad/report/report.h"

namespace truetriad::fleet {
namespace {

namespace fs = std::filesystem;

constexpr char kUnfinished[] = ".unfinished";

Error CannotWrite(const std::string& path) {
  return Error(
      ErrorCode::kCannotWrite, {path}, std::string("cannot be written: ") + std::strerror(errno));
}

/// Whether the folder has the mark of an unfinished one, or was created but not marked yet.
bool IsUnfinished(const fs::path& folder) {
  std::error_code failure;
  return fs::exists(folder / kUnfinished, failure) || fs::is_empty(folder, failure);
}

/// The store to which the run of an unfinished folder was to be added; unset: not stated yet.
std::optional<std::string> StoreOf(const fs::path& folder) {
  std::ifstream mark(folder / kUnfinished, std::ios::binary);
  std::string store(std::istreambuf_iterator<char>(mark), {});
  return store.empty() ? std::nullopt : std::optional(std::move(store));
}

/// The unfinished folders of runs, in the units' folders that have changed after `since`.
std::vector<fs::path> UnfinishedSince(const std::string& units, fs::file_time_type since) {
  std::vector<fs::path> found;
  std::error_code failure, vanished;
  for (fs::directory_iterator unit(units, failure), end; !failure && unit != end;
       unit.increment(failure)) {
    if (!unit->is_directory(vanished) || unit->last_write_time(vanished) < since) continue;
    for (fs::directory_iterator run(unit->path(), vanished); !vanished && run != end;
         run.increment(vanished)) {
      // Only folders named like a run are ever examined or removed.
      if (IsRunId(run->path().filename().string()) && IsUnfinished(run->path())) {
        found.push_back(run->path());
      }
    }
  }
  return found;
}

/// Removes each folder whose run was to be added to `store` (whose mark is `name`) but is not in
/// this store. False: the store fails.
bool Sweep(const std::vector<fs::path>& unfinished, Store& store, const std::string& name) {
  for (const fs::path& folder : unfinished) {
    if (StoreOf(folder).value_or(name) != name) continue;
    const Result<bool> has_run = store.Has(folder.filename().string());
    if (!has_run) return false;
    if (*has_run) {
      FinishFolder(folder.string());
      continue;
    }
    RemoveFolder(folder.string());
    std::error_code ignored;
    // A worker may have written there meanwhile; the next sweep removes those files.
    if (fs::exists(folder, ignored)) static_cast<void>(BeginFolder(folder.string(), name));
    fs::remove(folder.parent_path(), ignored);  // Fails if it holds other runs.
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

void RemoveFolder(const std::string& folder) {
  std::error_code ignored;
  for (fs::directory_iterator file(folder, ignored), end; file != end;) {
    const fs::path path = file->path();
    file.increment(ignored);
    if (path.filename() != kUnfinished) fs::remove_all(path, ignored);
  }
  fs::remove_all(folder, ignored);
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
  TRUETRIAD_RETURN_IF_ERROR(
      files.Write(path("calibration.json"), TextOf(CalibrationTree(calibration))));
  TRUETRIAD_RETURN_IF_ERROR(files.Write(path("calibration.yaml"), CalibrationToYaml(calibration)));
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
    // The clock of a network disk may lag a little.
    constexpr auto kClocksS = std::chrono::seconds(2);
    struct stat about {};
    std::error_code failure;
    const bool is_first = fstat(file, &about) != 0 || about.st_size == 0;
    const fs::file_time_type last = fs::last_write_time(path, failure);
    const bool is_swept = Sweep(
        UnfinishedSince(units, is_first || failure ? fs::file_time_type::min() : last - kClocksS),
        store,
        name);
    // Only the time of this write matters.
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
               "is in use by another fleet watch or fleet run --resume; wait for its end, or "
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

namespace {

namespace fs = std::filesystem;

bool IsSame(const Decision& one, const Decision& other) {
  return one.verdict == other.verdict && one.who == other.who && one.why == other.why &&
         one.is_automatic == other.is_automatic &&
         (one.is_automatic || one.created == other.created);
}

Decision OfPerson(const Standing& unit) {
  return {unit.final_verdict, unit.disposed_by, unit.disposed_why, unit.disposed_at};
}

/// Precedes the name of a run in the field `who` of a decision.
constexpr std::string_view kRunWord = "run ";

/// The decision that the unit may not be delivered, since its current run is not good. It is for
/// the files of the unit's other runs.
Decision OfRunThatCounts(const Standing& unit) {
  return {.verdict = Verdict::kFail,
          .who = std::string(kRunWord) + unit.run,
          .why = unit.final_verdict == Verdict::kNoResult
                     ? "it is the unit's current run, and has no calibration"
                     : "it is the unit's current run, and is FAIL",
          .created = TimestampUtc(),
          .is_automatic = true};
}

/// The decisions that the calibration of a run must state.
std::vector<Decision> WhatHolds(Calibration calibration, const Standing& unit, bool counts) {
  std::vector<Decision>& decisions = calibration.decisions;
  std::erase_if(decisions, [](const Decision& one) { return one.is_automatic; });
  const bool is_red = IsRed(unit.final_verdict);
  if (!unit.disposed_by.empty()) {
    const Decision decision = OfPerson(unit);
    const bool is_stated = !decisions.empty() && IsSame(decisions.back(), decision);
    if (!is_stated && (is_red || counts)) decisions.push_back(decision);
    return decisions;
  }
  // No decision is in force in the store. So a concession in the files has ended; a refusal stays.
  if (!decisions.empty() && decisions.back().verdict == Verdict::kPass) decisions.clear();
  if (is_red && !counts && !IsRed(calibration.verdict())) {
    decisions.push_back(OfRunThatCounts(unit));
  }
  return decisions;
}

/// Makes the files of a run agree with `unit` and returns the withdrawn exports. Exports are
/// changed first, calibration.yaml last: if the process is killed in between, the unit is blocked
/// rather than released, and the next call does the rest.
Result<std::vector<std::string>> Agree(const fs::path& folder, const Standing& unit, bool counts) {
  std::vector<std::string> withdrawn;
  // For a symbolic link the target is changed.
  std::error_code failure;
  const fs::path file = fs::weakly_canonical(folder / "calibration.yaml", failure);
  TRUETRIAD_ASSIGN_OR_RETURN(const std::string text, LookAtSmallFile(file.string()));
  TRUETRIAD_ASSIGN_OR_RETURN(Calibration calibration, CalibrationFromYaml(text, file.string()));
  std::vector<Decision> decisions = WhatHolds(calibration, unit, counts);
  if (std::ranges::equal(decisions, calibration.decisions, IsSame)) return withdrawn;
  const Verdict before = calibration.verdict();
  calibration.decisions = std::move(decisions);
  if (calibration.verdict() == Verdict::kFail || calibration.verdict() != before) {
    TRUETRIAD_ASSIGN_OR_RETURN(withdrawn, WithdrawExports(folder.string()));
  }
  std::optional<std::string> report;
  if (const auto page = LookAtSmallFile((folder / "report.html").string())) {
    const bool shares = fs::exists(folder / kAssetsOfRun, failure);
    report = CalibrationHtml(calibration,
                             {.assets = std::string(shares ? kAssetsOfRun : "")},
                             {.noise = {}, .earlier_page = *page});
  }
  TRUETRIAD_RETURN_IF_ERROR(WriteResult(file.parent_path().string(), calibration, report));
  return withdrawn;
}

/// Why a unit that is not good may not be delivered.
std::string WhyHeldBack(const Standing& unit) {
  if (unit.disposed_by.empty()) {
    return "its current run " + unit.run + " is " + std::string(VerdictWords(unit.final_verdict));
  }
  return unit.disposed_by + " refused the unit (" + unit.disposed_why + ")";
}

}  // namespace

std::vector<std::string> Agreement::Notes(const std::string& serial) const {
  std::vector<std::string> notes;
  if (!withdrawn.empty()) {
    notes.push_back(serial + ": " + std::to_string(withdrawn.size()) +
                    (withdrawn.size() == 1 ? " exported file is" : " exported files are") +
                    " renamed to *.withdrawn" +
                    (why.empty()
                         ? ", since the unit's verdict has changed; export again what is needed"
                         : ", since " + why));
  }
  for (const Unreached& one : unreached) {
    notes.push_back(serial + ": " + one.error.message + (why.empty() ? "" : "; " + why) +
                    "; `export` of these files does not notice the unit's verdict");
  }
  return notes;
}

Result<Agreement> AgreeFolders(Store& store, const std::string& serial, const fs::path& units) {
  Agreement agreement;
  TRUETRIAD_ASSIGN_OR_RETURN(const std::vector<UnitRun> folders, store.FoldersOfUnit(serial));
  if (folders.empty()) return agreement;
  const FolderClaim claim =
      FolderClaim::WaitFor(fs::path(FolderOf(folders.back().folder, units)).parent_path().string());
  TRUETRIAD_ASSIGN_OR_RETURN(const std::optional<Standing> unit, store.StandingOf(serial));
  if (!unit) return agreement;
  // If only the current run has files and no person decided, these state the verdict already.
  if (folders.size() == 1 && folders.front().id == unit->run && unit->disposed_by.empty()) {
    return agreement;
  }
  TRUETRIAD_ASSIGN_OR_RETURN(const auto given_up, store.GivenUpOf(serial));
  if (IsRed(unit->final_verdict)) agreement.why = WhyHeldBack(*unit);
  for (const UnitRun& one : folders) {
    // A run that was given up does not belong to the unit, whichever run is current.
    const auto found = given_up.find(one.id);
    const bool is_given_up = found != given_up.end();
    const Standing& holds = is_given_up ? found->second : *unit;
    const bool counts = is_given_up || one.id == unit->run;
    const std::string folder = FolderOf(one.folder, units);
    const Result<std::vector<std::string>> withdrawn = Agree(folder, holds, counts);
    if (withdrawn) {
      agreement.withdrawn.insert(agreement.withdrawn.end(), withdrawn->begin(), withdrawn->end());
      continue;
    }
    // A run without a result has nothing to deliver.
    const bool could_leave = one.verdict != Verdict::kNoResult;
    const bool is_red = IsRed(holds.final_verdict), is_decided = !holds.disposed_by.empty();
    if (is_red ? !could_leave || !(is_decided || !counts) : !(is_decided && counts)) continue;
    std::error_code failure;
    agreement.unreached.push_back({withdrawn.error(), fs::exists(folder, failure)});
    if (is_red) agreement.why = WhyHeldBack(holds);
  }
  return agreement;
}

std::string FolderOf(const std::string& folder, const fs::path& units) {
  const fs::path named(folder);
  std::error_code failure;
  if (folder.empty() || units.empty()) return folder;
  for (const fs::path& place : {units / named.parent_path().filename() / named.filename(),
                                named,
                                units.parent_path() / named}) {
    if (fs::is_directory(place, failure)) return place.string();
  }
  return folder;
}

std::optional<HeldByStore> WhatStoreHolds(const fs::path& folder, const Calibration& calibration) {
  std::error_code failure;
  const fs::path run = fs::canonical(folder, failure);
  const fs::path store = run.parent_path().parent_path().parent_path() / "fleet.db";
  if (failure || !IsRunId(run.filename().string()) || !fs::exists(store, failure)) return {};
  const Result<std::unique_ptr<Store>> opened = OpenStoreToRead(store.string());
  if (!opened) return {};
  const Result<bool> has_run = (*opened)->Has(run.filename().string());
  if (!has_run || !*has_run) return {};
  Result<std::optional<Standing>> unit = (*opened)->StandingOf(calibration.serial);
  if (!unit || !*unit) return {};
  const bool counts = (*unit)->run == run.filename();
  HeldByStore held{**unit, counts, WhatHolds(calibration, **unit, counts)};
  const bool is_refused =
      !held.decisions.empty() && held.decisions.back().verdict == Verdict::kFail;
  if (is_refused || calibration.decisions.empty()) return held;
  // The files may have later decisions from another store, into which this store was collected.
  const Decision& last = calibration.decisions.back();
  bool is_of_another =
      counts && ((*unit)->disposed_by.empty() || last.created > (*unit)->disposed_at);
  if (last.is_automatic) {
    const bool names_run = last.who.starts_with(kRunWord);
    const Result<bool> is_here =
        names_run ? (*opened)->Has(last.who.substr(kRunWord.size())) : false;
    is_of_another = !is_here || !*is_here;
  }
  if (is_of_another) held.decisions = calibration.decisions;
  return held;
}

fs::path UnitsBeside(const std::string& store_url) {
  const std::optional<std::string> file = FileOfStore(store_url);
  return file ? fs::path(*file).parent_path() / "units" : fs::path();
}

}  // namespace truetriad::fleet
