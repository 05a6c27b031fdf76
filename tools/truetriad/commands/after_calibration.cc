// SPDX-License-Identifier: Apache-2.0
#include <cctype>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <system_error>
#include <vector>

#include <gflags/gflags.h>

#include "allan/allan_file.h"
#include "base/messages.h"
#include "base/rounded_text.h"
#include "fleet/unit_folders.h"
#include "report/content.h"
#include "report/table.h"
#include "tools/truetriad/command.h"
#include "tools/truetriad/flags.h"
#include "tools/truetriad/interruption.h"
#include "tools/truetriad/output_folder.h"
#include "tools/truetriad/progress.h"
#include "truetriad/base/result.h"
#include "truetriad/base/triad.h"
#include "truetriad/formats/export.h"
#include "truetriad/io/calibration_file.h"
#include "truetriad/io/recording.h"
#include "truetriad/report/report.h"
#include "truetriad/session/session.h"

DEFINE_string(max_loss,
              "",
              "SHARE: refuse the export if a corrected reading may have an error above this share "
              "of the signal, as in 0.01");
DEFINE_string(temperature,
              "",
              "DEGC: temperature (degC) at which to evaluate a calibration with thermal terms, for "
              "formats that hold only constants (default: the calibration's reference)");
DEFINE_string(id,
              "",
              "DEVICE_ID: the sensor's device id: one number for all sensors, or "
              "accelerometer:N,gyroscope:N,magnetometer:N");
DEFINE_string(allan,
              "",
              "FILE: allan.yaml written by `allan`: noise densities and rate, for Kalibr and other "
              "formats with noise");
DEFINE_string(laboratory,
              "",
              "FILE: laboratory.yaml: who calibrates with what equipment, for `record`");
DEFINE_string(from, "", "FORMAT: the format, from the list above");

namespace truetriad {
namespace {

/// Warns if the mean length of the corrected readings is far from gravity or the field: the log
/// states a wrong unit of measure, or the calibration is of another device. Motion hardly changes
/// the mean.
void TellOddLength(const CorrectedLogSummary& summary, const Calibration& calibration) {
  constexpr double kOdd = 3.0;  // A wrong unit of measure is off by more: g by 9.8.
  const auto tell = [&](Triad triad, double expected, const char* field) {
    const double length = summary.mean_length[triad];
    if (!(length > 0.0) || (length < kOdd * expected && length * kOdd > expected)) return;
    Warn("the corrected " + std::string(TriadName(triad)) + Format(" reads %.3g ", length) +
         std::string(TruthUnitName(triad)) + Format(" on average, %.3g times ", length / expected) +
         field +
         ": check the unit that the log states, and that the calibration is of this device");
  };
  tell(Triad::kAccelerometer, calibration.reference.gravity_mps2, "gravity");
  if (calibration.reference.field_ut) {
    tell(Triad::kMagnetometer, *calibration.reference.field_ut, "the field it was calibrated in");
  }
}

/// Prints notes on the rows to stderr, since stdout may be the log itself.
void Tell(const CorrectedLogSummary& summary) {
  Note(FLAGS_output + ": " + std::to_string(summary.rows) + " rows written");
  for (const Triad triad : summary.left_out) {
    Note(std::string(TriadName(triad)) + " skipped: the calibration does not include it");
  }
  const auto note_rows = [](const auto count, const char* what) {
    if (count > 0) Note(std::to_string(count) + " rows " + what);
  };
  note_rows(
      summary.clamped_temperature,
      "outside the calibrated temperature range: corrected as if at the nearer end of the range");
  note_rows(summary.not_corrected,
            "with a sensor left empty: the log had not yet stated the temperature or force that "
            "its correction needs");
}

Result<VerbResult> RunApply(const std::vector<std::string>&) {
  TRUETRIAD_ASSIGN_OR_RETURN(const Calibration calibration, ReadCalibration(FLAGS_calibration));
  TRUETRIAD_ASSIGN_OR_RETURN(const std::unique_ptr<SampleSource> source,
                             OpenRecording(FLAGS_input));
  TRUETRIAD_RETURN_IF_ERROR(CheckSameSensors(
      FLAGS_input + ": the recording", source->info().serial, source->info().tags, calibration));
  // The output is renamed to its path when it is complete, so the path must not be a device or a
  // link.
  const std::filesystem::path output = FLAGS_output;
  if (std::error_code none; std::filesystem::exists(output, none) &&
                            !is_regular_file(std::filesystem::symlink_status(output, none))) {
    return Error(ErrorCode::kConflictingArguments,
                 "--output=" + FLAGS_output + " exists and is not a regular file");
  }
  if (calibration.verdict() == Verdict::kFail) {
    Warn(FLAGS_calibration + ": " + HeadlineOf(calibration).text +
         "; the readings are corrected nevertheless");
  }
  NoteInterruptions();
  ProgressLine progress("correcting " + FLAGS_input);
  const Result<CorrectedLogSummary> summary =
      WriteCorrectedLog(*source, calibration, FLAGS_output, progress.callback(), IsInterrupted);
  progress.Wipe();
  if (!FLAGS_json) EndAsInterrupted();
  TRUETRIAD_RETURN_IF_ERROR(summary);
  Tell(*summary);
  TellOddLength(*summary, calibration);
  VerbResult result;
  result.result = {{"output", FLAGS_output},
                   {"rows", summary->rows},
                   {"clamped_temperature", summary->clamped_temperature},
                   {"not_corrected", summary->not_corrected},
                   {"left_out", Json::array()}};
  for (const Triad triad : summary->left_out) {
    result.result["left_out"].push_back(TriadName(triad));
  }
  return result;
}

Result<PerTriad<std::optional<std::int64_t>>> ParseIds() {
  PerTriad<std::optional<std::int64_t>> ids;
  for (const std::string& item : CommaSeparated(FLAGS_id)) {
    const std::size_t colon = item.find(':');
    const bool for_all = colon == std::string::npos;
    if (for_all && item != FLAGS_id) {
      return BadValue("id",
                      FLAGS_id,
                      " has a number without a sensor; expected one number for all sensors, or "
                      "accelerometer:N,gyroscope:N,magnetometer:N");
    }
    TRUETRIAD_ASSIGN_OR_RETURN(const std::int64_t id,
                               ParseInteger("id", for_all ? item : item.substr(colon + 1)));
    const std::optional<Triad> triad = TriadFromName(item.substr(0, colon));
    if (!for_all && !triad) {
      return Error(ErrorCode::kInvalidArgument,
                   "--id: `" + item.substr(0, colon) +
                       "` is not a sensor; expected accelerometer, gyroscope or magnetometer");
    }
    for (const Triad each : kTriads) {
      if (for_all || each == *triad) ids[each] = id;
    }
  }
  return ids;
}

Result<ExportOptions> ParseOptions() {
  ExportOptions options;
  options.software_version = Version();
  options.file_name = FLAGS_output;
  if (!FLAGS_max_loss.empty()) {
    TRUETRIAD_ASSIGN_OR_RETURN(options.max_loss, ParseReal("max-loss", FLAGS_max_loss));
    if (!(*options.max_loss >= 0.0)) {
      return Error(ErrorCode::kInvalidArgument,
                   "--max-loss: expected a share of the signal, 0 or more");
    }
  }
  if (!FLAGS_temperature.empty()) {
    TRUETRIAD_ASSIGN_OR_RETURN(options.temperature_degc,
                               ParseReal("temperature", FLAGS_temperature));
  }
  TRUETRIAD_ASSIGN_OR_RETURN(options.instance, ParseInstance());
  TRUETRIAD_ASSIGN_OR_RETURN(options.device_ids, ParseIds());
  TRUETRIAD_ASSIGN_OR_RETURN(options.allows_outside_limits, AllowsOutsideLimits());
  TRUETRIAD_ASSIGN_OR_RETURN(options.units, ParseUnits());
  if (!FLAGS_allan.empty()) {
    TRUETRIAD_ASSIGN_OR_RETURN(options.allan, ReadAllanFile(FLAGS_allan));
  }
  const std::string ending = std::filesystem::path(FLAGS_output).extension().string();
  if (FLAGS_to == "record" && ending != ".html" && ending != ".htm" && ending != ".json") {
    return BadValue(
        "output", FLAGS_output, ": a record is a page or JSON; end the name in .html or .json");
  }
  if (!FLAGS_laboratory.empty()) {
    if (FLAGS_to != "record") {
      return Error(ErrorCode::kConflictingArguments,
                   "--laboratory applies only to --to=record; leave it out for " + FLAGS_to);
    }
    TRUETRIAD_ASSIGN_OR_RETURN(options.laboratory, ReadLaboratory(FLAGS_laboratory));
  }
  return options;
}

std::string LossText(const Export& result) {
  Table table = Headed("error; at most; RMS; of; sigma; ", "lrrrrl");
  for (const Triad triad : kTriads) {
    if (!result.loss[triad]) continue;
    const ExportLoss& loss = *result.loss[triad];
    const std::string signal = Format("%.4g", loss.signal), unit(TruthUnitName(triad));
    table.Add() << TriadName(triad) << Format("%.3g", loss.largest) << Format("%.3g", loss.rms)
                << signal << (loss.in_sigmas ? RoundedText(*loss.in_sigmas, 2) : "-") << unit;
    if (!loss.at_rates) continue;
    const auto& [range_degcps, largest, rms] = *loss.at_rates;
    table.Add() << "" << Format("%.3g", largest) << Format("%.3g", rms) << signal << "-"
                << unit + ", temperature at " + Format("%.2g", range_degcps[0]) + " to " +
                       Format("%.2g degC/s", range_degcps[1]);
  }
  return TextOf(table);
}

Json LossJson(const Export& result) {
  Json json = Json::object();
  for (const Triad triad : kTriads) {
    if (!result.loss[triad]) continue;
    const ExportLoss& loss = *result.loss[triad];
    Json& of_triad = json[std::string(TriadName(triad))];
    of_triad = {{"signal", loss.signal},
                {"largest", loss.largest},
                {"rms", loss.rms},
                {"in_sigmas", loss.in_sigmas ? Json(*loss.in_sigmas) : Json(nullptr)},
                {"unit", TruthUnitName(triad)}};
    if (!loss.at_rates) continue;
    of_triad["at_rates"] = {{"largest", loss.at_rates->largest}, {"rms", loss.at_rates->rms}};
  }
  return json;
}

Result<VerbResult> RunExport(const std::vector<std::string>&) {
  TRUETRIAD_ASSIGN_OR_RETURN(const ExportOptions options, ParseOptions());
  TRUETRIAD_ASSIGN_OR_RETURN(Calibration calibration, ReadCalibration(FLAGS_calibration));
  const std::filesystem::path folder = std::filesystem::absolute(FLAGS_calibration).parent_path();
  if (auto held = fleet::WhatStoreHolds(folder, calibration)) {
    calibration.decisions = std::move(held->decisions);
    if (!held->counts) {
      Warn(FLAGS_calibration + ": another run is the current run of this unit; the unit is " +
           fleet::ReasonOf(held->unit));
    }
  }
  if (options.allan) {
    // To use the noise of another unit of the type is common practice, but gets a warning.
    const Status same =
        CheckSameSensors(FLAGS_allan, options.allan->serial, options.allan->tags, calibration);
    if (!same) Warn(same.error().message + "; its noise is used nevertheless");
  }
  const Result<Export> result = ExportCalibration(calibration, FLAGS_to, options);
  if (!result) return Error{result.error().code, FLAGS_calibration + ": " + result.error().message};
  TRUETRIAD_RETURN_IF_ERROR(CheckIsOfUnit(
      std::filesystem::path(FLAGS_output).parent_path() / "calibration.yaml", calibration.serial));
  TRUETRIAD_RETURN_IF_ERROR(EnsureFolderOf(FLAGS_output));
  VerbResult verb{.findings = calibration.findings};
  FileTexts files;
  for (const ExportedFile& file : result->files) {
    files.emplace_back(FLAGS_output + file.suffix, file.text);
    TRUETRIAD_RETURN_IF_ERROR(CheckIsExport(files.back().first, calibration.serial));
    verb.text += files.back().first + '\n';
    verb.result["files"].push_back(files.back().first);
  }
  TRUETRIAD_RETURN_IF_ERROR(WriteFiles(files));
  verb.text += LossText(*result);
  for (const std::string& note : result->notes) verb.text += "  " + note + '\n';
  verb.result["loss"] = LossJson(*result);
  verb.result["notes"] = result->notes;
  verb.result["warnings"] = result->warnings;
  for (const std::string& warning : result->warnings) Warn(warning);
  for (const Finding& finding : result->findings) {
    Warn(finding.Message());
    verb.findings.push_back(finding);
  }
  return verb;
}

/// The formats that can be exported; with `import`, only formats that can also be imported.
std::vector<FormatInfo> FormatsThat(bool import) {
  std::vector<FormatInfo> formats = Formats();
  if (import) std::erase_if(formats, [](const FormatInfo& format) { return !format.can_import; });
  return formats;
}

std::string ListOf(const std::vector<FormatInfo>& formats) {
  Table table{.header = {}, .alignment = "ll", .rows = {}};
  for (const FormatInfo& format : formats) table.Add() << format.name << format.description;
  return "Formats:\n" + TextOf(table);
}

Result<VerbResult> RunImport(const std::vector<std::string>&) {
  ImportOptions options;
  options.software_version = Version();
  TRUETRIAD_ASSIGN_OR_RETURN(options.units, ParseUnits());
  TRUETRIAD_ASSIGN_OR_RETURN(options.instance, ParseInstance());
  TRUETRIAD_ASSIGN_OR_RETURN(options.device_ids, ParseIds());
  TRUETRIAD_ASSIGN_OR_RETURN(const Import result,
                             ImportCalibration(FLAGS_from, CommaSeparated(FLAGS_input), options));
  std::filesystem::path file = FLAGS_output;
  if (file.extension() != ".yaml" && file.extension() != ".yml") file /= "calibration.yaml";
  TRUETRIAD_RETURN_IF_ERROR(CheckIsOfUnit(file, result.calibration.serial));
  TRUETRIAD_RETURN_IF_ERROR(
      CheckMayReplace(file.string(), CalibrationIn(file.string()), result.calibration));
  TRUETRIAD_RETURN_IF_ERROR(EnsureFolderOf(file.string()));
  // An import has no JSON and no report. If it replaces a result, the JSON and the report of that
  // result are moved aside, too.
  std::vector<std::string> earlier = {file.filename().string()};
  if (earlier.front() == kResults.front()) earlier.assign(kResults.begin(), kResults.end());
  TRUETRIAD_RETURN_IF_ERROR(MoveAside(file.parent_path(), earlier));
  TRUETRIAD_RETURN_IF_ERROR(
      WriteFileAtomically(file.string(), CalibrationToYaml(result.calibration)));
  for (const std::string& note : result.notes) Note("note: " + note);
  return VerbResult{.text = file.string() + '\n',
                    .result = {{"output", file.string()}, {"notes", result.notes}}};
}

/// A page's name from the serial number: "A0001.html", or "A0001-2.html" if that name is taken.
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
  std::vector<std::string> files = CommaSeparated(FLAGS_calibration);
  files.insert(files.end(), words.begin(), words.end());
  std::vector<Calibration> calibrations;
  for (const std::string& file : files) {
    TRUETRIAD_ASSIGN_OR_RETURN(calibrations.emplace_back(), ReadCalibration(file));
  }
  const bool is_page = std::filesystem::path(FLAGS_output).extension() == ".html";
  if (is_page && files.size() > 1) {
    return Error(ErrorCode::kConflictingArguments,
                 "--output=" + FLAGS_output + " is one page, but there are " +
                     std::to_string(files.size()) + " calibrations; name a folder instead");
  }
  if (!is_page) TRUETRIAD_RETURN_IF_ERROR(EnsureWritableDirectory(FLAGS_output));
  VerbResult result;
  FileTexts pages;
  std::set<std::string> taken;
  for (const Calibration& calibration : calibrations) {
    const std::string page = is_page ? FLAGS_output : InOutput(PageName(calibration, &taken));
    pages.emplace_back(page, CalibrationHtml(calibration, StatedLooks()));
    result.text += page + '\n';
    result.result["pages"].push_back(page);
  }
  TRUETRIAD_RETURN_IF_ERROR(WriteFiles(pages));
  return result;
}

}  // namespace

Command ApplyCommand() {
  return {
      .name = "apply",
      .summary = "What would a perfect sensor have read?",
      .examples =
          R"(build/truetriad calibrate --config=configs/experiments/joint.yaml --output=out/demo
build/truetriad apply --calibration=out/demo/calibration.yaml --input=datasets/demo/recording.csv --output=out/demo/corrected.csv)",
      .details =
          R"(Writes a self-describing CSV in m/s^2, rad/s and uT with the sensors that the calibration
includes.
)",
      .flags = "calibration! input! output=CSV!",
      .words = {"calibration", "input"},
      .run = RunApply};
}

Command ExportCommand() {
  return {
      .name = "export",
      .summary = "How do I use this calibration in an autopilot, another program or firmware?",
      .examples =
          R"(build/truetriad export --calibration=datasets/demo/truth.yaml --to=px4 --output=out/demo.params)",
      .details = R"(
Reads the written file back, and compares the target system's equation, computed in that system's
arithmetic, with the calibration: over a sphere of inputs and the calibrated temperatures. The loss, their
difference, is printed and written into the file. If a unit is outside its limits, or a person refused it
(fleet dispose), it is exported only with --outside-limits=allow, and the file says so.
)",
      .list = [] { return ListOf(FormatsThat(/*import=*/false)); },
      .flags =
          "calibration! to=FORMAT! output=FILE! max-loss temperature units instance id "
          "outside-limits overwrite allan laboratory",
      .values = {{"to", NamesOf(FormatsThat(/*import=*/false))}},
      .words = {"calibration"},
      .run = RunExport};
}

Command ImportCommand() {
  return {
      .name = "import",
      .summary = "What calibration does a unit have now?",
      .examples =
          R"(build/truetriad export --calibration=datasets/demo/truth.yaml --to=px4 --output=out/carried.params
build/truetriad import --from=px4 --input=out/carried.params --output=out/carried.yaml
build/truetriad evaluate --calibration=out/carried.yaml --input=datasets/demo/recording.csv)",
      .details = R"(
Writes a calibration.yaml for `compare`, `evaluate` and `apply`; every sigma is zero. If
--output ends in .yaml it names the file, otherwise the folder for calibration.yaml.
)",
      .list = [] { return ListOf(FormatsThat(/*import=*/true)); },
      .flags = "from! input=FILE[,FILE]! output=FILE|DIR! units instance id overwrite",
      .values = {{"from", NamesOf(FormatsThat(/*import=*/true))}},
      .words = {"input"},
      .run = RunImport};
}

Command ReportCommand() {
  return {
      .name = "report",
      .summary = "How do I get the HTML report again?",
      .examples =
          R"(build/truetriad calibrate --config=configs/experiments/joint.yaml --output=out/demo
build/truetriad report --calibration=out/demo/calibration.yaml --output=out/demo/again.html)",
      .details =
          R"(Writes the HTML report again. For several calibrations, separated by commas or blanks,
writes one page each into a folder, named after the serial number.
)",
      .flags = "calibration=FILE[,FILE]! output=PAGE.html|DIR! interactive",
      .more_words = "calibration",
      .run = RunReport};
}

}  // namespace truetriad
