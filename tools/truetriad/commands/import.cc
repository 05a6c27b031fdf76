// SPDX-License-Identifier: Apache-2.0
#include "truetriad/formats/import.h"

#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include <gflags/gflags.h>

#include "tools/truetriad/command.h"
#include "tools/truetriad/flags.h"
#include "tools/truetriad/format_flags.h"
#include "truetriad/base/version.h"
#include "truetriad/formats/export.h"
#include "truetriad/io/calibration_file.h"
#include "truetriad/session/session.h"

DEFINE_string(from, "", "the format, from the list above");

namespace truetriad {
namespace {

Result<VerbResult> RunImport(const std::vector<std::string>&) {
  ImportOptions options;
  options.software_version = Version();
  TRUETRIAD_ASSIGN_OR_RETURN(const auto units, ParseUnits());
  options.units = units;
  TRUETRIAD_ASSIGN_OR_RETURN(const std::optional<int> instance, ParseInstance());
  options.instance = instance;
  const std::vector<std::string> paths = CommaSeparated(FLAGS_input);
  TRUETRIAD_ASSIGN_OR_RETURN(const Import result, ImportCalibration(FLAGS_from, paths, options));

  std::filesystem::path file = FLAGS_output;
  if (file.extension() != ".yaml" && file.extension() != ".yml") file /= "calibration.yaml";
  if (const Result<std::string> there = ReadSerial(file.string());
      there && !there->empty() && *there != result.calibration.serial) {
    return Error(ErrorCode::kOtherDevice,
                 {file.string()},
                 "is the calibration of unit `" + *there + "`; choose another --output");
  }
  if (file.has_parent_path()) {
    TRUETRIAD_RETURN_IF_ERROR(EnsureWritableDirectory(file.parent_path().string()));
  }
  TRUETRIAD_RETURN_IF_ERROR(
      WriteFileAtomically(file.string(), CalibrationToYaml(result.calibration)));
  for (const std::string& note : result.notes) Note("note: " + note);
  return VerbResult{.text = file.string() + '\n',
                    .result = {{"output", file.string()}, {"notes", result.notes}}};
}

std::vector<std::string> ImportedFormatNames() {
  std::vector<std::string> names;
  for (const FormatInfo& format : Formats()) {
    if (format.can_import) names.emplace_back(format.name);
  }
  return names;
}

std::string ImportedFormatList() {
  std::string text = "Formats:\n";
  for (const FormatInfo& format : Formats()) {
    if (!format.can_import) continue;
    std::string name(format.name);
    name.resize(15, ' ');
    text += "  " + name + std::string(format.description) + "\n";
  }
  return text;
}

}  // namespace

Command ImportCommand() {
  static const std::string& details = *new std::string(
      ImportedFormatList() +
      "\nWrites a calibration.yaml for `compare`, `evaluate` and `apply`; every sigma is zero. "
      "If\n--output ends in .yaml it names the file, otherwise the folder for calibration.yaml.\n");
  return {.name = "import",
          .summary = "What calibration does a unit have now?",
          .examples =
              "build/truetriad export --calibration=datasets/demo/truth.yaml --to=px4 "
              "--output=out/carried.params\n"
              "build/truetriad import --from=px4 --input=out/carried.params "
              "--output=out/carried.yaml\n"
              "build/truetriad evaluate --calibration=out/carried.yaml "
              "--input=datasets/demo/recording.csv",
          .details = details,
          .flags = {{"from", "FORMAT", true, ImportedFormatNames()},
                    {"input", "FILE[,FILE]", true},
                    {"output", "FILE|DIR", true},
                    {"units", "UNIT[,UNIT]"},
                    {"instance", "N"}},
          .words = {"input"},
          .run = RunImport};
}

}  // namespace truetriad
