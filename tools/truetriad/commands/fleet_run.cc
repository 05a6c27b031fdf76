// SPDX-License-Identifier: Apache-2.0
#include "fleet/fleet_run.h"

#include <algorithm>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <gflags/gflags.h>

#include "fleet/store.h"
#include "fleet/unit_folders.h"
#include "fleet/unit_list.h"
#include "tools/truetriad/command.h"
#include "tools/truetriad/flags.h"
#include "tools/truetriad/fleet_flags.h"
#include "tools/truetriad/fleet_progress.h"
#include "tools/truetriad/interruption.h"
#include "truetriad/io/calibration_file.h"

DEFINE_string(units_of,
              "",
              "LIST|FOLDER|GLOB: logs, folders with logs, patterns as 'line-3/*.csv', and lists");
DEFINE_bool(resume,
            false,
            "leave out logs that have not changed since their last run, which is in the store and "
            "was by this experiment, this program, and the serial number and tags of the list");
DEFINE_string(shard, "", "I/N: I/N: only that part of the units, I from 0 to N-1");

namespace truetriad {
namespace {

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
  TRUETRIAD_ASSIGN_OR_RETURN(const std::unique_ptr<fleet::Store> store, OpenStatedStore());
  TRUETRIAD_RETURN_IF_ERROR(store->StateShard(shard));
  TRUETRIAD_RETURN_IF_ERROR(NameStore(*store, &options.plan));
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
      fleet::FolderClaim::Share(options.plan.folder, *store, options.plan.store));
  NoteInterruptions();
  const Result<fleet::FleetProgress> progress = [&] {
    FleetTalk talk;
    return fleet::RunFleet(std::move(units), options, *store, talk.Listener(), IsInterrupted);
  }();
  TRUETRIAD_RETURN_IF_ERROR(progress);
  if (progress->is_stopped) {
    Note("stopped: " + std::to_string(progress->done) + " of " +
         std::to_string(progress->units.value_or(0)) +
         " units are done and in the store; go on with --resume");
    EndAsInterrupted();
  }
  return FleetResult(*progress);
}

}  // namespace

Command FleetRunCommand() {
  return {
      .name = "fleet run",
      .summary = "Which of these units are good? Each calibrated by itself, and kept in a store.",
      .examples = R"(build/truetriad simulate -c configs/scenarios/fleet.yaml -o out/line
build/truetriad fleet run out/line -o out/day --report=false)",
      .details =
          R"(Units are calibrated in --jobs processes: what crashes one, hangs or needs too much memory is that
unit's run. Files are in OUTPUT/units/SERIAL/RUN, runs in the store; those of before stay. A list is
a CSV with columns log, serial, recorded and tags. Exit code 0: all were processed; with --fail-on=unit 4, if
one is not good. SIGTERM ends it after the units in hand; --resume goes on.
)",
      .flags = FleetFlags("units-of resume shard"),
      .more_words = "units-of",
      .run = RunFleetVerb};
}

}  // namespace truetriad
