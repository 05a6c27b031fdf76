// SPDX-License-Identifier: Apache-2.0
#include "tools/truetriad/output_folder.h"

#include <system_error>

#include "io/input_guard.h"
#include "io/whole_file.h"
#include "tools/truetriad/flags.h"
#include "truetriad/io/calibration_file.h"

namespace truetriad {
namespace {

constexpr char kAside[] = ".aside", kPrevious[] = ".previous";

}  // namespace

Status WriteFiles(const FileTexts& files) {
  WholeFiles whole;
  for (const auto& [path, text] : files) TRUETRIAD_RETURN_IF_ERROR(whole.Write(path, text));
  return whole.Commit();
}

Status EnsureFolderOf(const std::string& file) {
  const std::filesystem::path folder = std::filesystem::path(file).parent_path();
  return folder.empty() ? Status() : EnsureWritableDirectory(folder.string());
}

std::string InOutput(const std::string& name) {
  return (std::filesystem::path(FLAGS_output) / name).string();
}

Status CheckCanWriteBelow(std::filesystem::path directory) {
  directory = std::filesystem::absolute(directory).lexically_normal();
  std::error_code missing;
  while (!std::filesystem::exists(directory, missing) && directory.has_relative_path()) {
    directory = directory.parent_path();
  }
  return EnsureWritableDirectory(directory.string());
}

Status MoveAside(const std::filesystem::path& directory, const std::vector<std::string>& names) {
  std::string moved;
  for (const std::string& name : names) {
    const std::filesystem::path from = directory / name;
    std::error_code failure;
    if (!std::filesystem::is_regular_file(from, failure)) continue;
    const std::filesystem::path to =
        directory / (from.stem().string() + ".previous" + from.extension().string());
    for (const std::string& path : {from.string(), to.string()}) {
      if (InputGuard::Holds(path)) return InputGuard::Refusal(path);
    }
    std::filesystem::rename(from, to, failure);
    if (failure) {
      return Error(ErrorCode::kCannotWrite,
                   {from.string()},
                   "is the result of an earlier run and cannot be renamed to " + to.string() +
                       ": " + failure.message());
    }
    moved += (moved.empty() ? "" : ", ") + name + " to " + to.filename().string();
  }
  if (!moved.empty()) {
    Note(directory.string() + ": results of an earlier run are moved: " + moved);
  }
  return {};
}

Result<FolderGivesWay> FolderGivesWay::For(const std::filesystem::path& folder,
                                           const std::filesystem::path& input) {
  std::error_code failure;
  const std::filesystem::path inside =
      std::filesystem::weakly_canonical(input, failure)
          .lexically_relative(std::filesystem::weakly_canonical(folder, failure));
  if (!inside.empty() && *inside.begin() != "..") {
    return Error(ErrorCode::kOutputInTheWay,
                 {folder.string()},
                 "has the log in it and would be replaced; choose another --output");
  }
  FolderGivesWay gives_way(folder);
  const std::filesystem::path aside = gives_way.Named(kAside);
  // Beside one that a killed run put aside is what that run had of its own.
  if (std::filesystem::exists(aside, failure)) {
    std::filesystem::remove_all(folder, failure);
  } else if (std::filesystem::exists(folder, failure)) {
    std::filesystem::rename(folder, aside, failure);
  }
  if (failure) {
    gives_way.folder_.clear();
    return Error(
        ErrorCode::kCannotWrite, {folder.string()}, "cannot be replaced: " + failure.message());
  }
  return gives_way;
}

FolderGivesWay::FolderGivesWay(std::filesystem::path folder) : folder_(std::move(folder)) {
  std::error_code ignored;
  has_made_parent_ = !std::filesystem::exists(folder_.parent_path(), ignored);
}

FolderGivesWay::FolderGivesWay(FolderGivesWay&& other) noexcept
    : folder_(std::exchange(other.folder_, {})), has_made_parent_(other.has_made_parent_) {}

void FolderGivesWay::Keep(End of_earlier) {
  // No longer aside before it goes: what is aside comes back.
  std::error_code ignored;
  const bool is_previous = of_earlier == End::kIsPrevious;
  const std::filesystem::path to =
      is_previous ? Named(kPrevious) : std::filesystem::path(TemporaryNameBeside(folder_.string()));
  if (std::filesystem::exists(Named(kAside), ignored)) {
    std::filesystem::remove_all(to, ignored);
    std::filesystem::rename(Named(kAside), to, ignored);
    if (!is_previous) std::filesystem::remove_all(to, ignored);
  }
  folder_.clear();
}

FolderGivesWay::~FolderGivesWay() {
  if (folder_.empty()) return;
  std::error_code ignored;
  const std::filesystem::path aside = Named(kAside);
  std::filesystem::remove_all(folder_, ignored);
  if (std::filesystem::exists(aside, ignored)) std::filesystem::rename(aside, folder_, ignored);
  if (has_made_parent_) std::filesystem::remove(folder_.parent_path(), ignored);
}

Status CheckIsOfUnit(const std::filesystem::path& directory, const std::string& serial) {
  const std::filesystem::path file = directory / "calibration.yaml";
  std::error_code failure;
  if (serial.empty() || !std::filesystem::is_regular_file(file, failure)) return {};
  const Result<std::string> there = ReadSerial(file.string());
  if (!there || there->empty() || *there == serial) return {};
  return Error(ErrorCode::kOtherDevice,
               {file.string()},
               "is the calibration of unit `" + *there + "`, and this one is of `" + serial +
                   "`; choose another --output, or replace it with --overwrite");
}

Status WriteStatedReport(const std::string& html, VerbResult* result) {
  if (FLAGS_report.empty()) return {};
  TRUETRIAD_RETURN_IF_ERROR(EnsureFolderOf(FLAGS_report));
  TRUETRIAD_RETURN_IF_ERROR(WriteFileAtomically(FLAGS_report, html));
  result->text += "\nReport: " + FLAGS_report + '\n';
  result->result["report"] = FLAGS_report;
  return {};
}

Status CheckSameUnit(const std::string& what, const std::string& serial, const Calibration& of) {
  if (serial.empty() || of.serial.empty() || serial == of.serial) return {};
  return Error(ErrorCode::kOtherDevice,
               what + " is of unit `" + serial + "`, but the calibration is of `" + of.serial +
                   "`; give those of one unit");
}

Status CheckSameSensors(const std::string& what,
                        const Calibration& one,
                        const Calibration& other,
                        const std::string& remedy) {
  TRUETRIAD_RETURN_IF_ERROR(CheckSameUnit(what, one.serial, other));
  for (const Triad triad : kTriads) {
    const auto &id = one.tags.device_ids[triad], &other_id = other.tags.device_ids[triad];
    if (!id || !other_id || *id == *other_id) continue;
    return Error(ErrorCode::kOtherDevice,
                 what + ": its " + std::string(TriadName(triad)) + " has device id " +
                     std::to_string(*id) + ", but that of the other calibration has " +
                     std::to_string(*other_id) + "; " + remedy);
  }
  return {};
}

}  // namespace truetriad
