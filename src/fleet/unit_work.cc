// SPDX-License-Identifier: Apache-2.0
#include "fleet/unit_work.h"

#include <algorithm>
#include <cctype>
#include <chrono>
#include <exception>
#include <filesystem>
#include <memory>
#include <new>
#include <optional>
#include <utility>

#include "fleet/fields.h"
#include "fleet/log_files.h"
#include "fleet/unit_folders.h"
#include "io/recording_layout.h"
#include "io/text_file.h"
#include "io/yaml_reader.h"
#include "io/yaml_text.h"
#include "truetriad/base/result.h"
#include "truetriad/formats/export.h"
#include "truetriad/io/calibration_file.h"
#include "truetriad/io/recording.h"
#include "truetriad/report/report.h"
#include "truetriad/session/session.h"

namespace truetriad::fleet {
namespace {

namespace fs = std::filesystem;

/// Processor time of this process, s.
double CpuSeconds() {
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

/// The override that sets a key of an experiment to `value`.
std::string OverrideText(std::string_view key, const std::string& value) {
  YamlText yaml;
  yaml << key << "=" << Quoted{value};
  return yaml.str();
}

/// The key of a tag in an experiment: "run.lot".
std::string KeyOfTag(std::string_view name) {
  const bool is_of_device = std::ranges::find(kDeviceTags, name, &TagKey::key) != kDeviceTags.end();
  return (is_of_device ? "device." : "run.") + std::string(name);
}

bool IsOfTag(const std::string& override_text) {
  return std::ranges::any_of(TagNames(), [&](std::string_view name) {
    return override_text.starts_with(KeyOfTag(name) + "=");
  });
}

/// The error for a log that states another unit than the order.
Error OtherDevice(const UnitOrder& order, const Error& error) {
  const Result<std::unique_ptr<SampleSource>> log = OpenRecording(order.log);
  if (!log) return error;
  return Error(ErrorCode::kOtherDevice,
               {order.serial_from},
               "states serial number `" + order.serial + "`, but " + order.log + " is of unit `" +
                   (*log)->info().serial + "`; correct the one that is wrong");
}

/// The experiment of a unit, and the poses read from its log if no experiment was stated.
struct UnitTask {
  Experiment experiment;
  std::optional<LoadedPoses> loaded;
};

Result<UnitTask> TaskFor(const WorkPlan& plan, const UnitOrder& order) {
  std::vector<std::string> overrides = plan.overrides;
  TagFields(
      [&overrides](std::string_view name, const std::string& value) {
        if (!value.empty()) overrides.push_back(OverrideText(KeyOfTag(name), value));
      },
      order.tags);
  if (!order.serial.empty()) overrides.push_back(OverrideText("device.serial", order.serial));
  std::string text = plan.config_text;
  std::string path = plan.config_path;
  UnitTask task;
  if (text.empty()) {
    TRUETRIAD_ASSIGN_OR_RETURN(FirstLook look, InitialExperiment({order.log}, /*folder=*/""));
    text = std::move(look.experiment_yaml);
    path = "experiment.yaml";
    task.loaded = std::move(look.loaded);
  }
  TRUETRIAD_ASSIGN_OR_RETURN(task.experiment, ReadExperimentText(text, path, overrides));
  task.experiment.inputs = {order.log};
  return task;
}

/// Writes all files of a calibration. If the calibration is not usable, the files state why. Error:
/// a file cannot be written.
Status WriteFiles(const WorkPlan& plan,
                  const Calibration& calibration,
                  const PoseSet& poses,
                  const std::string& folder) {
  TRUETRIAD_RETURN_IF_ERROR(BeginFolder(folder, plan.StoreMark()));
  TRUETRIAD_ASSIGN_OR_RETURN(const ExportsBeside exports,
                             ExportBeside({{&calibration, folder}},
                                          plan.formats,
                                          {.software_version = Version(),
                                           .allows_outside_limits = plan.allows_outside_limits}));
  for (const auto& [name, text] : exports.files) {
    TRUETRIAD_RETURN_IF_ERROR(WriteFileAtomically(name, text));
  }
  std::optional<std::string> report;
  if (plan.has_report) {
    const std::string assets(plan.shares_assets ? kAssetsOfRun : "");
    report = CalibrationHtml(calibration, {.assets = assets}, {.poses = &poses, .noise = {}});
  }
  return WriteResult(folder, calibration, report);
}

/// Error: the recording states another station than the run. Otherwise the golden unit of a wrong
/// station would decide whether this unit may be calibrated.
Status AgreeOnStation(const UnitRun& run) {
  if (!IsManifest(run.log)) return {};
  const std::string own = IdentityInManifest(run.log).tags.station;
  if (own.empty() || own == run.tags.station) return {};
  return Error(ErrorCode::kDoesNotMatch,
               {run.log},
               "states station `" + own +
                   "`, but --tag, the list or the experiment states station `" + run.tags.station +
                   "` for this unit; correct the wrong one");
}

void TakeTime(const Recorded& recorded, UnitRun* run) {
  run->recorded = recorded.at;
  run->recorded_by = recorded.by;
}

Status Calibrate(const WorkPlan& plan, const UnitOrder& order, UnitRun* run) {
  TRUETRIAD_RETURN_IF_ERROR(AgreeOnStation(*run));
  TRUETRIAD_ASSIGN_OR_RETURN(UnitTask task, TaskFor(plan, order));
  PoseSet poses;
  Result<Calibration> calibrated = CalibrateExperiment(
      std::move(task.experiment), {}, std::move(task.loaded), &poses, {}, &run->readings);
  if (!calibrated) {
    const Error& error = calibrated.error();
    const bool is_other = error.code == ErrorCode::kOtherDevice && !order.serial_from.empty();
    return is_other ? OtherDevice(order, error) : error;
  }
  const std::optional<Recorded> own = RecordedOf(poses);
  if (order.recorded.empty() && own) TakeTime(*own, run);
  Calibration& calibration = *calibrated;
  if (calibration.serial.empty() && order.shares_name) {
    return Error(ErrorCode::kDuplicateKey,
                 {order.log},
                 "states no serial number, and another log has the same file name; give a list "
                 "with serial numbers, or --serial={serial}.csv if names are serial numbers");
  }
  if (calibration.serial.empty()) calibration.serial = run->serial;
  run->serial = calibration.serial;
  Fill(calibration, run);
  if (plan.folder.empty()) return {};
  const std::string folder = (fs::path(plan.folder) / FolderNameOf(run->serial) / run->id).string();
  const Status written = WriteFiles(plan, calibration, poses, folder);
  if (!written) {
    RemoveFolder(folder);
    return written;
  }
  run->folder = folder;
  return {};
}

}  // namespace

Result<WorkPlan> PlanWork(const std::string& config,
                          std::vector<std::string> overrides,
                          std::vector<std::string> formats) {
  WorkPlan plan;
  plan.overrides = std::move(overrides);
  plan.formats = std::move(formats);
  for (const std::string& format : plan.formats) {
    TRUETRIAD_RETURN_IF_ERROR(InfoOfFormat(format));
  }
  if (!config.empty()) {
    plan.config_path = config;
    TRUETRIAD_ASSIGN_OR_RETURN(plan.config_text, ReadSmallFile(config));
  }
  TRUETRIAD_ASSIGN_OR_RETURN(const Experiment experiment, ExperimentOfAll(plan));
  plan.tags = experiment.tags;
  return plan;
}

Result<Experiment> ExperimentOfAll(const WorkPlan& plan) {
  if (!plan.config_text.empty()) {
    return ReadExperimentText(plan.config_text, plan.config_path, plan.overrides);
  }
  // Each log has its own sensors, so an override must be valid for some set of them.
  std::optional<Error> error;
  for (const char* const sensors : {"accelerometer: {}, gyroscope: {}, magnetometer: {}",
                                    "accelerometer: {}, gyroscope: {}",
                                    "accelerometer: {}, magnetometer: {}",
                                    "gyroscope: {}, magnetometer: {}",
                                    "accelerometer: {}",
                                    "magnetometer: {}"}) {
    Result<Experiment> typed = ReadExperimentText(
        std::string("experiment: 1\nsensors: { ") + sensors + " }\n", "", plan.overrides);
    if (typed) return typed;
    if (!error) error = typed.error();
  }
  return *std::move(error);
}

Status WriteSharedAssets(const std::string& folder) {
  const fs::path assets = fs::path(folder) / kSharedAssets;
  TRUETRIAD_RETURN_IF_ERROR(EnsureWritableDirectory(assets.string()));
  TRUETRIAD_RETURN_IF_ERROR(
      WriteFileAtomically((assets / "report.css").string(), ReportStyleSheet()));
  return WriteFileAtomically((assets / "report.js").string(), ReportScript());
}

Result<std::string> ConfigSha256(const WorkPlan& plan) {
  std::string text;
  std::vector<std::string> overrides = plan.overrides;
  if (plan.config_text.empty()) {
    for (const std::string& item : overrides) text += IsOfTag(item) ? "" : item + '\n';
  } else {
    for (const std::string_view name : TagNames()) {
      overrides.push_back(OverrideText(KeyOfTag(name), ""));
    }
    TRUETRIAD_ASSIGN_OR_RETURN(const Experiment experiment,
                               ReadExperimentText(plan.config_text, plan.config_path, overrides));
    text = experiment.resolved_yaml;
  }
  for (const std::string& format : plan.formats) text += "\nto: " + format;
  text += plan.allows_outside_limits ? "\noutside limits, too" : "";
  text += plan.has_report ? "\nreport" : "";
  text += plan.shares_assets ? "\nassets: shared" : "";
  text += plan.folder.empty() ? "" : "\nfiles";
  return Sha256Hex(text);
}

std::string SerialOfName(const std::string& log) {
  fs::path path = fs::absolute(log).lexically_normal();
  if (path.filename() == kManifestName) return path.parent_path().filename().string();
  // The name of a compressed log is that of the log without .gz.
  if (EndsIn(path.filename().string(), ".gz")) path = path.stem();
  return path.stem().string();
}

UnitRun RunOf(const WorkPlan& plan, const UnitOrder& order) {
  UnitRun run;
  run.id = order.run.empty() ? NewRunId() : order.run;
  run.log = order.log;
  run.serial = order.serial;
  run.tags = OrElse(order.tags, plan.tags);
  if (IsManifest(order.log)) {
    const RecordingInfo stated = IdentityInManifest(order.log);
    if (run.serial.empty()) run.serial = stated.serial;
    run.tags = OrElse(run.tags, stated.tags);
  }
  if (run.serial.empty()) run.serial = order.shares_name ? order.log : SerialOfName(order.log);
  run.shard = plan.shard;
  run.created = TimestampUtc();
  run.software_version = Version();
  if (const std::optional<LogStamp> stamp = StampOf(order.log)) {
    run.log_bytes = stamp->bytes;
    run.log_modified_ns = stamp->modified_ns;
    TakeTime(RecordedOf(*stamp), &run);
  }
  if (!order.recorded.empty()) {
    run.recorded = order.recorded;
    run.recorded_by = kByList;
  }
  return run;
}

UnitRun Work(const WorkPlan& plan, const UnitOrder& order, void (*before)(const UnitOrder&)) {
  const double cpu_s = CpuSeconds();
  const auto begin = std::chrono::steady_clock::now();
  UnitRun run = RunOf(plan, order);
  try {
    if (before != nullptr) before(order);
    const Status status = Calibrate(plan, order, &run);
    if (!status) Fill(status.error(), &run);
  } catch (const std::bad_alloc&) {
    run.verdict = Verdict::kNoResult;  // PASS or FAIL may be set if writing files failed.
    run.code = kMemoryLimit;
    run.message = order.log + ": needs more memory than a unit may use";
  } catch (const std::exception& failure) {
    Fill(Error(ErrorCode::kSystemFailure, {order.log}, failure.what()), &run);
  }
  run.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  run.cpu_s = CpuSeconds() - cpu_s;
  return run;
}

std::string PercentEncoded(std::string_view text, std::string_view plain) {
  constexpr std::string_view kDigits = "0123456789ABCDEF";
  std::string encoded;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if ((byte < 0x80 && std::isalnum(byte) != 0) || plain.find(c) != std::string_view::npos) {
      encoded += c;
    } else {
      encoded += {'%', kDigits[byte >> 4], kDigits[byte & 15U]};
    }
  }
  return encoded;
}

std::string FolderNameOf(std::string_view serial) {
  constexpr std::size_t kLongest = 120;  // Well below the 255 bytes of file systems.
  std::string name = PercentEncoded(serial, "-_.");
  if (name.starts_with('.')) name.replace(0, 1, "%2E");
  if (name.size() > kLongest) {
    name = name.substr(0, kLongest) + "-" + Sha256Hex(serial).substr(0, 16);
  }
  return name.empty() ? "%" : name;
}

void Fields(auto&& visit, Like<WorkPlan> auto& plan) {
  visit("config_path", plan.config_path);
  visit("config_text", plan.config_text);
  visit("overrides", plan.overrides);
  visit("tags", plan.tags);
  visit("formats", plan.formats);
  visit("allows_outside_limits", plan.allows_outside_limits);
  visit("has_report", plan.has_report);
  visit("shares_assets", plan.shares_assets);
  visit("folder", plan.folder);
  visit("store_identity", plan.store_identity);
  visit("store_name", plan.store_name);
  visit("shard", plan.shard);
  visit("memory_bytes", plan.memory_bytes);
}

void Fields(auto&& visit, Like<UnitOrder> auto& order) {
  visit("log", order.log);
  visit("serial", order.serial);
  visit("serial_from", order.serial_from);
  visit("tags", order.tags);
  visit("recorded", order.recorded);
  visit("run", order.run);
  visit("shares_name", order.shares_name);
}

std::string LineOf(const WorkPlan& plan) { return LineOfJson(TreeOf(plan)); }
std::string LineOf(const UnitOrder& order) { return LineOfJson(TreeOf(order)); }
Result<WorkPlan> ReadPlan(std::string_view line) { return FromLine(line, ThingFrom<WorkPlan>); }
Result<UnitOrder> ReadOrder(std::string_view line) { return FromLine(line, ThingFrom<UnitOrder>); }

}  // namespace truetriad::fleet
