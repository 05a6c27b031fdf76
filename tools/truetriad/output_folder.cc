// SPDX-License-Identifier: Apache-2.0
#include "tools/truetriad/output_folder.h"

#include <system_error>

#include "io/input_guard.h"
#include "io/whole_file.h"
#include "tools/truetriad/flags.h"
#include "truetriad/io/calibration_file.h"

namespace truetriad {

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
  if (!std::filesystem::exists(folder, failure)) return gives_way;
  const std::filesystem::path aside = TemporaryNameBeside(folder.string());
  std::filesystem::rename(folder, aside, failure);
  if (failure) {
    return Error(
        ErrorCode::kCannotWrite, {folder.string()}, "cannot be replaced: " + failure.message());
  }
  gives_way.aside_ = aside;
  return gives_way;
}

FolderGivesWay::FolderGivesWay(FolderGivesWay&& other) noexcept
    : folder_(std::exchange(other.folder_, {})),
      aside_(std::exchange(other.aside_, {})),
      is_kept_(other.is_kept_) {}

FolderGivesWay::~FolderGivesWay() {
  if (folder_.empty()) return;
  std::error_code ignored;
  if (!is_kept_) {
    std::filesystem::remove_all(folder_, ignored);
    if (!aside_.empty()) std::filesystem::rename(aside_, folder_, ignored);
    std::filesystem::remove(folder_.parent_path(), ignored);  // Unless there is something in it.
  } else if (!aside_.empty()) {
    std::filesystem::remove_all(aside_, ignored);
  }
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
  const std::filesystem::path folder = std::filesystem::path(FLAGS_report).parent_path();
  if (!folder.empty()) TRUETRIAD_RETURN_IF_ERROR(EnsureWritableDirectory(folder.string()));
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

Status CheckSameSensors(const std::string& what, const Calibration& one, const Calibration& other) {
  TRUETRIAD_RETURN_IF_ERROR(CheckSameUnit(what, one.serial, other));
  for (const Triad triad : kTriads) {
    const auto &id = one.tags.device_ids[triad], &other_id = other.tags.device_ids[triad];
    if (!id || !other_id || *id == *other_id) continue;
    return Error(ErrorCode::kOtherDevice,
                 what + ": its " + std::string(TriadName(triad)) + " has device id " +
                     std::to_string(*id) + ", but that of the other calibration has " +
                     std::to_string(*other_id) +
                     "; give calibrations of one sensor (`import --instance=N` chooses it)");
  }
  return {};
}

}  // namespace truetriad
