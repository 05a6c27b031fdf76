// SPDX-License-Identifier: Apache-2.0
#include "fleet/collect.h"

#include <charconv>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <utility>

#include "fleet/json_lines_store.h"
#include "fleet/rows.h"
#include "fleet/shard.h"
#include "fleet/store.h"

namespace truetriad::fleet {
namespace {

/// Runs that are added at once: enough for one flush to be little of their cost.
constexpr std::size_t kRunsAtOnce = 200;

/// What the sources say before anything is written.
struct Survey {
  std::size_t runs = 0;
  int shards = 0;       ///< 0: nobody says it.
  std::string said_by;  ///< The source that says it.
  std::set<int> present;
};

bool IsSameStore(const std::string& one, const std::string& other) {
  const std::optional<std::string> file = FileOfStore(one);
  const std::optional<std::string> other_file = FileOfStore(other);
  if (!file || !other_file) return one == other;
  std::error_code failure;
  return std::filesystem::equivalent(*file, *other_file, failure) || *file == *other_file;
}

Status CheckTarget(const std::vector<std::string>& sources, const std::string& target) {
  if (JsonLinesPath(target)) {
    return Error(ErrorCode::kInvalidArgument,
                 "--store=" + target +
                     ": a file of runs cannot be collected into; name a file for SQLite, as in "
                     "--store=fleet.db, and make JSON lines of it with `truetriad fleet export`");
  }
  for (const std::string& source : sources) {
    if (!IsSameStore(source, target)) continue;
    return Error(ErrorCode::kConflictingArguments,
                 {ShownStore(source)},
                 "is the store itself; name those that are to be added to it");
  }
  return {};
}

/// The shard of a run, which is one of `count`.
Result<int> IndexOf(const UnitRun& run, int count, const std::string& source) {
  const std::optional<Shard> shard =
      run.shard.empty() ? std::optional(Shard()) : ShardFromText(run.shard);
  if (shard && shard->count == count) return shard->index;
  return Error(ErrorCode::kDoesNotMatch,
               {ShownStore(source)},
               "run " + run.id + " is of shard `" + run.shard + "`, and the store is of " +
                   std::to_string(count) + "; it has been changed by another program");
}

Status Look(const std::string& source, Survey* survey) {
  TRUETRIAD_ASSIGN_OR_RETURN(const std::unique_ptr<Store> store, OpenStoreToRead(source));
  TRUETRIAD_ASSIGN_OR_RETURN(const StatedShards shards, store->Shards());
  if (shards.count > 0) {
    if (survey->shards > 0 && survey->shards != shards.count) {
      return Error(ErrorCode::kConflictingArguments,
                   {ShownStore(source)},
                   "is of " + std::to_string(shards.count) + " shards, and " + survey->said_by +
                       " of " + std::to_string(survey->shards) +
                       "; collect those of one fleet run");
    }
    survey->shards = shards.count;
    survey->said_by = ShownStore(source);
  }
  if (shards.only) survey->present.insert(*shards.only);
  return store->ForEachRun({}, [&](const UnitRun& run) -> Status {
    TRUETRIAD_ASSIGN_OR_RETURN(const int index, IndexOf(run, std::max(shards.count, 1), source));
    survey->present.insert(index);
    ++survey->runs;
    return {};
  });
}

Status AddFrom(const std::string& source, Store& target) {
  TRUETRIAD_ASSIGN_OR_RETURN(const std::unique_ptr<Store> store, OpenStoreToRead(source));
  std::vector<UnitRun> waiting;
  TRUETRIAD_RETURN_IF_ERROR(store->ForEachRun({}, [&](UnitRun run) -> Status {
    waiting.push_back(std::move(run));
    if (waiting.size() < kRunsAtOnce) return {};
    TRUETRIAD_RETURN_IF_ERROR(target.AddAll(waiting));
    waiting.clear();
    return {};
  }));
  TRUETRIAD_RETURN_IF_ERROR(target.AddAll(waiting));
  return JsonLinesPath(source) ? Status() : target.AddDecisions(*store);
}

Result<std::size_t> CountRuns(Store& store) {
  TRUETRIAD_ASSIGN_OR_RETURN(const Table table, store.Query("SELECT count(*) FROM run"));
  const std::string text = table.rows.at(0).at(0).value_or("0");
  std::size_t count = 0;
  std::from_chars(text.data(), text.data() + text.size(), count);
  return count;
}

/// Of `count`, those that are not in `present`, nor the store has runs of.
Result<std::vector<int>> MissingShards(Store& store, int count, std::set<int> present) {
  TRUETRIAD_ASSIGN_OR_RETURN(const Table table, store.Query("SELECT DISTINCT shard FROM run"));
  for (const auto& row : table.rows) {
    const std::string text = row[0].value_or("");
    if (const auto shard = text.empty() ? std::optional(Shard()) : ShardFromText(text)) {
      present.insert(shard->index);
    }
  }
  std::vector<int> missing;
  for (int i = 0; i < count; ++i) {
    if (!present.contains(i)) missing.push_back(i);
  }
  return missing;
}

}  // namespace

Result<Collected> Collect(const std::vector<std::string>& sources, const std::string& target) {
  TRUETRIAD_RETURN_IF_ERROR(CheckTarget(sources, target));
  Survey survey;
  for (const std::string& source : sources) TRUETRIAD_RETURN_IF_ERROR(Look(source, &survey));
  Collected collected;
  collected.runs = survey.runs;
  collected.shards = std::max(survey.shards, 1);
  TRUETRIAD_ASSIGN_OR_RETURN(const std::unique_ptr<Store> store, OpenStore(target));
  if (survey.shards > 0) {
    TRUETRIAD_RETURN_IF_ERROR(store->StateShard({0, survey.shards}));
  }
  TRUETRIAD_ASSIGN_OR_RETURN(const std::size_t before, CountRuns(*store));
  for (const std::string& source : sources) TRUETRIAD_RETURN_IF_ERROR(AddFrom(source, *store));
  TRUETRIAD_ASSIGN_OR_RETURN(const std::size_t after, CountRuns(*store));
  collected.added = after - before;
  TRUETRIAD_ASSIGN_OR_RETURN(collected.missing,
                             MissingShards(*store, collected.shards, survey.present));
  return collected;
}

}  // namespace truetriad::fleet
