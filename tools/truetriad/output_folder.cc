// SPDX-License-Identifier: Apache-2.0
#include "tools/truetriad/output_folder.h"

#include <algorithm>
#include <filesystem>
#include <string_view>
#include <system_error>

#include "io/input_guard.h"
#include "io/whole_file.h"
#include "io/yaml_reader.h"
#include "tools/truetriad/flags.h"
#include "truetriad/formats/export.h"
#include "truetriad/io/calibration_file.h"
#include "truetriad/session/session.h"

namespace truetriad {

namespace {

constexpr std::string_view kReplaceRemedy =
    "choose another --output, or replace it with --overwrite";

/// Whether replacing `earlier` by `now` loses parameters of a sensor or their uncertainty.
bool HasMore(const Calibration& earlier, const std::optional<Calibration>& now) {
  if (!earlier.IsUsable() || !now || !now->IsUsable()) return earlier.IsUsable();
  // An imported calibration has no uncertainty.
  if (now->covariance.matrix.isZero(0.0) && !earlier.covariance.matrix.isZero(0.0)) return true;
  return std::ranges::any_of(
      kTriads, [&](Triad triad) { return earlier.sensors[triad] && !now->sensors[triad]; });
}

}  // namespace

Status WriteFiles(const FileTexts& files) {
  WholeFiles whole;
  for (const auto& [path, text] : files) TRUETRIAD_RETURN_IF_ERROR(whole.Write(path, text));
  return whole.Commit();
}

std::optional<Calibration> CalibrationIn(const std::string& file) {
  const Result<std::string> text = LookAtSmallFile(file);
  if (!text) return std::nullopt;
  Result<Calibration> there = CalibrationFromYaml(*text, file);
  return there ? std::optional(std::move(*there)) : std::nullopt;
}

Status CheckIsOfUnit(const std::filesystem::path& file, const std::string& serial) {
  std::error_code failure;
  if (FLAGS_overwrite || !std::filesystem::is_regular_file(file, failure)) return {};
  const Result<std::string> there = ReadSerial(file.string());
  if (!there || there->empty() || *there == serial) return {};
  return Error(ErrorCode::kOtherDevice,
               {file.string()},
               "is the calibration of unit `" + *there + "`" +
                   (serial.empty() ? "" : ", and this one is of `" + serial + "`") + "; " +
                   std::string(kReplaceRemedy));
}

Status CheckMayReplace(const std::string& file,
                       const std::optional<Calibration>& there,
                       const Calibration& calibration) {
  if (FLAGS_overwrite || !there) return {};
  return CheckSameSensors(file, *there, calibration, std::string(kReplaceRemedy));
}

Status CheckIsExport(const std::string& file, const std::string& serial) {
  std::error_code failure;
  if (FLAGS_overwrite || !std::filesystem::is_regular_file(file, failure)) return {};
  TRUETRIAD_RETURN_IF_ERROR(WholeFile(file).status());
  TRUETRIAD_ASSIGN_OR_RETURN(const bool is_export, IsExport(file, serial));
  if (is_export) return {};
  return Error(ErrorCode::kOutputInTheWay,
               {file},
               "exists and is not a file that truetriad exported for " +
                   (serial.empty() ? "a unit without serial number" : "unit `" + serial + "`") +
                   "; " + std::string(kReplaceRemedy));
}

std::string PreviousSuffix(const std::filesystem::path& name, const std::string& rest) {
  const std::optional<Calibration> now = CalibrationIn(name.string() + rest);
  for (int i = 1;; ++i) {
    std::string suffix = i == 1 ? ".previous" : ".previous-" + std::to_string(i);
    const std::optional<Calibration> earlier = CalibrationIn(name.string() + suffix + rest);
    if (!earlier || !HasMore(*earlier, now)) return suffix;
  }
}

Status MoveAside(const std::filesystem::path& directory, std::span<const std::string> names) {
  std::optional<std::string> of_result;  // All files of one result get the same suffix.
  std::string moved;
  for (const std::string& name : names) {
    const std::filesystem::path from = directory / name;
    std::error_code failure;
    if (!std::filesystem::is_regular_file(from, failure)) continue;
    const std::string extension = from.extension().string();
    const bool is_result = std::ranges::find(kResults, name) != kResults.end();
    if (is_result && !of_result) of_result = PreviousSuffix(directory / "calibration", ".yaml");
    const std::string suffix =
        is_result ? *of_result : PreviousSuffix(directory / from.stem(), extension);
    const std::filesystem::path to = directory / (from.stem().string() + suffix + extension);
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
    Note((directory.empty() ? "." : directory.string()) +
         ": files of an earlier run are renamed: " + moved);
  }
  return {};
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

Status WriteStatedReport(const std::string& html, VerbResult* result) {
  if (FLAGS_report.empty()) return {};
  TRUETRIAD_RETURN_IF_ERROR(EnsureFolderOf(FLAGS_report));
  TRUETRIAD_RETURN_IF_ERROR(WriteFileAtomically(FLAGS_report, html));
  result->text += "\nReport: " + FLAGS_report + '\n';
  result->result["report"] = FLAGS_report;
  return {};
}

Result<VerbResult> Said(const VerbReport& report, Json json, int exit_code) {
  VerbResult result{.exit_code = exit_code,
                    .text = report.text,
                    .result = std::move(json),
                    .grade = report.grade};
  TRUETRIAD_RETURN_IF_ERROR(WriteStatedReport(report.html, &result));
  return result;
}

}  // namespace truetriad
