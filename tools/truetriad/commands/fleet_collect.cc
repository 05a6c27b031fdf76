// SPDX-License-Identifier: Apache-2.0
#include <string>
#include <vector>

#include <gflags/gflags.h>

#include "fleet/collect.h"
#include "fleet/store.h"
#include "tools/truetriad/command.h"
#include "tools/truetriad/flags.h"
#include "tools/truetriad/fleet_flags.h"

DEFINE_bool(unfinished,
            false,
            "take files of shards, too, that are still being written or were cut off");

namespace truetriad {
namespace {

/// "1, 4 and 7 further ones"
std::string ShardList(const std::vector<int>& shards) {
  constexpr std::size_t kMost = 20;
  std::string text;
  for (std::size_t i = 0; i < std::min(shards.size(), kMost); ++i) {
    text += (text.empty() ? "" : ", ") + std::to_string(shards[i]);
  }
  if (shards.size() > kMost) {
    text += " and " + std::to_string(shards.size() - kMost) + " further ones";
  }
  return text;
}

Result<VerbResult> RunFleetCollect(const std::vector<std::string>& sources) {
  if (sources.empty()) {
    return Error(ErrorCode::kMissingArgument,
                 "nothing to collect; name the shards' files, as in day/*.jsonl, or stores");
  }
  TRUETRIAD_ASSIGN_OR_RETURN(const fleet::Collected collected,
                             fleet::Collect(sources, FLAGS_store, FLAGS_unfinished));
  if (!collected.missing.empty()) {
    Note("note: no file and no run of shard " + ShardList(collected.missing) + " of " +
         std::to_string(collected.shards) + " (counted from 0)");
  }
  for (const std::string& source : collected.unfinished) {
    Note("note: " + source + " is not finished: units of its shard may be missing");
  }
  constexpr std::size_t kMostCopies = 10;
  for (std::size_t i = 0; i < std::min(collected.copies.size(), kMostCopies); ++i) {
    Warn(collected.copies[i] +
         "; find out which unit was measured, and refuse the other with `truetriad fleet dispose`");
  }
  if (collected.copies.size() > kMostCopies) {
    Warn("and " + std::to_string(collected.copies.size() - kMostCopies) +
         " further units with the readings of another");
  }
  for (const std::string& note : collected.notes) Warn(note);
  const std::string store = fleet::ShownStore(FLAGS_store);
  Json shown = Json::array();
  for (const std::string& source : sources) shown.push_back(fleet::ShownStore(source));
  return VerbResult{
      // The store knows of it, but files of units that may not leave are as they were.
      .exit_code = collected.unsafe.empty() ? kExitGood : kExitOutsideLimits,
      .text = std::to_string(collected.runs) + (collected.runs == 1 ? " run in " : " runs in ") +
              std::to_string(sources.size()) + (sources.size() == 1 ? " source, " : " sources, ") +
              std::to_string(collected.added) + " of them new\n  Store: " + store + '\n',
      .result = {{"sources", shown},
                 {"runs", collected.runs},
                 {"added", collected.added},
                 {"shards", collected.shards},
                 {"missing", collected.missing},
                 {"copies", collected.copies},
                 {"unfinished", collected.unfinished},
                 {"unreached", collected.unsafe},
                 {"store", store}}};
}

}  // namespace

Command FleetCollectCommand() {
  return {
      .name = "fleet collect",
      .summary = "How do I bring the runs of several machines into one store?",
      .examples = R"(build/truetriad simulate -c configs/scenarios/fleet.yaml -o out/line
build/truetriad fleet run out/line -o out/day --report=false --shard=0/2 --store=out/day/0.jsonl
build/truetriad fleet run out/line -o out/day --report=false --shard=1/2 --store=out/day/1.jsonl
build/truetriad fleet collect out/day/0.jsonl out/day/1.jsonl --store=out/day/all.db)",
      .details =
          R"(Files of runs and stores, all of the same number of shards. Runs that are in the store stay as they are:
collecting again adds what has come since. Nothing is added where a source is spoilt, or a shard's file not finished.
A file of runs does not know a unit's other runs: where one may not leave, exports of its other runs are
withdrawn as they are collected (4: where their files are not here).
)",
      .flags = "store=FILE! unfinished",
      .more_words = "file",
      .run = RunFleetCollect};
}

}  // namespace truetriad
