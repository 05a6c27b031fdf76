// SPDX-License-Identifier: Apache-2.0
#include "truetriad/formats/export.h"

#include <array>
#include <cstdio>
#include <filesystem>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include <gflags/gflags.h>

#include "allan/allan_file.h"
#include "io/whole_file.h"
#include "tools/truetriad/command.h"
#include "tools/truetriad/flags.h"
#include "tools/truetriad/format_flags.h"
#include "truetriad/base/units.h"
#include "truetriad/base/version.h"
#include "truetriad/io/calibration_file.h"
#include "truetriad/session/session.h"

DEFINE_string(to, "", "the format, one that this page or that of `export` lists");
DEFINE_string(
    max_loss,
    "",
    "refuse if a corrected reading may be off by more than this share of the signal, as in 0.01");
DEFINE_string(temperature,
              "",
              "temperature (degC) at which to evaluate a calibration with thermal terms, for "
              "formats that hold only constants (default: the calibration's reference)");
DEFINE_string(id,
              "",
              "the sensor's device id: one number for all sensors, or "
              "accelerometer:N,gyroscope:N,magnetometer:N");
DEFINE_string(allan,
              "",
              "allan.yaml written by `allan`: noise densities and rate, for Kalibr and other "
              "formats with noise");
DEFINE_string(laboratory, "", "laboratory.yaml: who calibrates with what equipment, for `record`");

namespace truetriad {
namespace {

Result<PerTriad<std::optional<std::int64_t>>> ParseIds() {
  PerTriad<std::optional<std::int64_t>> ids;
  std::istringstream items(FLAGS_id);
  for (std::string item; std::getline(items, item, ',');) {
    const std::size_t colon = item.find(':');
    const bool for_all = colon == std::string::npos;
    if (for_all && item != FLAGS_id) {
      return Error(ErrorCode::kInvalidArgument,
                   "--id=" + FLAGS_id +
                       ": which sensors' are they? expected one number for all, or "
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
    TRUETRIAD_ASSIGN_OR_RETURN(const double share, ParseReal("max-loss", FLAGS_max_loss));
    if (!(share >= 0.0))
      return Error(ErrorCode::kInvalidArgument,
                   "--max-loss: expected a share of the signal, 0 or more");
    options.max_loss = share;
  }
  if (!FLAGS_temperature.empty()) {
    TRUETRIAD_ASSIGN_OR_RETURN(const double temperature,
                               ParseReal("temperature", FLAGS_temperature));
    options.temperature_degc = temperature;
  }
  TRUETRIAD_ASSIGN_OR_RETURN(const std::optional<int> instance, ParseInstance());
  options.instance = instance;
  TRUETRIAD_ASSIGN_OR_RETURN(const auto ids, ParseIds());
  options.device_ids = ids;
  TRUETRIAD_ASSIGN_OR_RETURN(options.allows_outside_limits, AllowsOutsideLimits());
  TRUETRIAD_ASSIGN_OR_RETURN(const auto units, ParseUnits());
  options.units = units;
  if (!FLAGS_allan.empty()) {
    TRUETRIAD_ASSIGN_OR_RETURN(AllanResult allan, ReadAllanFile(FLAGS_allan));
    options.allan = std::move(allan);
  }
  const std::string ending = std::filesystem::path(FLAGS_output).extension().string();
  if (FLAGS_to == "record" && ending != ".html" && ending != ".htm" && ending != ".json") {
    return Error(ErrorCode::kInvalidArgument,
                 "--output=" + FLAGS_output +
                     ": a record is a page or JSON; end the name in .html or .json");
  }
  if (!FLAGS_laboratory.empty()) {
    if (FLAGS_to != "record") {
      return Error(ErrorCode::kConflictingArguments,
                   "--laboratory is for --to=record; " + FLAGS_to + " has no place for it");
    }
    TRUETRIAD_ASSIGN_OR_RETURN(Laboratory laboratory, ReadLaboratory(FLAGS_laboratory));
    options.laboratory = std::move(laboratory);
  }
  return options;
}

std::string LossLine(std::string_view name,
                     double largest,
                     double rms,
                     double signal,
                     const std::string& sigmas,
                     const std::string& unit) {
  std::array<char, 160> line{};
  std::snprintf(line.data(),
                line.size(),
                "  %-14s %12.3g %12.3g %10.4g %8s  ",
                std::string(name).c_str(),
                largest,
                rms,
                signal,
                sigmas.c_str());
  return line.data() + unit + '\n';
}

std::string LossText(const Export& result) {
  std::array<char, 160> head{};
  std::snprintf(head.data(),
                head.size(),
                "  %-14s %12s %12s %10s %8s\n",
                "off by",
                "at most",
                "RMS",
                "of",
                "sigma");
  std::string text = head.data();
  for (const Triad triad : kTriads) {
    if (!result.loss[triad]) continue;
    const ExportLoss& loss = *result.loss[triad];
    const std::string sigmas =
        loss.in_sigmas ? std::to_string(*loss.in_sigmas).substr(0, 6) : std::string("-");
    const std::string unit(TruthUnitName(triad));
    text += LossLine(TriadName(triad), loss.largest, loss.rms, loss.signal, sigmas, unit);
    if (!loss.at_rates) continue;
    const auto& [range_degcps, largest, rms] = *loss.at_rates;
    std::array<char, 80> rates{};
    std::snprintf(rates.data(),
                  rates.size(),
                  ", temperature at %.2g to %.2g degC/s",
                  range_degcps[0],
                  range_degcps[1]);
    text += LossLine("", largest, rms, loss.signal, "-", unit + rates.data());
  }
  return text;
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
  TRUETRIAD_ASSIGN_OR_RETURN(const Calibration calibration, ReadCalibration(FLAGS_calibration));
  const Result<Export> result = ExportCalibration(calibration, FLAGS_to, options);
  if (!result) return Error{result.error().code, FLAGS_calibration + ": " + result.error().message};
  const std::filesystem::path folder = std::filesystem::path(FLAGS_output).parent_path();
  if (!folder.empty()) TRUETRIAD_RETURN_IF_ERROR(EnsureWritableDirectory(folder.string()));
  VerbResult verb;
  WholeFiles files;
  for (const ExportedFile& file : result->files) {
    const std::string path = FLAGS_output + file.suffix;
    TRUETRIAD_RETURN_IF_ERROR(files.Write(path, file.text));
    verb.text += path + '\n';
    verb.result["files"].push_back(path);
  }
  TRUETRIAD_RETURN_IF_ERROR(files.Commit());
  verb.text += LossText(*result);
  for (const std::string& note : result->notes) verb.text += "  " + note + '\n';
  verb.result["loss"] = LossJson(*result);
  verb.result["notes"] = result->notes;
  verb.result["warnings"] = result->warnings;
  for (const std::string& warning : result->warnings) Warn(warning);
  return verb;
}

std::vector<std::string> ExportNames() {
  std::vector<std::string> names;
  for (const FormatInfo& format : Formats()) names.emplace_back(format.name);
  return names;
}

std::string ExportList() {
  std::string text = "Formats:\n";
  for (const FormatInfo& format : Formats()) {
    std::string name(format.name);
    name.resize(15, ' ');
    text += "  " + name + std::string(format.description) + "\n";
  }
  return text;
}

}  // namespace

Command ExportCommand() {
  static const std::string& details = *new std::string(
      ExportList() +
      "\nThe file is read back, and the target system's equation, in its own arithmetic, is "
      "compared\nwith the calibration over a sphere of inputs and the calibrated temperatures. The "
      "loss is\nprinted and written into the file. A unit outside its limits, or refused by a "
      "person "
      "(fleet dispose),\nis exported with --outside-limits=allow alone, and the file says so.\n");
  return {.name = "export",
          .summary = "How do I use this calibration in an autopilot, another program or firmware?",
          .examples =
              "build/truetriad export --calibration=datasets/demo/truth.yaml --to=px4 "
              "--output=out/demo.params",
          .details = details,
          .flags = {{"calibration", "FILE", true},
                    {"to", "FORMAT", true, ExportNames()},
                    {"output", "FILE", true},
                    {"max-loss", "SHARE"},
                    {"temperature", "DEGC"},
                    {"units", "UNIT[,UNIT]"},
                    {"instance", "N"},
                    {"id", "DEVICE_ID"},
                    {"outside-limits", "refuse|allow", false, {"refuse", "allow"}},
                    {"allan", "FILE"},
                    {"laboratory", "FILE"}},
          .words = {"calibration"},
          .run = RunExport};
}

}  // namespace truetriad
