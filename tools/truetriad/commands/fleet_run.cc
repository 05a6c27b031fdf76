// SPDX-License-Identifier: Apache-2.0
#include "fleet/fleet_run.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include <gflags/gflags.h>

#include "fleet/unit_list.h"
#include "tools/truetriad/command.h"
#include "tools/truetriad/flags.h"
#include "tools/truetriad/fleet_flags.h"
#include "tools/truetriad/format_flags.h"
#include "tools/truetriad/interruption.h"
#include "tools/truetriad/progress.h"
#include "truetriad/io/calibration_file.h"
#include "truetriad/report/report.h"

DECLARE_string(to);
DECLARE_int32(jobs);
DEFINE_string(units_of, "", "logs, folders with logs, patterns as 'line-3/*.csv', and lists");
DEFINE_string(
    store,
    "",
    "where the runs are kept: a file for SQLite (default: fleet.db in the output folder), or "
    "postgresql://HOST/DATABASE, or NAME.jsonl for a shard's own, which `fleet collect` merges");
DEFINE_bool(resume,
            false,
            "leave out logs whose run with this experiment and this program is in the store, as "
            "long as they have not been touched");
DEFINE_string(serial,
              "",
              "how logs are named, to take serial numbers from there: {serial} and * for anything "
              "else, as in {serial}-*.csv");
DEFINE_string(assets,
              "inline",
              "where the looks of reports are: inline, in each page, or shared, once for all");
DEFINE_string(shard, "", "I/N: only that part of the units, I from 0 to N-1");
DEFINE_string(time_limit, "120", "seconds that a unit may take");
DEFINE_string(memory_limit, "2048", "MB of address space that a unit may take");

namespace truetriad {
namespace {

namespace fs = std::filesystem;

constexpr char kUnit[] = "unit";

Result<fleet::Shard> StatedShard() {
  if (FLAGS_shard.empty()) return fleet::Shard();
  if (const std::optional<fleet::Shard> shard = fleet::ShardFromText(FLAGS_shard)) return *shard;
  return Error(ErrorCode::kInvalidArgument,
               "--shard=" + FLAGS_shard + ": expected I/N with I from 0 to N-1, as in 0/4");
}

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

Result<fleet::WorkPlan> StatedPlan(const fleet::Shard& shard) {
  TRUETRIAD_ASSIGN_OR_RETURN(std::vector<std::string> overrides, OverridesAndTags());
  TRUETRIAD_ASSIGN_OR_RETURN(
      fleet::WorkPlan plan,
      fleet::PlanWork(FLAGS_config, std::move(overrides), CommaSeparated(FLAGS_to)));
  if (!FLAGS_report.empty() && FLAGS_report != "true" && FLAGS_report != "false") {
    return Error(ErrorCode::kInvalidArgument,
                 "--report=" + FLAGS_report + " is invalid; expected true or false");
  }
  plan.has_report = FLAGS_report != "false";
  if (FLAGS_assets != "inline" && FLAGS_assets != "shared") {
    return Error(ErrorCode::kInvalidArgument,
                 "--assets=" + FLAGS_assets + " is invalid; expected inline or shared");
  }
  plan.shares_assets = plan.has_report && FLAGS_assets == "shared";
  plan.folder = (fs::path(FLAGS_output) / "units").string();
  plan.shard = fleet::ShardText(shard);
  return plan;
}

Status WriteSharedAssets(const std::string& folder) {
  const fs::path file = fs::path(folder) / fleet::kSharedStyleSheet;
  TRUETRIAD_RETURN_IF_ERROR(EnsureWritableDirectory(file.parent_path().string()));
  return WriteFileAtomically(file.string(), ReportStyleSheet());
}

/// "3 pass, 1 outside-limits".
std::string CountsText(const fleet::FleetProgress& progress) {
  std::string text;
  for (const auto& [verdict, count] : progress.verdicts) {
    text += (text.empty() ? "" : ", ") + std::to_string(count) + " " +
            std::string(fleet::VerdictName(verdict));
  }
  return text.empty() ? "none" : text;
}

/// What is red, the most frequent first.
std::vector<std::pair<std::string, std::size_t>> Pareto(const fleet::FleetProgress& progress) {
  std::vector<std::pair<std::string, std::size_t>> codes(progress.codes.begin(),
                                                         progress.codes.end());
  std::stable_sort(
      codes.begin(), codes.end(), [](const auto& a, const auto& b) { return a.second > b.second; });
  return codes;
}

std::string SummaryText(const fleet::FleetProgress& progress, const std::string& store) {
  std::array<char, 96> rate{};
  const double units = static_cast<double>(progress.done);
  std::snprintf(rate.data(),
                rate.size(),
                " in %.1f s (%.1f a second; %.1f ms of processor time each)",
                progress.seconds,
                units / std::max(progress.seconds, 1e-9),
                1e3 * progress.cpu_s / std::max(units, 1.0));
  std::string text =
      std::to_string(progress.red) + " OF " + std::to_string(progress.done) + " NOT GOOD\n";
  if (progress.red == 0) text = progress.done == 0 ? "NOTHING TO DO\n" : "ALL GOOD\n";
  text += "  " + std::to_string(progress.done) + " units" + rate.data() + ": " +
          CountsText(progress) + '\n';
  if (progress.skipped > 0) {
    text += "  " + std::to_string(progress.skipped) + " left out: their runs are there\n";
  }
  for (const auto& [code, count] : Pareto(progress)) {
    text += "  " + std::to_string(count) + " x " + code + '\n';
  }
  return text + "  Store: " + store + '\n';
}

Json SummaryJson(const fleet::FleetProgress& progress, const std::string& store) {
  Json json = {{"units", progress.units},
               {"done", progress.done},
               {"skipped", progress.skipped},
               {"not_good", progress.red},
               {"verdicts", Json::object()},
               {"codes", Json::object()},
               {"seconds", progress.seconds},
               {"cpu_s", progress.cpu_s},
               {"store", store}};
  for (const auto& [verdict, count] : progress.verdicts) {
    json["verdicts"][std::string(fleet::VerdictName(verdict))] = count;
  }
  for (const auto& [code, count] : Pareto(progress)) json["codes"][code] = count;
  return json;
}

Result<VerbResult> RunFleetVerb(const std::vector<std::string>& words) {
  TRUETRIAD_RETURN_IF_ERROR(CheckFailOn(kUnit));
  TRUETRIAD_ASSIGN_OR_RETURN(const fleet::Shard shard, StatedShard());
  fleet::FleetOptions options;
  TRUETRIAD_ASSIGN_OR_RETURN(options.limits, StatedLimits());
  if (FLAGS_output.empty()) FLAGS_output = "fleet";
  TRUETRIAD_ASSIGN_OR_RETURN(options.plan, StatedPlan(shard));
  std::vector<std::string> logs = CommaSeparated(FLAGS_units_of);
  logs.insert(logs.end(), words.begin(), words.end());
  TRUETRIAD_ASSIGN_OR_RETURN(std::vector<fleet::UnitOrder> units,
                             fleet::ListUnits(logs, FLAGS_serial));
  units = fleet::ShardOf(std::move(units), shard.index, shard.count);
  if (FLAGS_jobs < 0) {
    return Error(ErrorCode::kInvalidArgument, "--jobs: expected a number of processes, 0 or more");
  }
  options.jobs = FLAGS_jobs > 0
                     ? FLAGS_jobs
                     : std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  options.resumes = FLAGS_resume;
  options.worker_command = {"/proc/self/exe", std::string(kFleetWorker)};
  TRUETRIAD_RETURN_IF_ERROR(EnsureWritableDirectory(options.plan.folder));
  if (options.plan.shares_assets) {
    TRUETRIAD_RETURN_IF_ERROR(WriteSharedAssets(options.plan.folder));
  }
  const std::string url =
      FLAGS_store.empty() ? (fs::path(FLAGS_output) / "fleet.db").string() : FLAGS_store;
  TRUETRIAD_ASSIGN_OR_RETURN(const std::unique_ptr<fleet::Store> store, fleet::OpenStore(url));
  TRUETRIAD_RETURN_IF_ERROR(store->StateShard(shard));
  NoteInterruptions();
  const Result<fleet::FleetProgress> progress = [&] {
    ProgressLine line("calibrating " + std::to_string(units.size()) + " units");
    const ProgressCallback show = line.callback();
    return fleet::RunFleet(
        units,
        options,
        *store,
        [&](const fleet::UnitRun& run, const fleet::FleetProgress& so_far) {
          if (show) show(static_cast<double>(so_far.done) / static_cast<double>(so_far.units));
          if (fleet::IsRed(run.verdict)) {
            Note(run.serial + ": " + std::string(fleet::VerdictName(run.verdict)) + ", " +
                 run.code + " (" + run.log + ")");
          }
        },
        IsInterrupted);
  }();
  TRUETRIAD_RETURN_IF_ERROR(progress);
  if (progress->is_stopped) {
    Note("stopped: " + std::to_string(progress->done) + " of " + std::to_string(progress->units) +
         " units are done and in the store; go on with --resume");
    EndAsInterrupted();
  }
  const bool has_failed = FLAGS_fail_on == kUnit && progress->red > 0;
  return VerbResult{.exit_code = has_failed ? kExitOutsideLimits : kExitGood,
                    .text = SummaryText(*progress, fleet::ShownStore(url)),
                    .result = SummaryJson(*progress, fleet::ShownStore(url)),
                    .grade = progress->red == 0 ? Grade::kGood : Grade::kCaution};
}

}  // namespace

Command FleetRunCommand() {
  return {
      .name = "fleet run",
      .summary = "Which of these units are good? Each calibrated by itself, and kept in a store.",
      .examples =
          "build/truetriad simulate -c configs/scenarios/fleet.yaml -o out/line\n"
          "build/truetriad fleet run out/line -o out/day --report=false",
      .details =
          "Every unit is calibrated in a process of its own: what crashes, hangs or needs too much "
          "memory is one\nunit's run. Files are in OUTPUT/units/SERIAL/RUN, runs in the store; "
          "those "
          "of before stay. A list is\na CSV with columns log, serial and tags. Exit code 0: all "
          "were "
          "processed; with --fail-on=unit 4, if\none is not good. SIGTERM ends it after the units "
          "in "
          "hand; --resume goes on.\n",
      .flags = {{"units-of", "LIST|FOLDER|GLOB"},
                {"config", "EXPERIMENT.yaml"},
                {"output", "DIR"},
                {"store", "FILE|URL"},
                {"jobs", "N"},
                {"resume", "true|false"},
                {"serial", "PATTERN"},
                {"to", "FORMAT,..."},
                {"report", "true|false", false, {"true", "false"}},
                {"assets", "inline|shared", false, {"inline", "shared"}},
                {"set", "KEY=VALUE,...", false, {}, true},
                {"tag", "KEY=VALUE", false, {}, true},
                {"shard", "I/N"},
                {"time-limit", "SECONDS"},
                {"memory-limit", "MB"},
                {"fail-on", "unit", false, {kUnit}}},
      .more_words = "units-of",
      .run = RunFleetVerb};
}

}  // namespace truetriad
