// SPDX-License-Identifier: Apache-2.0
#include "fleet/fleet_run.h"

#include <algorithm>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include <gflags/gflags.h>

#include "fleet/json_lines.h"
#include "fleet/log_files.h"
#include "fleet/store.h"
#include "fleet/unit_folders.h"
#include "tools/truetriad/command.h"
#include "tools/truetriad/flags.h"
#include "tools/truetriad/fleet_progress.h"
#include "tools/truetriad/interruption.h"
#include "truetriad/io/calibration_file.h"

DEFINE_string(units_of,
              "",
              "LIST|FOLDER|GLOB: logs, folders with logs, patterns such as 'line-3/*.csv', and "
              "files that list logs");
DEFINE_bool(resume,
            false,
            "skip logs that have not changed since their last run, if the store has that run with "
            "the same experiment, program, serial number and tags");
DEFINE_string(shard, "", "I/N: calibrate only part I of N parts of the units, I from 0 to N-1");
DEFINE_string(folder, "", "DIR: the folder in which, and below which, logs arrive");
DEFINE_string(poll,
              "",
              "SECONDS: interval between looks at the folder (default: 1, or 5 on network folders, "
              "which do not tell whether a file is still being written)");
DEFINE_string(until_idle,
              "",
              "SECONDS: end after this time without a new or changed log or a finished run");
DECLARE_int32(jobs);
DEFINE_string(
    store,
    "",
    "FILE|URL: where the runs are kept: a file for SQLite, or "
    "postgresql://HOST/DATABASE, or NAME.jsonl for the runs of one shard, to be merged by `fleet "
    "collect` (default of fleet run and fleet watch: fleet.db in the output folder)");
DEFINE_string(assets,
              "inline",
              "inline|shared: where reports have their style and script: inline (in each page) or "
              "shared (in files that all pages use)");
DEFINE_string(
    serial,
    "",
    "PATTERN: pattern that takes serial numbers from the logs' names: {serial} stands for "
    "the number, * for anything else, as in {serial}-*.csv");
DEFINE_string(time_limit, "120", "SECONDS: seconds that a unit may take");
DEFINE_string(memory_limit, "2048", "MB: MB of address space that a unit may take");
DEFINE_string(retest_counts,
              "",
              "last|first|best: which run decides the verdict if a unit is measured again: last "
              "(default), first or best; the store keeps the choice");
DEFINE_string(retest_most,
              "",
              "N: how many recordings of a unit after its first may decide the verdict (default: "
              "all); the store keeps the choice");
DEFINE_string(require_golden,
              "",
              "AGE: how old the station's last check-station may be, as in 8h, 30m or 1d; no unit "
              "is calibrated if that check is older or did not agree");
DEFINE_string(progress, "", "jsonl: print a line of JSON about each run on stderr");

namespace truetriad {
namespace {

namespace fs = std::filesystem;

Result<fleet::UnitLimits> StatedLimits() {
  fleet::UnitLimits limits;
  TRUETRIAD_ASSIGN_OR_RETURN(limits.seconds, ParseReal("time-limit", FLAGS_time_limit));
  TRUETRIAD_ASSIGN_OR_RETURN(const double megabytes, ParseReal("memory-limit", FLAGS_memory_limit));
  if (!(limits.seconds > 0.0)) {
    return Error(ErrorCode::kInvalidArgument, "--time-limit: expected seconds, more than 0");
  }
  constexpr double kLeast = 64.0, kMost = 1e9;  // Chosen, MB; 1e15 bytes fit in int64.
  if (!(megabytes >= kLeast && megabytes <= kMost)) {
    return Error(ErrorCode::kInvalidArgument, "--memory-limit: expected MB, 64 or more");
  }
  limits.bytes = static_cast<std::int64_t>(megabytes * 1e6);
  return limits;
}

Result<fleet::WorkPlan> StatedPlan() {
  TRUETRIAD_ASSIGN_OR_RETURN(std::vector<std::string> overrides, OverridesAndTags());
  TRUETRIAD_ASSIGN_OR_RETURN(
      fleet::WorkPlan plan,
      fleet::PlanWork(FLAGS_config, std::move(overrides), CommaSeparated(FLAGS_to)));
  TRUETRIAD_ASSIGN_OR_RETURN(plan.has_report, StatedReport());
  TRUETRIAD_ASSIGN_OR_RETURN(plan.allows_outside_limits, AllowsOutsideLimits());
  TRUETRIAD_RETURN_IF_ERROR(CheckOneOf("assets", FLAGS_assets, {"inline", "shared"}));
  plan.shares_assets = plan.has_report && FLAGS_assets == "shared";
  // The store keeps the path, which is absolute to be valid wherever the store is read.
  plan.folder = (fs::absolute(FLAGS_output) / "units").lexically_normal().string();
  return plan;
}

Status StateRetestPolicy(fleet::Store& store) {
  if (FLAGS_retest_counts.empty() && FLAGS_retest_most.empty()) return {};
  fleet::RetestPolicy policy;
  if (!FLAGS_retest_counts.empty()) {
    const std::optional<fleet::RetestCounts> counts =
        fleet::RetestCountsFromName(FLAGS_retest_counts);
    if (!counts) {
      return BadValue("retest-counts", FLAGS_retest_counts, ": expected last, first or best");
    }
    policy.counts = *counts;
  }
  if (!FLAGS_retest_most.empty()) {
    TRUETRIAD_ASSIGN_OR_RETURN(policy.most, ParseInteger("retest-most", FLAGS_retest_most));
    if (*policy.most < 0) {
      return Error(ErrorCode::kInvalidArgument, "--retest-most: expected 0 or more");
    }
  }
  TRUETRIAD_ASSIGN_OR_RETURN(const fleet::StoreHeader before, store.Header());
  TRUETRIAD_RETURN_IF_ERROR(store.StateRetestPolicy(policy));
  if (before.policy || policy == fleet::RetestPolicy()) return {};
  // A store of JSON lines that already has runs has refused the new policy above.
  const Result<fleet::Table> runs = store.Query("SELECT 1 FROM run LIMIT 1");
  if (runs && !runs->rows.empty()) {
    FleetTalk().Listener().on_warning(
        "retest rule changed: now the " + std::string(RetestCountsName(policy.counts)) +
        " of a unit's " +
        (!policy.most       ? "runs"
         : *policy.most > 0 ? "first " + std::to_string(*policy.most + 1) + " recordings"
                            : "runs of its first recording") +
        " decides its verdict, also for units in the store; before, the last of all runs did");
  }
  return {};
}

/// Asks the store why --require-golden forbids a calibration at `station`; empty without that flag.
using GoldenHold = std::function<Result<std::optional<std::string>>(const std::string& station)>;

Result<GoldenHold> StatedGoldenHold(const fleet::WorkPlan& plan,
                                    fleet::Store& store,
                                    bool needs_station) {
  if (FLAGS_require_golden.empty()) return GoldenHold();
  TRUETRIAD_ASSIGN_OR_RETURN(const double age_s,
                             ParseDuration("require-golden", FLAGS_require_golden));
  if (needs_station && plan.tags.station.empty()) {
    return Error(ErrorCode::kMissingArgument,
                 "--require-golden needs the name of the station; give --tag=station=NAME");
  }
  return GoldenHold([station = plan.tags.station, age_s, &store](const std::string& of_unit) {
    return fleet::GoldenHold(store, of_unit.empty() ? station : of_unit, age_s);
  });
}

/// Creates the folder for the units' folders, and the files that the reports share.
Status PrepareUnitsFolder(const fleet::WorkPlan& plan) {
  TRUETRIAD_RETURN_IF_ERROR(EnsureWritableDirectory(plan.folder));
  return plan.shares_assets ? fleet::WriteSharedAssets(plan.folder) : Status();
}

/// Opens the store, sets its shard and, if flags state one, its retest policy. Records in the plan
/// the store's identity and name. Errors as OpenStore.
Result<std::unique_ptr<fleet::Store>> OpenStatedStore(const fleet::Shard& shard,
                                                      fleet::WorkPlan* plan) {
  const std::string usual = InOutput("fleet.db");
  const std::optional<std::string> file = fleet::FileOfStore(StatedStore());
  std::error_code failure;
  // Files of JSON lines are those of shards and belong beside the usual store.
  const bool is_beside_another = file && !fleet::JsonLinesPath(StatedStore()) &&
                                 fs::exists(usual, failure) && !fs::exists(*file, failure);
  TRUETRIAD_ASSIGN_OR_RETURN(std::unique_ptr<fleet::Store> store, fleet::OpenStore(StatedStore()));
  if (is_beside_another) {
    FleetTalk().Listener().on_warning(
        "a new store, " + *file + ", is created; it lacks the runs of " + usual +
        ", the store in the output folder; if you meant that store, name it with --store");
  }
  TRUETRIAD_RETURN_IF_ERROR(StateRetestPolicy(*store));
  TRUETRIAD_RETURN_IF_ERROR(store->StateShard(shard));
  TRUETRIAD_ASSIGN_OR_RETURN(const fleet::StoreHeader header, store->Header());
  plan->store_identity = header.store;
  plan->store_name = fleet::NameOfStore(StatedStore());
  return store;
}

/// Returns the options of the calibrations by the flags. If --output is not given, sets it to
/// `fleet`. Error (usage, bad input): a flag or the experiment is wrong.
Result<fleet::FleetOptions> StatedFleetOptions() {
  TRUETRIAD_RETURN_IF_ERROR(CheckFailOn(kFailOnUnit));
  if (!FLAGS_progress.empty()) {
    TRUETRIAD_RETURN_IF_ERROR(
        CheckOneOf("progress", FLAGS_progress, {kProgressLines}, " is not known"));
  }
  fleet::FleetOptions options;
  TRUETRIAD_ASSIGN_OR_RETURN(options.limits, StatedLimits());
  if (FLAGS_output.empty()) FLAGS_output = "fleet";
  TRUETRIAD_ASSIGN_OR_RETURN(options.plan, StatedPlan());
  // Each job takes about 10 MB and a socket.
  constexpr int kMostJobs = 1000;
  if (FLAGS_jobs < 0 || FLAGS_jobs > kMostJobs) {
    return BadValue("jobs",
                    std::to_string(FLAGS_jobs),
                    ": expected a number of processes, 0 to " + std::to_string(kMostJobs));
  }
  options.jobs = FLAGS_jobs > 0
                     ? FLAGS_jobs
                     : std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  options.worker_command = {"/proc/self/exe", std::string(kFleetWorker)};
  return options;
}

/// The flags of a verb that calibrates units: `own` flags and those common to such verbs.
std::string FleetFlags(const std::string& own) {
  return own +
         " config output store jobs serial to outside-limits report=true|false assets set* tag* "
         "retest-counts retest-most require-golden time-limit memory-limit progress fail-on=unit";
}

Result<fleet::Shard> StatedShard() {
  if (FLAGS_shard.empty()) return fleet::Shard();
  if (const std::optional<fleet::Shard> shard = fleet::ShardFromText(FLAGS_shard)) return *shard;
  return BadValue("shard", FLAGS_shard, ": expected I/N with I from 0 to N-1, as in 0/4");
}

Result<VerbResult> RunFleetVerb(const std::vector<std::string>& words) {
  TRUETRIAD_ASSIGN_OR_RETURN(const fleet::Shard shard, StatedShard());
  TRUETRIAD_ASSIGN_OR_RETURN(fleet::FleetOptions options, StatedFleetOptions());
  options.resumes = FLAGS_resume;
  options.plan.shard = fleet::ShardText(shard);
  std::vector<std::string> logs = CommaSeparated(FLAGS_units_of);
  logs.insert(logs.end(), words.begin(), words.end());
  TRUETRIAD_ASSIGN_OR_RETURN(std::vector<fleet::UnitOrder> units,
                             fleet::ListUnits(logs, FLAGS_serial));
  TRUETRIAD_RETURN_IF_ERROR(fleet::CheckSerials(options.plan, units));
  units = fleet::ShardOf(std::move(units), shard.index, shard.count);
  TRUETRIAD_RETURN_IF_ERROR(PrepareUnitsFolder(options.plan));
  std::optional<fleet::FolderClaim> own;
  if (FLAGS_resume) {
    TRUETRIAD_ASSIGN_OR_RETURN(fleet::FolderClaim alone,
                               fleet::FolderClaim::TakeAlone(FLAGS_output, shard));
    own.emplace(std::move(alone));
  }
  TRUETRIAD_ASSIGN_OR_RETURN(const std::unique_ptr<fleet::Store> store,
                             OpenStatedStore(shard, &options.plan));
  const bool needs_station = std::any_of(
      units.begin(), units.end(), [](const auto& unit) { return unit.tags.station.empty(); });
  TRUETRIAD_ASSIGN_OR_RETURN(const GoldenHold hold,
                             StatedGoldenHold(options.plan, *store, needs_station));
  if (hold) {
    std::set<std::string> stations;
    for (const fleet::UnitOrder& unit : units) stations.insert(unit.tags.station);
    for (const std::string& station : stations) {
      TRUETRIAD_ASSIGN_OR_RETURN(const std::optional<std::string> why, hold(station));
      if (why) return Error(ErrorCode::kStationNotChecked, *why);
    }
  }
  TRUETRIAD_ASSIGN_OR_RETURN(
      const fleet::FolderClaim claim,
      fleet::FolderClaim::Share(options.plan.folder, *store, options.plan.StoreMark()));
  NoteInterruptions();
  const Result<fleet::FleetProgress> progress = [&] {
    FleetTalk talk;
    return fleet::RunFleet(std::move(units), options, *store, talk.Listener(), IsInterrupted);
  }();
  TRUETRIAD_RETURN_IF_ERROR(progress);
  if (progress->is_stopped) {
    const Error stopped(ErrorCode::kStopped,
                        "stopped: " + std::to_string(progress->done) + " of " +
                            std::to_string(progress->units.value_or(0)) +
                            " units are done and in the store; go on with --resume");
    if (FLAGS_json) return stopped;
    Note(stopped.message);
    EndAsInterrupted();
  }
  return FleetResult(*progress);
}

Result<std::optional<double>> StatedSeconds(const std::string& flag, const std::string& text) {
  if (text.empty()) return std::optional<double>();
  TRUETRIAD_ASSIGN_OR_RETURN(const double seconds, ParseReal(flag, text));
  constexpr double kLeast = 0.05, kMost = 1e6;  // Chosen, s; 1e6 s are 11.6 days.
  if (seconds >= kLeast && seconds <= kMost) return std::optional(seconds);
  return BadValue(flag, text, ": expected seconds, 0.05 or more");
}

Result<VerbResult> RunFleetWatch(const std::vector<std::string>&) {
  fleet::WatchOptions watched{.folder = FLAGS_folder, .serial_pattern = FLAGS_serial};
  TRUETRIAD_ASSIGN_OR_RETURN(watched.look_s, StatedSeconds("poll", FLAGS_poll));
  TRUETRIAD_ASSIGN_OR_RETURN(watched.until_idle_s, StatedSeconds("until-idle", FLAGS_until_idle));
  std::error_code failure;
  if (!fs::is_directory(watched.folder, failure)) {
    return Error(ErrorCode::kUnreadableFile, {watched.folder}, "is no folder that can be read");
  }
  TRUETRIAD_ASSIGN_OR_RETURN(fleet::FleetOptions options, StatedFleetOptions());
  watched.without = options.plan.folder;
  TRUETRIAD_RETURN_IF_ERROR(fleet::CheckSerialsToCome(options.plan, FLAGS_serial));
  TRUETRIAD_RETURN_IF_ERROR(PrepareUnitsFolder(options.plan));
  TRUETRIAD_ASSIGN_OR_RETURN(const fleet::FolderClaim own,
                             fleet::FolderClaim::TakeAlone(FLAGS_output));
  TRUETRIAD_ASSIGN_OR_RETURN(const std::unique_ptr<fleet::Store> store,
                             OpenStatedStore({}, &options.plan));
  TRUETRIAD_ASSIGN_OR_RETURN(options.hold,
                             StatedGoldenHold(options.plan, *store, /*needs_station=*/true));
  TRUETRIAD_ASSIGN_OR_RETURN(
      const fleet::FolderClaim claim,
      fleet::FolderClaim::Share(options.plan.folder, *store, options.plan.StoreMark()));
  NoteInterruptions();
  const Result<fleet::FleetProgress> progress = [&] {
    FleetTalk talk(/*names_all=*/true);
    return fleet::WatchFleet(watched, options, *store, talk.Listener(), IsInterrupted);
  }();
  TRUETRIAD_RETURN_IF_ERROR(progress);
  return FleetResult(*progress);
}

}  // namespace

Command FleetRunCommand() {
  return {
      .name = "fleet run",
      .summary = "Which of these units are good? Calibrates each, and keeps the runs in a store.",
      .examples = R"(build/truetriad simulate -c configs/scenarios/fleet.yaml -o out/line
build/truetriad fleet run out/line -o out/day --report=false)",
      .details =
          R"(Units are calibrated in --jobs processes: if a log crashes its process, hangs or needs too much memory, only
the run of its unit fails. Each run has files in OUTPUT/units/SERIAL/RUN and is kept in the store; earlier
runs stay. A file that lists logs is a CSV with columns log, serial, recorded and tags. Exit code 0: all
units were processed; with --fail-on=unit, 4 if a unit is not good. SIGTERM ends the command once the units
in progress are done; --resume continues.
)",
      .flags = FleetFlags("units-of resume shard"),
      .more_words = "units-of",
      .run = RunFleetVerb};
}

Command FleetWatchCommand() {
  return {
      .name = "fleet watch",
      .summary = "Calibrates units as their logs arrive in a folder, for days.",
      .examples = R"(build/truetriad simulate -c configs/scenarios/fleet.yaml -o out/line
build/truetriad fleet watch out/line -o out/day --report=false --until-idle=5)",
      .details =
          R"(Like fleet run, for logs in FOLDER or below it that have no run yet, and then for each log that arrives
there, once two looks have found it unchanged. If a log arrives again and has changed, it gets a new run. A
recording.yaml is calibrated once all files that it names are there and unchanged; if --until-idle ends the
command while files are still missing, it is calibrated as it is. SIGTERM ends the command once the units in
progress are done, with exit code 0.
)",
      .flags = FleetFlags("folder! poll until-idle"),
      .words = {"folder"},
      .run = RunFleetWatch};
}

}  // namespace truetriad
