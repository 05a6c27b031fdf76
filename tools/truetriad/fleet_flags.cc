// SPDX-License-Identifier: Apache-2.0
#include "tools/truetriad/fleet_flags.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <string>
#include <thread>
#include <utility>

#include "fleet/fleet_run.h"
#include "tools/truetriad/flags.h"
#include "tools/truetriad/fleet_progress.h"
#include "truetriad/io/calibration_file.h"
#include "truetriad/report/report.h"

DECLARE_int32(jobs);
DEFINE_string(store,
              "",
              "FILE|URL: where the runs are kept: a file for SQLite, or "
              "postgresql://HOST/DATABASE, or NAME.jsonl for a shard's own, which `fleet collect` "
              "merges; what calibrates has fleet.db in its output folder");
DEFINE_string(assets,
              "inline",
              "inline|shared: where the looks and the script of reports are: inline, in each page, "
              "or shared, once for all");
DEFINE_string(serial,
              "",
              "PATTERN: how logs are named, to take serial numbers from there: {serial} and * for "
              "anything else, as in {serial}-*.csv");
DEFINE_string(time_limit, "120", "SECONDS: seconds that a unit may take");
DEFINE_string(memory_limit, "2048", "MB: MB of address space that a unit may take");
DEFINE_string(retest_counts,
              "",
              "last|first|best: which run of a unit that is measured again counts: last (default), "
              "first or best; said once, the store keeps it");
DEFINE_string(
    retest_most,
    "",
    "N: how many recordings of a unit count after its first (default: all); said once likewise");
DEFINE_string(require_golden,
              "",
              "AGE: how old the station's last check-station may be, as in 8h, 30m or 1d; no unit "
              "is calibrated where it is older, or did not agree");
DEFINE_string(progress, "", "jsonl: jsonl: a line of JSON about each run, on stderr");

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
  constexpr double kLeast = 64.0, kMost = 1e9;
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
  // From wherever the store is read.
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
  TRUETRIAD_ASSIGN_OR_RETURN(const std::optional<fleet::RetestPolicy> before,
                             store.StatedRetestPolicy());
  TRUETRIAD_RETURN_IF_ERROR(store.StateRetestPolicy(policy));
  if (before || policy == fleet::RetestPolicy()) return {};
  // JSON lines take none once they have begun.
  const Result<fleet::Table> runs = store.Query("SELECT 1 FROM run LIMIT 1");
  if (runs && !runs->rows.empty()) {
    FleetTalk().Listener().on_note(
        "from now on the " + std::string(RetestCountsName(policy.counts)) + " of a unit's " +
        (!policy.most       ? "runs"
         : *policy.most > 0 ? "first " + std::to_string(*policy.most + 1) + " recordings"
                            : "runs of its first recording") +
        " counts, also of units that are in the store; until now the last of all did");
  }
  return {};
}

}  // namespace

Result<double> ParseDuration(const std::string& flag, const std::string& text) {
  constexpr std::string_view kUnits = "smhd";
  constexpr std::array<double, 4> kSeconds = {1.0, 60.0, 3600.0, 86400.0};
  const std::size_t unit = text.empty() ? kUnits.npos : kUnits.find(text.back());
  if (unit != kUnits.npos) {
    const Result<double> number = ParseReal(flag, text.substr(0, text.size() - 1));
    if (number && *number > 0.0) return *number * kSeconds[unit];
  }
  return BadValue(flag, text, ": expected a duration, as in 8h, 30m or 1d");
}

Result<GoldenHold> StatedGoldenHold(const fleet::WorkPlan& plan,
                                    fleet::Store& store,
                                    bool needs_station) {
  if (FLAGS_require_golden.empty()) return GoldenHold();
  TRUETRIAD_ASSIGN_OR_RETURN(const double age_s,
                             ParseDuration("require-golden", FLAGS_require_golden));
  if (needs_station && plan.tags.station.empty()) {
    return Error(
        ErrorCode::kMissingArgument,
        "no station is named whose golden unit is to be required; give --tag=station=NAME");
  }
  return GoldenHold([station = plan.tags.station, age_s, &store](const std::string& of_unit) {
    return fleet::GoldenHold(store, of_unit.empty() ? station : of_unit, age_s);
  });
}

Status PrepareUnitsFolder(const fleet::WorkPlan& plan) {
  TRUETRIAD_RETURN_IF_ERROR(EnsureWritableDirectory(plan.folder));
  return plan.shares_assets ? fleet::WriteSharedAssets(plan.folder) : Status();
}

std::string StatedStore() {
  return FLAGS_store.empty() ? (fs::path(FLAGS_output) / "fleet.db").string() : FLAGS_store;
}

Result<std::unique_ptr<fleet::Store>> OpenStatedStore() {
  TRUETRIAD_ASSIGN_OR_RETURN(std::unique_ptr<fleet::Store> store, fleet::OpenStore(StatedStore()));
  TRUETRIAD_RETURN_IF_ERROR(StateRetestPolicy(*store));
  return store;
}

Status NameStore(fleet::Store& store, fleet::WorkPlan* plan) {
  TRUETRIAD_ASSIGN_OR_RETURN(const std::string identity, store.Identity());
  // A copy of a store's file has the same identity, and runs of its own.
  plan->store = identity + ' ' + fleet::NameOfStore(StatedStore());
  return {};
}

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
  // Each takes some 10 MB and a socket.
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

std::string FleetFlags(const std::string& own) {
  return own +
         " config output store jobs serial to outside-limits report=true|false assets set* tag* "
         "retest-counts retest-most require-golden time-limit memory-limit progress fail-on=unit";
}

}  // namespace truetriad
