// SPDX-License-Identifier: Apache-2.0
#include "truetriad/formats/export.h"

#include <algorithm>
#include <deque>
#include <filesystem>
#include <iterator>
#include <set>
#include <sstream>

#include "base/utf8.h"
#include "formats/format.h"
#include "formats/parameter_pattern.h"
#include "formats/restate.h"
#include "formats/text.h"
#include "model/board_rotation.h"
#include "report/content.h"
#include "truetriad/io/calibration_file.h"

namespace truetriad {
namespace {

std::string ErrorText(Triad triad, const ExportLoss& loss) {
  std::string text = "error of at most " + RoundedText(loss.largest, 2) + " " +
                     std::string(TruthUnitName(triad)) + " (RMS " + RoundedText(loss.rms, 2) +
                     ") at a signal of " + RoundedText(loss.signal, 4);
  if (loss.in_sigmas) text += ", " + RoundedText(*loss.in_sigmas, 2) + " sigma";
  if (const auto& rates = loss.at_rates) {
    text += "; at temperature rates from " + RoundedText(rates->range_degcps[0], 2) + " to " +
            RoundedText(rates->range_degcps[1], 2) + " degC/s: at most " +
            RoundedText(rates->largest, 2) + " (RMS " + RoundedText(rates->rms, 2) + ")";
  }
  return text;
}

std::string LossText(Triad triad, const ExportLoss& loss) {
  return std::string(TriadName(triad)) + ": " + ErrorText(triad, loss);
}

/// Warns of the largest error of each sensor for which this error exceeds the calibration's own
/// uncertainty.
void WarnOfLoss(std::string_view format,
                const std::vector<PerTriad<std::optional<ExportLoss>>>& losses,
                std::vector<std::string>* warnings) {
  std::string most;
  for (const Triad triad : kTriads) {
    double largest = 0.0;
    for (const auto& loss : losses) {
      const bool is_more = loss[triad] && loss[triad]->in_sigmas && *loss[triad]->in_sigmas > 1.0;
      if (is_more) largest = std::max(largest, loss[triad]->largest);
    }
    if (largest == 0.0) continue;
    most += (most.empty() ? "" : ", ") + RoundedText(largest, 2) + " " +
            std::string(TruthUnitName(triad)) + " (" + std::string(TriadName(triad)) + ")";
  }
  if (most.empty()) return;
  warnings->push_back(std::string(format) +
                      " cannot hold the whole calibration: the error, up to " + most +
                      ", exceeds the calibration's uncertainty; the file's comments state each "
                      "sensor's error");
}

/// Warns of a sensor that is mounted at an angle which the format cannot hold.
void FindDroppedTurn(Triad triad,
                     const Restated& restated,
                     const ExportLoss& loss,
                     std::string_view format,
                     Findings* findings) {
  const double turn_deg = restated.dropped_turn_deg[triad];
  if (turn_deg < SmallestBoardTurnDeg()) return;
  findings->push_back(
      Finding(FindingCode::kMessage,
              std::string(TriadName(triad)) + ": is rotated by " + RoundedText(turn_deg, 3) +
                  " deg against the other sensors' axes, and " + std::string(format) +
                  " cannot hold this rotation, so that its results have an " +
                  ErrorText(triad, loss),
              "correct the sensor's mounting, or its rotation in the vehicle's parameters, and "
              "record again")
          .As(Severity::kWarning)
          .About(triad)
          .With("turn", turn_deg, "deg"));
}

/// Warns if the options state another device ID or slot for a sensor than its log states.
void WarnOfNumbers(const Calibration& calibration,
                   const ExportOptions& stated,
                   std::vector<std::string>* warnings) {
  const Tags& tags = calibration.tags;
  for (const Triad triad : kTriads) {
    if (!calibration.sensors[triad]) continue;
    const std::string name(TriadName(triad));
    const auto &id = tags.device_ids[triad], &stated_id = stated.device_ids[triad];
    const auto& slot = tags.device_slots[triad];
    if (id && stated_id && *id != *stated_id) {
      warnings->push_back(name + ": its device id in the log is " + std::to_string(*id) +
                          ", but --id states " + std::to_string(*stated_id) +
                          ", which is another sensor's");
    } else if (slot && stated.instance && *slot != *stated.instance && *slot != Tags::kNoSlot) {
      warnings->push_back(name +
                          ": according to the log, the vehicle has the parameters of this sensor "
                          "under the number " +
                          std::to_string(*slot) +
                          ", but --instance=" + std::to_string(*stated.instance) + " is stated");
    }
  }
}

/// The reason why the unit may not be delivered, "FAIL by R. Roe on 2026-11-25: connector bent" or
/// the limit that it misses; empty if it may be delivered.
std::string WhyHeldBack(const Calibration& calibration) {
  if (calibration.verdict() != Verdict::kFail) return "";
  if (!calibration.decisions.empty()) return DecisionText(calibration.decisions.back());
  const std::vector<LimitCheck>& limits = calibration.quality.limits;
  return limits.empty() ? "FAIL" : "FAIL, " + MissedText(WorstLimit(limits));
}

Status CheckMayLeave(const std::string& why, const ExportOptions& options) {
  if (why.empty() || options.allows_outside_limits) return {};
  return Error(
      ErrorCode::kOutsideLimits,
      "this unit may not be delivered (" + why +
          "), so nothing is exported; measure it again, or state "
          "--outside-limits=allow; the file then states that the unit must not be delivered");
}

/// Replaces characters that a comment cannot hold.
std::vector<std::string> Plain(std::vector<std::string> lines) {
  for (std::string& line : lines) {
    for (char& c : line) {
      // A serial number must not end the comment or reverse the direction of the text after it.
      if (static_cast<unsigned char>(c) < ' ') c = ' ';
    }
    line = PrintableLine(line);
  }
  return lines;
}

/// The lines of a file's comment: what a reader of the file must know.
std::vector<std::string> Comment(const Format& format,
                                 const Restated& restated,
                                 const ExportOptions& options,
                                 const std::string& why_held_back) {
  const Calibration& held = restated.held;
  std::vector<std::string> lines;
  if (!why_held_back.empty()) {
    lines.push_back(std::string(kMustNotLeave) + ": " + why_held_back + ".");
  }
  lines.insert(
      lines.end(),
      {UnitPhrase(held.serial) + (held.model.empty() ? "" : " (" + held.model + ")") + ", for " +
           std::string(format.info.name) +
           (options.instance ? ", instance " + std::to_string(*options.instance) : "") + ".",
       std::string(kExportedBy) + options.software_version + " at " + TimestampUtc() +
           std::string(kWasCalibrated) +
           (held.created.empty() ? "at an unknown time" : held.created) + ".",
       "Gauge " + std::string(GaugeName(held.gauge)) + " of the " +
           std::string(TriadName(held.gauge_sensor)) + "."});
  lines.insert(lines.end(), options.further_comment.begin(), options.further_comment.end());
  if (held.verdict() == Verdict::kPass && !held.decisions.empty()) {
    lines.push_back(DecisionText(held.decisions.back()) + "; by the limits alone it is " +
                    std::string(VerdictWords(held.LimitsVerdict())) + ".");
  }
  for (const Triad triad : kTriads) {
    const std::optional<TriadCalibration>& sensor = held.sensors[triad];
    if (!sensor) continue;
    lines.push_back(UnitComment(triad, sensor->input_unit, sensor->output_unit));
  }
  return Plain(std::move(lines));
}

/// Adds the text of another instance. A parameter that is common to all instances is written once.
void Append(const std::string& text, std::string* file) {
  if (file->empty()) {
    *file = text;
    return;
  }
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    line += '\n';
    if (line.starts_with('#') || file->find('\n' + line) == std::string::npos) *file += line;
  }
}

/// Adds the export of an instance to `beside`. `which`: the text with which each of its warnings
/// begins.
void Add(const Export& exported,
         const std::string& which,
         const std::string& file_name,
         int instance,
         ExportsBeside* beside) {
  for (const ExportedFile& file : exported.files) {
    Append(file.text, &beside->files[file_name + file.suffix]);
  }
  for (const std::string& warning : exported.warnings) beside->warnings.push_back(which + warning);
  for (Finding finding : exported.findings) {
    beside->findings.push_back(finding.With("instance", instance));
  }
}

/// Adds each sensor's device ID and parameter sets from the log to the options. If the options
/// state another device ID for a sensor, its sets are not added.
void AddNumbersOf(const Tags& tags, bool is_slot_stated, ExportOptions* options) {
  for (const Triad triad : kTriads) {
    std::optional<std::int64_t>& id = options->device_ids[triad];
    if (!id) id = tags.device_ids[triad];
    if (id != tags.device_ids[triad]) continue;
    if (!is_slot_stated) options->slots[triad] = tags.device_slots[triad];
    options->thermal_slots[triad] = tags.thermal_slots[triad];
    options->idle_thermal_slots[triad] = tags.idle_thermal_slots[triad];
  }
}

/// As ExportCalibration. `why_held_back`: why the unit or its device may not be delivered; empty if
/// it may be delivered. `instance`: which of several equal sensors this is, if the options do not
/// state it.
Result<Export> ExportUnlessHeldBack(const Calibration& calibration,
                                    std::string_view format_name,
                                    const ExportOptions& stated,
                                    const std::string& why_held_back,
                                    const std::optional<int>& instance = {}) {
  ExportOptions options = stated;
  if (!stated.instance) options.instance = instance;
  TRUETRIAD_ASSIGN_OR_RETURN(const Format* const found, FindFormat(format_name));
  const Format& format = *found;
  // IDs and slots hold only for the firmware from whose log they were read.
  const std::string& firmware = calibration.tags.firmware;
  const bool is_another =
      format.is_firmware && !firmware.empty() && !Reads(firmware, format.info.name);
  if (!is_another) AddNumbersOf(calibration.tags, stated.instance.has_value(), &options);
  const bool is_its = format.is_firmware && !is_another;
  TRUETRIAD_RETURN_IF_ERROR(CheckMayLeave(why_held_back, options));
  TRUETRIAD_ASSIGN_OR_RETURN(const Restated restated, Restate(calibration, format, options));
  Export result{
      .notes = restated.notes, .warnings = restated.warnings, .is_turned = restated.is_turned};
  if (is_its) WarnOfNumbers(calibration, stated, &result.warnings);
  if (is_another && calibration.tags.device_ids != PerTriad<std::optional<std::int64_t>>()) {
    result.warnings.push_back("the log is of " + firmware + ", and " +
                              std::string(format.info.name) +
                              " uses other device ids; state them with --id");
  }
  std::vector<std::string> comment = Comment(format, restated, options, why_held_back);

  // The file is written, read back and compared, then written again with the results in it.
  std::vector<std::string> said_twice;
  TRUETRIAD_ASSIGN_OR_RETURN(
      const Files draft, format.write({restated.held, options, comment, &calibration, said_twice}));
  TRUETRIAD_ASSIGN_OR_RETURN(const Carried carried,
                             format.read({.files = draft,
                                          .instance = options.instance,
                                          .slots = options.slots,
                                          .firmware = calibration.tags.firmware}));
  for (const Triad triad : kTriads) {
    const std::optional<CorrectionParts>& parts = carried.parts[triad];
    const Equation equation =
        parts ? EquationOf(*parts, format.info.arithmetic) : carried.equations[triad];
    if (!restated.held.sensors[triad] || !equation) continue;
    const ExportLoss loss = LossOf(triad, equation, restated, calibration);
    const std::string text = LossText(triad, loss);
    comment.push_back(text + ".");
    if (options.max_loss && !(loss.share() <= *options.max_loss)) {
      return Error(ErrorCode::kNotRepresentable,
                   {text},
                   "more than --max-loss=" + RoundedText(*options.max_loss, 6) +
                       " allows; nothing was written");
    }
    if (format.is_firmware)
      FindDroppedTurn(triad, restated, loss, format.info.name, &result.findings);
    result.loss[triad] = loss;
  }
  for (const std::string& note : result.notes) comment.push_back(note + ".");
  TRUETRIAD_ASSIGN_OR_RETURN(
      result.files, format.write({restated.held, options, comment, &calibration, result.warnings}));
  return result;
}

/// The calibration of `result`, with a corrected list of idle sets of temperature terms: adds the
/// idle sets of the results that are not written, and removes the sets that a written result uses.
/// `exports[i]` is unset if results[i] is not written.
Calibration BesideUnwritten(const std::vector<ResultOfInstance>& results,
                            const std::vector<std::optional<Export>>& exports,
                            const ResultOfInstance& result) {
  Calibration calibration = *result.calibration;
  for (const Triad triad : kTriads) {
    std::set<std::int64_t> written, idle;
    for (std::size_t i = 0; i < results.size(); ++i) {
      const Calibration& other = *results[i].calibration;
      const std::optional<std::int64_t>& slot = other.tags.thermal_slots[triad];
      if (!slot) continue;
      if (exports[i] && other.sensors[triad]) {
        written.insert(*slot);
      } else if (std::ranges::count(other.tags.idle_thermal_slots[triad], *slot) > 0) {
        idle.insert(*slot);
      }
    }
    std::vector<std::int64_t>& all = calibration.tags.idle_thermal_slots[triad];
    idle.insert(all.begin(), all.end());
    all.clear();
    std::ranges::set_difference(idle, written, std::back_inserter(all));
  }
  return calibration;
}

/// If a sensor of `result` would use the same parameter set of `format` as a sensor of another
/// result: which one, and why. Empty if there is no such sensor.
std::string SharedSlot(const std::vector<ResultOfInstance>& results,
                       const ResultOfInstance& result,
                       const FormatInfo& format) {
  const auto slot_of = [&](const ResultOfInstance& of, Triad triad) -> std::int64_t {
    const Calibration& calibration = *of.calibration;
    if (!calibration.IsUsable() || !calibration.sensors[triad]) return Tags::kNoSlot;
    const bool is_its = Reads(calibration.tags.firmware, format.name);
    const auto stated = is_its ? calibration.tags.device_slots[triad] : std::nullopt;
    return stated.value_or(*format.first_instance + of.instance);
  };
  for (const Triad triad : kTriads) {
    const std::int64_t slot = slot_of(result, triad);
    const auto& id = result.calibration->tags.device_ids[triad];
    for (const ResultOfInstance& other : results) {
      const auto& its_id = other.calibration->tags.device_ids[triad];
      // If only the sensor of `result` has a device ID, the other sensor is the one that is left
      // out.
      if (&other == &result || slot == Tags::kNoSlot || slot_of(other, triad) != slot ||
          (id && !its_id)) {
        continue;
      }
      const std::string name(TriadName(triad)), instance = std::to_string(other.instance);
      return id && id == its_id
                 ? "its " + name + " has the device id " + std::to_string(*id) +
                       ", and so has the same sensor of instance " + instance +
                       ": firmware could not distinguish them"
                 : "its " + name + " would use the same parameters as that of instance " +
                       instance + "; export one of them separately, with `export --instance`";
    }
  }
  return "";
}

/// Exports the results of a device to one format.
class FormatOfDevice {
 public:
  FormatOfDevice(const std::vector<ResultOfInstance>& results,
                 const FormatInfo& info,
                 const std::string& why_of_device,
                 ExportOptions options)
      : results_(results),
        info_(info),
        why_of_device_(why_of_device),
        options_(std::move(options)),
        exports_(results.size()) {
    for (ResultOfInstance& result : results_) {
      result.calibration = &calibrations_.emplace_back(*result.calibration);
    }
  }

  Status AddTo(ExportsBeside* beside) {
    for (std::size_t i = 0; i < results_.size(); ++i) TRUETRIAD_RETURN_IF_ERROR(Try(i, beside));
    std::vector<PerTriad<std::optional<ExportLoss>>> losses;
    for (std::size_t i = 0; i < results_.size(); ++i) {
      if (!exports_[i]) continue;
      // Which results are written is known only after all were tried.
      const Calibration calibration = BesideUnwritten(results_, exports_, results_[i]);
      if (info_.first_instance &&
          (calibration.tags != results_[i].calibration->tags || !unwritten_.empty())) {
        options_.further_comment = std::exchange(unwritten_, {});  // Once per file.
        TRUETRIAD_ASSIGN_OR_RETURN(exports_[i], ExportOf(results_[i], calibration));
        options_.further_comment.clear();
      }
      const std::string file = FileOf(results_[i]), which = Which(results_[i]);
      Add(*exports_[i], which, file, results_[i].instance, beside);
      losses.push_back(exports_[i]->loss);
    }
    WarnOfLoss(info_.name, losses, &beside->warnings);
    return {};
  }

 private:
  std::string FileOf(const ResultOfInstance& result) const {
    const std::string& folder = info_.first_instance ? results_.front().folder : result.folder;
    return (std::filesystem::path(folder) / info_.file_name).string();
  }
  /// The beginning of a warning: the file, and the instance if there are several.
  std::string Which(const ResultOfInstance& result) const {
    return FileOf(result) + ": " +
           (results_.size() > 1 ? "instance " + std::to_string(result.instance) + ": " : "");
  }
  Result<Export> ExportOf(const ResultOfInstance& result, const Calibration& calibration) {
    options_.file_name = FileOf(result);
    std::optional<int> instance = info_.first_instance;
    if (instance) *instance += result.instance;
    const std::string why = WhyHeldBack(calibration);
    return ExportUnlessHeldBack(
        calibration, info_.name, options_, why.empty() ? why_of_device_ : why, instance);
  }
  /// Exports one result. If the result or one of its sensors cannot be written, warns of this.
  Status Try(std::size_t i, ExportsBeside* beside) {
    const ResultOfInstance& result = results_[i];
    const std::string shared = info_.first_instance ? SharedSlot(results_, result, info_) : "";
    if (!shared.empty()) {
      beside->is_whole = false;
      SayUnwritten(result, "is not written: " + shared, beside);
      return {};
    }
    Result<Export> exported = ExportOf(result, *result.calibration);
    // The vehicle of the log corrects the readings in the sensor's own axes, without the
    // calibration's rotation. A rotated sensor is therefore left out.
    const bool is_its = Reads(result.calibration->tags.firmware, info_.name);
    if (exported && is_its && exported->is_turned != PerTriad<bool>()) {
      beside->is_whole = false;
      for (const Triad triad : kTriads) {
        if (!exported->is_turned[triad]) continue;
        SayUnwritten(result,
                     "its " + std::string(TriadName(triad)) +
                         " is not written: it is rotated against the other sensors, and the log "
                         "does not state this rotation; set it in the vehicle, and record again",
                     beside);
        calibrations_[i].sensors[triad].reset();
      }
      for (const Finding& finding : exported->findings) {
        beside->findings.push_back(Finding(finding).With("instance", result.instance));
      }
      exported = ExportOf(result, *result.calibration);
    }
    if (exported) {
      exports_[i] = *std::move(exported);
      return {};
    }
    const ErrorCode why_not = exported.error().code;
    const bool has_nothing =
        !result.calibration->IsUsable() || why_not == ErrorCode::kMissingSensor;
    if (!has_nothing && why_not != ErrorCode::kNotRepresentable) return exported.error();
    beside->is_whole = beside->is_whole && has_nothing;
    SayUnwritten(result, "is not written: " + exported.error().message, beside);
    return {};
  }
  /// Warns that a result is not written. The file with the other results will state this, too.
  void SayUnwritten(const ResultOfInstance& result,
                    const std::string& what,
                    ExportsBeside* beside) {
    beside->warnings.push_back(Which(result) + what);
    unwritten_.push_back("Instance " + std::to_string(result.instance) + ": " + what + ".");
  }

  std::vector<ResultOfInstance> results_;  ///< Point to `calibrations_`.
  std::deque<Calibration> calibrations_;
  const FormatInfo& info_;
  const std::string& why_of_device_;
  ExportOptions options_;
  std::vector<std::optional<Export>> exports_;  ///< Unset: the result is not written.
  std::vector<std::string> unwritten_;          ///< Comments about results that are not written.
};

}  // namespace

Result<Export> ExportCalibration(const Calibration& calibration,
                                 std::string_view format,
                                 const ExportOptions& options) {
  Result<Export> result =
      ExportUnlessHeldBack(calibration, format, options, WhyHeldBack(calibration));
  if (result) WarnOfLoss(format, {result->loss}, &result->warnings);
  return result;
}

Result<ExportsBeside> ExportBeside(const std::vector<ResultOfInstance>& results,
                                   const std::vector<std::string>& formats,
                                   ExportOptions options) {
  ExportsBeside beside;
  // If the unit of one result may not be delivered, the files of all results of the device state
  // this. A result that is not usable is left out with a warning.
  std::string why_of_device;
  for (const ResultOfInstance& result : results) {
    if (why_of_device.empty()) why_of_device = WhyHeldBack(*result.calibration);
  }
  for (const std::string& format : formats) {
    TRUETRIAD_ASSIGN_OR_RETURN(const FormatInfo info, InfoOfFormat(format));
    const Status may_leave = CheckMayLeave(why_of_device, options);
    if (!may_leave) {
      beside.warnings.push_back(std::string(info.file_name) +
                                " is not written: " + may_leave.error().message);
      continue;
    }
    TRUETRIAD_RETURN_IF_ERROR(FormatOfDevice(results, info, why_of_device, options).AddTo(&beside));
  }
  return beside;
}

Result<Export> ExportNoise(std::string_view format_name, const ExportOptions& options) {
  TRUETRIAD_ASSIGN_OR_RETURN(const Format* const format, FindFormat(format_name));
  if (!options.allan) {
    return Error(ErrorCode::kMissingArgument, "there is no Allan deviation to take noise from");
  }
  Calibration perfect;
  perfect.outcome = Outcome::kConverged;
  for (const AllanTriad& found : options.allan->triads) {
    TriadCalibration& sensor = perfect.sensors[found.triad].emplace();
    sensor.input_unit = sensor.output_unit = TruthUnitName(found.triad);
  }
  TRUETRIAD_ASSIGN_OR_RETURN(const Restated restated, Restate(perfect, *format, options));
  const std::string& serial = options.allan->serial;
  const std::vector<std::string> comment =
      Plain({"Noise at rest of " + UnitName(serial) + ", for " + std::string(format->info.name) +
                 "; not calibrated.",
             std::string(kExportedBy) + options.software_version + " at " + TimestampUtc() + "."});
  Export result;
  TRUETRIAD_ASSIGN_OR_RETURN(
      result.files, format->write({restated.held, options, comment, &perfect, result.warnings}));
  return result;
}

}  // namespace truetriad
