// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <charconv>
#include <deque>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "allan/allan_file.h"
#include "allan/allan_report.h"
#include "fleet/store.h"
#include "fleet/unit_folders.h"
#include "io/calibration_tree.h"
#include "io/input_guard.h"
#include "io/text_file.h"
#include "io/whole_file.h"
#include "io/yaml_reader.h"
#include "model/mechanisms.h"
#include "report/content.h"
#include "tools/truetriad/command.h"
#include "tools/truetriad/flags.h"
#include "tools/truetriad/log_conversion.h"
#include "tools/truetriad/output_folder.h"
#include "tools/truetriad/progress.h"
#include "truetriad/base/result.h"
#include "truetriad/calibrate/evaluate.h"
#include "truetriad/config/experiment.h"
#include "truetriad/formats/export.h"
#include "truetriad/io/calibration_file.h"
#include "truetriad/io/recording.h"
#include "truetriad/report/report.h"
#include "truetriad/session/session.h"

DEFINE_string(
    solver,
    "eliminated",
    "eliminated|ceres: solver: eliminated (poses and motion are eliminated first) or ceres "
    "(without elimination; slower, for comparison)");

namespace truetriad {
namespace {

namespace fs = std::filesystem;

/// The task of calibrating one instance of the sensors.
struct Task {
  Experiment experiment;
  std::string folder;
  std::string initial_yaml;  // the generated experiment, if none was given
  std::optional<LoadedPoses> first;
  bool has_report = true;
  int instance = 0;              // number of the instance
  bool has_others = false;       // other instances in the log have a task, too
  std::optional<Error> refusal;  // why the recording is unreadable
  // Makes the task anew without sensors that prevent a result for the others.
  std::function<Result<Task>(const PerTriad<bool>& left_out)> without;
  PerTriad<bool> left_out = {};
  Findings lost;  // why sensors were left out
};

/// The calibration in a folder.
std::optional<Calibration> ThatIn(const fs::path& folder, const char* name = "calibration.yaml") {
  return CalibrationIn((folder / name).string());
}

/// Drawings for each sensor whose noise comes from an Allan deviation.
std::vector<Drawing> AllanDrawings(const Task& task) {
  std::vector<Drawing> drawings;
  for (const Triad triad : kTriads) {
    const std::string& file = task.experiment.allan_files[triad];
    if (file.empty() || !task.experiment.options.triads[triad].enabled) continue;
    Result<AllanResult> allan = ReadAllanFile(file);
    if (!allan) continue;  // Unlikely: the calibration has read the file before.
    std::erase_if(allan->triads, [&](const AllanTriad& other) { return other.triad != triad; });
    drawings.push_back(AllanDrawing(*allan));
  }
  return drawings;
}

/// A calibration with its task and poses.
struct Done {
  Task task;
  std::optional<Calibration> there;  ///< The previous result.
  Calibration calibration;
  PoseSet poses;
  Json json;

  std::string Path(const std::string& name) const {
    return (fs::path(task.folder) / name).string();
  }
  /// Whether the previous result must be kept beside the new one: it has parameters, and the new
  /// result lacks all of them, those of a lost sensor, or the serial number (unless --overwrite).
  bool StaysBeside() const {
    if (!there || !there->IsUsable()) return false;
    const bool loses = std::ranges::any_of(
        task.lost, [&](const Finding& lost) { return there->sensors[*lost.sensor].has_value(); });
    if (loses || !calibration.IsUsable()) return true;
    return !FLAGS_overwrite && calibration.serial.empty() && !there->serial.empty();
  }
  /// The exit code by this result alone, as if no other sensor blocked the device.
  int exit_code() const {
    if (!calibration.IsUsable() || !task.lost.empty()) return kExitNotEnough;
    const std::vector<Decision>& decisions = calibration.decisions;
    const bool by_others = !decisions.empty() && decisions.back().is_automatic;
    const Verdict own = by_others ? calibration.LimitsVerdict() : calibration.verdict();
    return own == Verdict::kFail ? kExitOutsideLimits : kExitGood;
  }
  /// Ranks results: good ones 0, units outside their limits 1, and results without parameters
  /// higher.
  int badness() const { return exit_code() == kExitOutsideLimits ? 1 : exit_code(); }
};

/// If a later recording gave no result, the previous result is kept, but blocked from delivery.
Status HoldBackEarlier(const Done& by) {
  if (by.calibration.IsUsable()) return {};
  Calibration earlier = *by.there;
  earlier.decisions.push_back({.verdict = Verdict::kFail,
                               .who = "a later recording",
                               .why = "it gave no result",
                               .created = by.calibration.created,
                               .is_automatic = true});
  return fleet::WriteResult(by.task.folder, earlier, std::nullopt);
}

/// The finding for a recording that cannot be read.
Finding RefusalOfReading(Error error) {
  const auto code = error.code == ErrorCode::kStuckSensor
                        ? FindingCode::kStuckReadings
                        : FindingCodeFromName(InfoOf(error.code).name);
  // An error about a file may have several lines; a finding has one.
  std::string& message = error.message;
  for (std::size_t end = 0; (end = message.find('\n', end)) != std::string::npos;)
    message.replace(end, 1, "; ");
  Finding refusal = RefusalOf(error, code.value_or(FindingCode::kNoReadings));
  if (!error.finding) refusal.remedy.clear();  // The error's message states a remedy.
  return refusal;
}

/// The result for sensors whose recording is unreadable, if others of the device have results.
Calibration Unread(const Experiment& experiment, const Error& error) {
  Calibration calibration;
  calibration.serial = experiment.serial;
  calibration.software_version = Version();
  calibration.created = TimestampUtc();
  calibration.findings = {RefusalOfReading(error)};
  calibration.outcome = OutcomeOf(calibration.findings);
  calibration.config_yaml = experiment.resolved_yaml;
  return calibration;
}

/// An opener of recordings that leaves out the sensors `left_out`; unset if there are none.
RecordingOpener Leaving(const PerTriad<bool>& left_out) {
  if (left_out == PerTriad<bool>()) return {};
  return [left_out](const std::string& input, OpenRecordingOptions options) {
    options.left_out = left_out;
    return OpenRecording(input, options);
  };
}

Result<Calibration> CalibrationFor(Task* task, PoseSet* poses) {
  if (task->refusal) return *task->refusal;
  ProgressLine progress("reading " + task->experiment.inputs.front());
  return CalibrateExperiment(task->experiment,
                             progress.callback(),
                             std::exchange(task->first, std::nullopt),
                             poses,
                             Leaving(task->left_out));
}

/// The finding on the sensor whose readings the error refuses; unset: the error is about no sensor.
std::optional<Finding> RefusedSensor(Error error) {
  // The key is like "applied.gyroscope". If the error has several lines, the key belongs to the
  // first line.
  const std::optional<Triad> triad = TriadFromName(error.key.substr(error.key.rfind('.') + 1));
  if (!triad || error.kind() != ErrorKind::kBadInput) return std::nullopt;
  error.message.erase(std::min(error.message.find('\n'), error.message.size()));
  return RefusalOfReading(std::move(error)).About(*triad);
}

/// If the refused readings of a sensor prevent a result for the other sensors of its instance,
/// calibrates the others. With limits there is no result: a device with a broken sensor fails.
Result<Calibration> WithoutRefused(Result<Calibration> made, Task* task, PoseSet* poses) {
  if (made) return made;
  Task rest = *task;
  Result<Calibration> found = made;
  while (task->without && !found && Acts(Mechanism::kLostSensor)) {
    std::optional<Finding> why = RefusedSensor(found.error());
    if (!why || std::exchange(rest.left_out[*why->sensor], true)) return made;
    rest.lost.push_back(*std::move(why));
    Result<Task> again = task->without(rest.left_out);
    if (!again) {
      found = again.error();
      continue;
    }
    if (!again->experiment.options.limits.limits.empty()) return made;
    again->left_out = rest.left_out;
    again->experiment.options.solver = task->experiment.options.solver;
    found = CalibrationFor(&*again, poses);
    rest.experiment = again->experiment;
    rest.initial_yaml = again->initial_yaml;
  }
  if (rest.lost.empty()) return made;
  for (Finding& finding : rest.lost) {
    finding.text = "this sensor is left out, so that the others have a result: " + finding.text;
    found->findings.push_back(finding.As(Severity::kWarning));
  }
  rest.refusal.reset();
  *task = std::move(rest);
  return found;
}

Result<Done> Calibrated(Task task) {
  TRUETRIAD_RETURN_IF_ERROR(CheckCanWriteBelow(task.folder));
  const std::string file = (fs::path(task.folder) / "calibration.yaml").string();
  const auto check_unit = [&file](const std::string& serial) {
    return serial.empty() ? Status() : CheckIsOfUnit(file, serial);
  };
  TRUETRIAD_RETURN_IF_ERROR(check_unit(task.experiment.serial));
  PoseSet poses;
  Result<Calibration> made = WithoutRefused(CalibrationFor(&task, &poses), &task, &poses);
  if (!made && task.has_others && made.error().kind() != ErrorKind::kUsage) {
    task.refusal = made.error();
    task.has_report = false;
    made = Unread(task.experiment, *task.refusal);
  }
  TRUETRIAD_ASSIGN_OR_RETURN(Calibration calibration, std::move(made));
  TRUETRIAD_RETURN_IF_ERROR(check_unit(calibration.serial));
  std::optional<Calibration> there = CalibrationIn(file);
  TRUETRIAD_RETURN_IF_ERROR(CheckMayReplace(file, there, calibration));
  return Done{std::move(task), std::move(there), std::move(calibration), std::move(poses), {}};
}

/// Writes a result into `files`. `aside` gets the names of existing files that must be kept.
Status Write(Done* done, std::vector<std::string>* aside, WholeFiles* files) {
  const Task& task = done->task;
  std::error_code failure;
  const bool is_foreign = !done->there && fs::exists(done->Path("calibration.yaml"), failure);
  if (done->StaysBeside() || is_foreign) {
    aside->insert(aside->end(), kResults.begin(), kResults.end());
  }
  if (!task.initial_yaml.empty()) {
    const std::string& path = task.experiment.path;
    const Result<std::string> there = LookAtSmallFile(path);
    // The user may have edited the experiment of an earlier run.
    if (!there || *there != task.initial_yaml) aside->emplace_back("experiment.yaml");
    TRUETRIAD_RETURN_IF_ERROR(files->Write(path, task.initial_yaml));
  }
  // The calibration comes last: if it exists, the other files of the result exist, too.
  if (task.has_report) {
    TRUETRIAD_RETURN_IF_ERROR(
        files->Write(done->Path("report.html"),
                     CalibrationHtml(done->calibration,
                                     StatedLooks(),
                                     {.poses = &done->poses, .noise = AllanDrawings(task)})));
  } else {
    aside->emplace_back("report.html");
  }
  done->json = CalibrationTree(done->calibration);
  TRUETRIAD_RETURN_IF_ERROR(files->Write(done->Path("calibration.json"), TextOf(done->json)));
  return files->Write(done->Path("calibration.yaml"), CalibrationToYaml(done->calibration));
}

/// The sensor instance in the name of a result folder, "instance-2"; unset: any other name, such as
/// "instance-2.previous".
std::optional<int> InstanceOf(const std::string& name) {
  constexpr std::string_view kPrefix = "instance-";
  int instance = 0;
  const char* const end = name.data() + name.size();
  if (!name.starts_with(kPrefix)) return std::nullopt;
  const auto read = std::from_chars(name.data() + kPrefix.size(), end, instance);
  return read.ec == std::errc() && read.ptr == end ? std::optional(instance) : std::nullopt;
}

/// The folders of earlier results for sensor instances that are not in `all`.
std::vector<fs::path> OtherInstances(const std::vector<Done>& all) {
  std::vector<fs::path> others;
  std::error_code failure;
  fs::directory_iterator entry(all.front().task.folder, failure);
  for (const fs::directory_iterator end; !failure && entry != end; entry.increment(failure)) {
    const std::optional<int> instance = InstanceOf(entry->path().filename().string());
    const bool is_own = std::any_of(
        all.begin(), all.end(), [&](const Done& done) { return done.task.instance == instance; });
    if (instance && !is_own) others.push_back(entry->path());
  }
  std::sort(others.begin(), others.end());
  return others;
}

/// Why the result of one `instance` blocks the delivery of the device; unset: this result does not
/// block it.
std::optional<Decision> HeldBackBy(const Calibration& calibration, const std::string& instance) {
  const std::vector<Decision>& decisions = calibration.decisions;
  for (const Finding& finding : calibration.findings) {
    if (finding.code == FindingCode::kJoinedRecording && finding.severity == Severity::kRefusal)
      return Decision{Verdict::kFail, instance, finding.text, calibration.created, true};
  }
  if (calibration.verdict() != Verdict::kFail) return std::nullopt;
  if (!decisions.empty() && decisions.back().is_automatic) return std::nullopt;
  return Decision{.verdict = Verdict::kFail,
                  .who = instance,
                  .why = !decisions.empty() ? DecisionText(decisions.back())
                         : calibration.quality.limits.empty()
                             ? "FAIL"
                             : MissedText(WorstLimit(calibration.quality.limits)),
                  .created = calibration.created,
                  .is_automatic = true};
}

/// HeldBackBy for the result in `folder` of another instance, if it is of the device `serial`.
std::optional<Decision> HeldBackByOther(const fs::path& folder, const std::string& serial) {
  const std::optional<Calibration> there = ThatIn(folder);
  if (!there || there->serial != serial) return std::nullopt;
  return HeldBackBy(*there, folder.filename().string());
}

/// If an earlier log had instances that this log lacks, renames their results to
/// instance-N.previous, unless they block the device.
Status MoveOtherInstancesAside(const std::vector<Done>& all) {
  // With --instance only the result of that instance is replaced.
  if (!FLAGS_instance.empty()) return {};
  for (const fs::path& folder : OtherInstances(all)) {
    if (HeldBackByOther(folder, all.front().calibration.serial)) continue;
    const fs::path to = folder.string() + PreviousSuffix(folder, "/calibration.yaml");
    std::error_code failure;
    fs::remove_all(to, failure);
    if (!failure) fs::rename(folder, to, failure);
    if (failure) {
      return Error(
          ErrorCode::kCannotWrite,
          {folder.string()},
          "has results of sensors that only an earlier log had, and cannot be renamed to " +
              to.string() + ": " + failure.message());
    }
    Note(folder.string() +
         ": has results of sensors that only an earlier log had, and is renamed to " +
         to.filename().string());
  }
  return {};
}

/// Writes all results or none, and the exports of --to.
Result<ExportsBeside> WriteAll(std::vector<Done>* all) {
  TRUETRIAD_ASSIGN_OR_RETURN(const bool allows_outside, AllowsOutsideLimits());
  std::vector<ResultOfInstance> results;
  for (const Done& done : *all) {
    TRUETRIAD_RETURN_IF_ERROR(EnsureWritableDirectory(done.task.folder));
    results.push_back({&done.calibration, done.task.folder, done.task.instance});
  }
  TRUETRIAD_ASSIGN_OR_RETURN(
      ExportsBeside exports,
      ExportBeside(results,
                   CommaSeparated(FLAGS_to),
                   {.software_version = Version(), .allows_outside_limits = allows_outside}));
  WholeFiles files;
  for (const auto& [path, text] : exports.files) {
    TRUETRIAD_RETURN_IF_ERROR(CheckIsExport(path, all->front().calibration.serial));
    TRUETRIAD_RETURN_IF_ERROR(files.Write(path, text));
  }
  std::vector<std::vector<std::string>> aside(all->size());
  for (std::size_t i = 0; i < all->size(); ++i) {
    TRUETRIAD_RETURN_IF_ERROR(Write(&(*all)[i], &aside[i], &files));
  }
  // Exports of an earlier result do not fit this result, so they are withdrawn.
  TRUETRIAD_ASSIGN_OR_RETURN(const std::vector<std::string> withdrawn,
                             WithdrawExports(all->front().task.folder, exports.files));
  for (const std::string& file : withdrawn) {
    Note(file + ": is the new name of an export of an earlier result");
  }
  for (std::size_t i = 0; i < all->size(); ++i) {
    const Done& done = (*all)[i];
    if (done.StaysBeside()) TRUETRIAD_RETURN_IF_ERROR(HoldBackEarlier(done));
    TRUETRIAD_RETURN_IF_ERROR(MoveAside(done.task.folder, aside[i]));
  }
  TRUETRIAD_RETURN_IF_ERROR(MoveOtherInstancesAside(*all));
  TRUETRIAD_RETURN_IF_ERROR(files.Commit());
  return exports;
}

/// A task with an experiment that is made from the recordings. --set may also name sensors that are
/// left out, or that only other instances have (`any`: sensors of all instances).
Result<Task> InitialTask(const std::vector<std::string>& inputs,
                         const std::string& folder,
                         const PerTriad<bool>& any,
                         const PerTriad<bool>& left_out) {
  Task task;
  ProgressLine progress("looking at " + inputs.front());
  TRUETRIAD_ASSIGN_OR_RETURN(
      FirstLook look, InitialExperiment(inputs, folder, progress.callback(), Leaving(left_out)));
  task.initial_yaml = std::move(look.experiment_yaml);
  task.first = std::move(look.loaded);
  TRUETRIAD_ASSIGN_OR_RETURN(std::vector<std::string> overrides, OverridesAndTags());
  TRUETRIAD_ASSIGN_OR_RETURN(const Experiment own,
                             ReadExperimentText(task.initial_yaml, "experiment.yaml", {}));
  for (const std::string& item : overrides) task.initial_yaml += "# --set=" + item + '\n';
  for (const Triad triad : kTriads) {
    const std::string name(TriadName(triad));
    const bool is_recorded = own.options.triads[triad].enabled || task.first->poses.Find(triad);
    if (is_recorded || (!any[triad] && !left_out[triad])) continue;
    overrides.insert(overrides.begin(), "sensors." + name + "={}");
  }
  const std::string path = (fs::path(folder) / "experiment.yaml").string();
  TRUETRIAD_ASSIGN_OR_RETURN(task.experiment,
                             ReadExperimentText(task.initial_yaml, "experiment.yaml", overrides));
  // Relative paths in overrides refer to the working directory, since no user's file states them.
  task.experiment.path = path;
  return task;
}

/// Takes over a person's decisions about the same recording: they survive its recalibration.
void TakeOverDecisions(Done* done) {
  const auto is_same = [&](const std::optional<Calibration>& earlier) {
    if (!earlier) return false;
    const std::vector<InputFile>& inputs = done->calibration.inputs;
    if (std::ranges::all_of(inputs, [&](const InputFile& input) {
          return input.samples == 0 || IsMadeFrom(*earlier, {input});
        })) {
      return true;
    }
    // The same readings may be in other files: compressed, or with another comment.
    const Result<Comparison> compared = Compare(*earlier, done->calibration);
    return compared && IsTooAlike(*compared);
  };
  std::optional<Calibration> earlier = done->there;
  if (!is_same(earlier)) earlier = ThatIn(done->task.folder, "calibration.previous.yaml");
  if (!is_same(earlier)) return;
  if (earlier->LimitsVerdict() == Verdict::kFail &&
      done->calibration.LimitsVerdict() == Verdict::kNoLimits) {
    Warn(done->Path("calibration.yaml") +
         ": this recording had the verdict FAIL; without stated limits it is now NO LIMITS SET");
  }
  for (const Decision& decision : earlier->decisions) {
    if (!decision.is_automatic) done->calibration.decisions.push_back(decision);
  }
}

/// If one result may not be delivered, blocks all sensors of the device. The result may also be an
/// earlier one of another instance in the same folder.
void HoldBackTogether(std::vector<Done>* all) {
  std::optional<Decision> held_back;
  for (const Done& done : *all) {
    const std::string name = "instance " + std::to_string(done.task.instance);
    if (!held_back) held_back = HeldBackBy(done.calibration, name);
  }
  for (const fs::path& folder : OtherInstances(*all)) {
    if (!held_back) held_back = HeldBackByOther(folder, all->front().calibration.serial);
  }
  if (!held_back) return;
  for (Done& done : *all) {
    if (done.calibration.verdict() != Verdict::kFail) {
      done.calibration.decisions.push_back(*held_back);
    }
  }
}

/// Moves an existing folder NAME to NAME.aside to make way for a new one, and moves it back at the
/// end of this object, unless the new folder is kept. After a kill the next object moves it back.
class FolderGivesWay {
 public:
  FolderGivesWay() = default;
  FolderGivesWay(const FolderGivesWay&) = delete;
  FolderGivesWay& operator=(const FolderGivesWay&) = delete;
  ~FolderGivesWay() {
    if (folder_.empty()) return;
    std::error_code ignored;
    const fs::path aside = Named(".aside");
    fs::remove_all(folder_, ignored);
    if (fs::exists(aside, ignored)) fs::rename(aside, folder_, ignored);
    if (has_made_parent_) fs::remove(folder_.parent_path(), ignored);
  }

  /// Moves an existing `folder` aside. Error (bad input): it cannot be renamed or contains `input`.
  Status Take(const fs::path& folder, const fs::path& input) {
    std::error_code failure;
    const fs::path inside = fs::weakly_canonical(input, failure)
                                .lexically_relative(fs::weakly_canonical(folder, failure));
    if (!inside.empty() && *inside.begin() != "..") {
      return Error(ErrorCode::kOutputInTheWay,
                   {folder.string()},
                   "contains the log and would be replaced; choose another --output");
    }
    has_made_parent_ = !fs::exists(folder.parent_path(), failure);
    const fs::path aside = folder.string() + ".aside";
    failure.clear();
    // If a killed run left NAME.aside, NAME is the killed run's own folder and is removed.
    if (fs::exists(aside, failure)) {
      fs::remove_all(folder, failure);
    } else if (fs::exists(folder, failure)) {
      fs::rename(folder, aside, failure);
    }
    if (failure) {
      return Error(
          ErrorCode::kCannotWrite, {folder.string()}, "cannot be replaced: " + failure.message());
    }
    folder_ = folder;
    return {};
  }

  bool Holds(const std::string& file) const {
    return !folder_.empty() && file.starts_with(folder_.string() + "/");
  }

  /// Keeps the new folder. The old folder gets `suffix`, or is removed if there is none.
  void Keep(const std::optional<std::string>& suffix) {
    // NAME.aside is renamed before it is removed: if the program is killed during the removal, the
    // next run would otherwise restore the rest of NAME.aside as a result.
    std::error_code ignored;
    const std::string to = suffix ? Named(*suffix) : TemporaryNameBeside(folder_.string());
    if (fs::exists(Named(".aside"), ignored)) {
      fs::remove_all(to, ignored);
      fs::rename(Named(".aside"), to, ignored);
      if (!suffix) fs::remove_all(to, ignored);
    }
    folder_.clear();
  }

 private:
  std::string Named(const std::string& suffix) const { return folder_.string() + suffix; }

  fs::path folder_;  ///< Empty: nothing is restored.
  bool has_made_parent_ = false;
};

/// Error (bad input): a log that needs conversion is compressed.
Status CheckIsUnpacked(const std::string& log) {
  std::array<char, 2> start{};
  std::ifstream(log, std::ios::binary).read(start.data(), start.size());
  if (start != std::array<char, 2>{'\x1F', '\x8B'}) return {};
  const auto text = TextFile::Open(log);
  if (text || text.error().code != ErrorCode::kWrongFormat) return {};
  return Error(
      ErrorCode::kWrongFormat,
      {log},
      "is compressed with gzip, which is supported only for CSV; unpack it first: gunzip " + log);
}

/// The recordings of the logs by sensor instance. Logs of other systems are converted below
/// `folder`; `gives_way` gets the earlier conversions that were moved aside.
Result<std::map<int, std::vector<std::string>>> RecordingsOf(
    const std::vector<std::string>& logs,
    const std::string& folder,
    std::deque<FolderGivesWay>* gives_way) {
  std::map<int, std::vector<std::string>> recordings;
  const bool is_choice = !(FLAGS_topic + FLAGS_instance + FLAGS_columns + FLAGS_units).empty();
  for (std::size_t i = 0; i < logs.size(); ++i) {
    const std::string& log = logs[i];
    const LogFormat* const format = LogFormatOf(log);
    if (format == nullptr && is_choice) {
      return Error(ErrorCode::kConflictingArguments,
                   log +
                       ": --topic, --instance, --columns and --units are for logs of other systems "
                       "that are converted; leave them out, or convert the log first");
    }
    if (format == nullptr) {
      TRUETRIAD_RETURN_IF_ERROR(CheckIsUnpacked(log));
      recordings[0].push_back(log);
      continue;
    }
    const std::string number = i == 0 ? "" : "-" + std::to_string(i + 1);
    const fs::path into = fs::path(folder) / ("recording" + number);
    TRUETRIAD_RETURN_IF_ERROR(gives_way->emplace_back().Take(into, log));
    TRUETRIAD_ASSIGN_OR_RETURN(const auto converted, ConvertedLog(*format, log, into.string()));
    for (const auto& [instance, path] : converted) recordings[instance].push_back(path);
  }
  return recordings;
}

/// `any`: the sensors in all recordings of a unit. `others`: for each instance, the sensors that
/// only other instances have. Both are empty for a single recording.
struct Recorded {
  PerTriad<bool> any = {};
  std::map<int, PerTriad<bool>> others;
};

Recorded SensorsIn(const std::map<int, std::vector<std::string>>& recordings) {
  Recorded found;
  if (recordings.size() == 1 && recordings.begin()->second.size() == 1) return found;
  for (const auto& [instance, inputs] : recordings) {
    for (const std::string& input : inputs) {
      const Result<std::unique_ptr<SampleSource>> source = OpenRecording(input);
      if (!source) continue;
      PerTriad<bool>& its = found.others[instance];
      for (const StreamInfo& stream : (*source)->info().streams)
        its[stream.triad] = found.any[stream.triad] = true;
    }
  }
  for (auto& [instance, its] : found.others) {
    for (const Triad triad : kTriads) its[triad] = found.any[triad] && !its[triad];
  }
  return found;
}

/// The task of one sensor instance: by `experiment` or, without an experiment, made from `inputs`.
/// The task leaves out sensors that only `others` have or that are `left_out`.
Result<Task> TaskFor(const std::vector<std::string>& inputs,
                     const std::string& folder,
                     const std::optional<Experiment>& experiment,
                     const PerTriad<bool>& any,
                     PerTriad<bool> others,
                     const PerTriad<bool>& left_out = {}) {
  PerTriad<bool> asked;
  for (const Triad triad : kTriads) {
    others[triad] = others[triad] || left_out[triad];
    asked[triad] = !others[triad];
  }
  Result<Task> made = Task();
  if (experiment) {
    made->experiment = *experiment;
  } else {
    made = InitialTask(inputs, folder, any, left_out);
  }
  if (made && others != PerTriad<bool>()) made->experiment = OfSensors(made->experiment, asked);
  return made;
}

/// One task for each sensor instance in the logs. The first task uses the output folder itself.
/// `converted` gets the earlier conversions that were moved aside.
Result<std::vector<Task>> TasksFor(std::vector<std::string> logs,
                                   std::deque<FolderGivesWay>* converted) {
  std::vector<Task> tasks;
  std::optional<Experiment> experiment;  // Of all tasks; without --config each makes its own.
  if (!FLAGS_config.empty()) {
    TRUETRIAD_ASSIGN_OR_RETURN(const std::vector<std::string> overrides, OverridesAndTags());
    TRUETRIAD_ASSIGN_OR_RETURN(experiment, ReadExperiment(FLAGS_config, overrides));
    if (logs.empty()) logs = experiment->inputs;
  }
  if (logs.empty()) {
    return Error(ErrorCode::kMissingArgument,
                 FLAGS_config.empty() ? "no log; name one (`truetriad calibrate LOG.csv`), or an "
                                        "experiment (--config=…)"
                                      : "no recording: " + FLAGS_config +
                                            " has no `input:`; add it or give --input=LOG");
  }
  const std::string folder = FLAGS_output.empty() ? logs.front() + ".truetriad" : FLAGS_output;
  TRUETRIAD_ASSIGN_OR_RETURN(const auto recordings, RecordingsOf(logs, folder, converted));
  Recorded recorded = SensorsIn(recordings);
  for (const auto& [instance, inputs] : recordings) {
    const bool is_first = tasks.empty();
    const PerTriad<bool>& others = recorded.others[instance];
    Result<Task> made = TaskFor(inputs, folder, experiment, recorded.any, others);
    const auto is_asked = [&](Triad triad) {
      return made->experiment.options.triads[triad].enabled;
    };
    if (made && others != PerTriad<bool>() && std::ranges::none_of(kTriads, is_asked))
      continue;  // Only other instances have the requested sensors.
    const bool is_refused = !made && made.error().kind() != ErrorKind::kUsage;
    if (!made && !is_refused) return made.error();
    Task& task = tasks.emplace_back(is_refused ? Task() : *std::move(made));
    if (is_refused) task.refusal = made.error();
    task.folder =
        is_first ? folder : (fs::path(folder) / ("instance-" + std::to_string(instance))).string();
    task.experiment.inputs = inputs;
    task.instance = instance;
    task.has_others = recordings.size() > 1;
    task.without = [inputs = inputs, folder, experiment, any = recorded.any, others](
                       const PerTriad<bool>& left_out) {
      Result<Task> without = TaskFor(inputs, folder, experiment, any, others, left_out);
      if (without) without->experiment.inputs = inputs;
      return without;
    };
  }
  return tasks;
}

/// The findings on all results and their exports.
Findings FindingsOf(const std::vector<Done>& all, Findings of_exports) {
  Findings findings;
  for (const Done& done : all) {
    for (Finding finding : done.calibration.findings)
      findings.push_back(all.size() == 1 ? finding : finding.With("instance", done.task.instance));
  }
  std::ranges::move(of_exports, std::back_inserter(findings));
  for (Finding& finding : findings) {
    const std::optional<double> instance = finding.Value("instance");
    if (instance && all.size() > 1)
      finding.text =
          "instance " + std::to_string(static_cast<int>(*instance)) + ": " + finding.text;
  }
  return findings;
}

/// Describes the worst result. If there are several, states which it is, and lists all of them.
VerbResult ResultOf(const std::vector<Done>& all, const ExportsBeside& exports) {
  const Done& worst = *std::max_element(all.begin(), all.end(), [](const Done& a, const Done& b) {
    return a.badness() < b.badness();
  });
  const bool is_held_back = worst.calibration.verdict() == Verdict::kFail;
  Calibration shown = worst.calibration;
  shown.findings = FindingsOf(all, exports.findings);
  const int exit_code = exports.is_whole ? worst.exit_code() : kExitNotEnough;
  VerbResult result{.exit_code = is_held_back ? kExitOutsideLimits : exit_code,
                    .text = CalibrationText(shown),
                    .result = worst.json};
  result.findings = shown.findings;
  result.outcome = worst.calibration.outcome;
  result.verdict = worst.calibration.verdict();
  result.grade = GradeOf(worst.calibration);
  std::string files;
  if (all.size() > 1) {
    std::string which =
        " (instance " + std::to_string(worst.task.instance) + " of " + std::to_string(all.size());
    for (const Finding& lost : worst.task.lost)
      which += ", without its " + std::string(TriadName(*lost.sensor));
    result.text.insert(result.text.find('\n'), which + ")");
  }
  for (const Done& done : all) {
    if (!done.task.initial_yaml.empty())
      files += "Experiment:  " + done.task.experiment.path + '\n';
    files += "Calibration: " + done.Path("calibration.yaml");
    if (all.size() > 1) {
      files += " (instance " + std::to_string(done.task.instance) + ": " +
               HeadlineOf(done.calibration).text + ")";
      result.result["instances"].push_back(
          {{"instance", done.task.instance},
           {"exit", done.exit_code()},
           {"verdict", VerdictName(done.calibration.verdict())},
           {"ids", done.json.value(Json::json_pointer("/device/ids"), Json::object())},
           {"calibration", done.Path("calibration.yaml")}});
    }
    files += '\n';
    if (done.task.has_report) files += "Report:      " + done.Path("report.html") + '\n';
  }
  for (const auto& [path, text] : exports.files) {
    files += "Export:      " + path + '\n';
    result.result["exports"].push_back(path);
  }
  if (!exports.warnings.empty()) result.result["export_warnings"] = exports.warnings;
  result.text += '\n' + files;
  return result;
}

Result<VerbResult> CalibrateLogs(const std::vector<std::string>& logs,
                                 std::deque<FolderGivesWay>* converted) {
  TRUETRIAD_ASSIGN_OR_RETURN(const bool has_report, StatedReport(" (--output names the folder)"));
  TRUETRIAD_ASSIGN_OR_RETURN(std::vector<Task> tasks, TasksFor(logs, converted));
  std::vector<Done> all;
  for (Task& task : tasks) {
    if (FLAGS_solver == "ceres") task.experiment.options.solver = Solver::kCeres;
    task.has_report = has_report;
    TRUETRIAD_ASSIGN_OR_RETURN(Done done, Calibrated(std::move(task)));
    all.push_back(std::move(done));
  }
  const auto is_read = [](const Done& done) { return !done.task.refusal; };
  const auto read = std::find_if(all.begin(), all.end(), is_read);
  if (read == all.end()) return *all.front().task.refusal;
  bool is_drawn = false;  // The folder gets one experiment, that of the first task.
  for (Done& done : all) {
    if (is_drawn) done.task.initial_yaml.clear();
    is_drawn = is_drawn || !done.task.initial_yaml.empty();
    if (done.calibration.serial.empty()) done.calibration.serial = read->calibration.serial;
    TakeOverDecisions(&done);
  }
  HoldBackTogether(&all);
  std::optional<std::string> suffix;
  if (all.front().StaysBeside()) suffix = PreviousSuffix(all.front().Path("calibration"), ".yaml");
  TRUETRIAD_ASSIGN_OR_RETURN(const ExportsBeside exports, WriteAll(&all));
  // The converted recording is kept with its calibration.
  for (FolderGivesWay& replaced : *converted) replaced.Keep(suffix);
  for (const std::string& warning : exports.warnings) Warn(warning);
  VerbResult result = ResultOf(all, exports);
  // For a vehicle's log, another setup of its logging may avoid these findings; a note says how.
  using enum FindingCode;
  const std::set<FindingCode> few = {kNoRest, kNoPose, kTooSlow, kTooFewPoses, kTooFewDirections};
  const bool is_too_little = std::ranges::any_of(result.findings, [&](const Finding& finding) {
    return finding.severity == Severity::kRefusal && few.contains(finding.code);
  });
  if (is_too_little && std::all_of(all.begin(), all.end(), is_read) && !logs.empty()) {
    const LogFormat* const format = LogFormatOf(logs.front());
    if (format != nullptr && !format->how_to_log.empty()) Note(std::string(format->how_to_log));
  }
  return result;
}

Result<VerbResult> RunCalibrate(const std::vector<std::string>& words) {
  TRUETRIAD_RETURN_IF_ERROR(
      CheckOneOf("solver", FLAGS_solver, {"eliminated", "ceres"}, " is not known"));
  for (const std::string& format : CommaSeparated(FLAGS_to)) {
    TRUETRIAD_RETURN_IF_ERROR(InfoOfFormat(format));
  }
  std::deque<FolderGivesWay> converted;
  Result<VerbResult> result = CalibrateLogs(StatedInputs(words), &converted);
  if (result) return result;
  // If the error names a converted recording, which is removed now, tells how to get it again.
  Error error = result.error();
  for (const FolderGivesWay& folder : converted) {
    if (folder.Holds(error.place.file)) {
      error.message +=
          "; this recording was temporary and is removed; `truetriad convert` writes it again";
    }
  }
  return error;
}

}  // namespace

Command CalibrateCommand() {
  return {
      .name = "calibrate",
      .summary = "What are the biases, gains and misalignments of these sensors?",
      .examples = R"(build/truetriad calibrate datasets/demo/recording.csv -o out/first
build/truetriad calibrate -c configs/experiments/joint.yaml -o out/demo --to=px4,c-header)",
      .details =
          R"(Writes DIR/calibration.yaml, the same as DIR/calibration.json, and DIR/report.html, and prints the result.
Without -c it calibrates every sensor in the log with defaults, and writes DIR/experiment.yaml, too; without
-o, DIR is LOG.truetriad. Several logs are sessions of one unit. Logs that `convert` reads are converted
into DIR/recording. If a log has several sensors of a kind, results of the second and further ones are in
DIR/instance-N, and --to=px4 or ardupilot writes one file for all of them. How to log while unarmed, for
example with SDLOG_MODE=2 (PX4) or LOG_DISARMED=1 (ArduPilot): docs/converting.md.
)",
      .flags =
          "config input=LOG,... output to outside-limits set* tag* report=true|false interactive "
          "overwrite topic instance columns units solver",
      .values = {{"to", NamesOf(Formats())}},
      .more_words = "input",
      .run = RunCalibrate};
}

}  // namespace truetriad
