// SPDX-License-Identifier: Apache-2.0
#include "truetriad/report/report.h"

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <filesystem>
#include <set>

#include "io/whole_file.h"
#include "tools/truetriad/command.h"
#include "tools/truetriad/flags.h"
#include "tools/truetriad/plot_script.h"
#include "truetriad/io/calibration_file.h"

namespace truetriad {
namespace {

/// The calibrations of --calibration and of the words after the flags.
std::vector<std::string> InputFiles(const std::vector<std::string>& words) {
  std::vector<std::string> files = CommaSeparated(FLAGS_calibration);
  files.insert(files.end(), words.begin(), words.end());
  return files;
}

/// "A0001.html" after the serial number, "A0001-2.html" when that is taken.
std::string PageName(const Calibration& calibration, std::set<std::string>* taken) {
  std::string base = calibration.serial.empty() ? "report" : calibration.serial;
  std::replace_if(
      base.begin(),
      base.end(),
      [](unsigned char c) { return std::isalnum(c) == 0 && c != '-' && c != '_'; },
      '_');
  std::string name = base;
  for (int i = 2; !taken->insert(name).second; ++i) name = base + '-' + std::to_string(i);
  return name + ".html";
}

Result<VerbResult> RunReport(const std::vector<std::string>& words) {
  const std::vector<std::string> files = InputFiles(words);
  std::vector<Calibration> calibrations;
  for (const std::string& file : files) {
    TRUETRIAD_ASSIGN_OR_RETURN(Calibration calibration, ReadCalibration(file));
    calibrations.push_back(std::move(calibration));
  }
  const bool is_page = std::filesystem::path(FLAGS_output).extension() == ".html";
  if (is_page && files.size() > 1) {
    return Error(ErrorCode::kConflictingArguments,
                 "--output=" + FLAGS_output + " is one page, but there are " +
                     std::to_string(files.size()) + " calibrations; name a folder instead");
  }
  if (!is_page) TRUETRIAD_RETURN_IF_ERROR(EnsureWritableDirectory(FLAGS_output));
  VerbResult result;
  WholeFiles written;
  std::set<std::string> taken;
  for (const Calibration& calibration : calibrations) {
    const std::string page =
        is_page ? FLAGS_output
                : (std::filesystem::path(FLAGS_output) / PageName(calibration, &taken)).string();
    TRUETRIAD_RETURN_IF_ERROR(written.Write(page, CalibrationHtml(calibration, StatedLooks())));
    result.text += page + '\n';
    result.result["pages"].push_back(page);
  }
  TRUETRIAD_RETURN_IF_ERROR(written.Commit());
  return result;
}

}  // namespace

Command ReportCommand() {
  return {
      .name = "report",
      .summary = "How do I get the HTML report again?",
      .examples =
          "build/truetriad calibrate --config=configs/experiments/joint.yaml --output=out/demo\n"
          "build/truetriad report --calibration=out/demo/calibration.yaml "
          "--output=out/demo/again.html",
      .details =
          "Writes the HTML report again. For several calibrations, separated by commas or "
          "blanks,\nwrites one page each into a folder, named after the serial number.\n",
      .flags = {{"calibration", "FILE[,FILE]", true},
                {"output", "PAGE.html|DIR", true},
                {"interactive", "true|false", false, {"true", "false"}}},
      .more_words = "calibration",
      .run = RunReport};
}

}  // namespace truetriad
