// SPDX-License-Identifier: Apache-2.0
#include "fleet/collect.h"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <functional>
#include <iterator>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <unordered_map>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <unistd.h>

#include "fleet/json_lines.h"
#include "fleet/store.h"
#include "fleet/unit_folders.h"
#include "io/input_guard.h"
#include "io/whole_file.h"

namespace truetriad::fleet {
namespace {

namespace fs = std::filesystem;

/// The state of a collection while sources are examined.
struct Survey {
  Collected collected;
  int shards = 0;       ///< 0: not stated.
  std::string said_by;  ///< The source that states `shards`.
  std::set<int> present;
  std::optional<RetestPolicy> policy;  ///< Of all stores so far; unset: none has a policy.
  std::string counted_by;              ///< The last store with `policy`.
  bool states_policy = false;          ///< One of these stores states the policy explicitly.
  std::unordered_map<std::size_t, std::size_t>
      contents;                                ///< Of runs: hash of contents by hash of name.
  std::map<std::string, std::string> decided;  ///< Contents of decisions and checks, by name.
  std::map<std::string, std::vector<Disposition>> dispositions;  ///< By the run that they name.
  std::vector<StationCheck> checks;
};

/// The contents of a run, to compare copies of the run. Findings and message are left out, since
/// PostgreSQL stores them with invalid UTF-8 replaced.
std::string ContentOf(UnitRun run) {
  run.findings.clear();
  run.message.clear();
  return LineOf(run);
}

/// The contents of a decision without its run: in an export of current runs only, the same decision
/// may name another run of the unit.
std::string ContentOf(Disposition disposition) {
  disposition.run.clear();
  return LineOf(disposition);
}

Error OtherContent(const std::string& source, const std::string& what) {
  return Error(ErrorCode::kDoesNotMatch,
               {ShownStore(source)},
               what + " exists twice with different content; one of the two was changed");
}

/// If the error names no file, adds the name of the source.
Status Placed(const Status& status, const std::string& source) {
  if (status || !status.error().place.file.empty()) return status;
  return Error(status.error().code, {ShownStore(source)}, status.error().message);
}

/// Records the policy of a store. Error (usage): an earlier store has another policy.
Status TakePolicy(const std::optional<RetestPolicy>& stated,
                  const std::string& name,
                  bool has_runs,
                  Survey* survey) {
  if (!stated && !has_runs) return {};
  const RetestPolicy policy = stated.value_or(RetestPolicy());
  if (survey->policy && *survey->policy != policy) {
    return Error(ErrorCode::kConflictingArguments,
                 {ShownStore(name)},
                 "its retest policy is `" + PolicyText(policy) + "`, but that of " +
                     survey->counted_by + " is `" + PolicyText(*survey->policy) +
                     "`; collect stores with the same policy (--retest-counts, --retest-most)");
  }
  survey->policy = policy;
  survey->counted_by = ShownStore(name);
  survey->states_policy = survey->states_policy || stated.has_value();
  return {};
}

/// Records a decision or check. Error: an earlier one of the same name has different contents.
template <typename Thing>
Status TakeDecided(const std::string& source,
                   const std::string& what,
                   const Thing& thing,
                   const std::string& content,
                   Survey* survey) {
  TRUETRIAD_RETURN_IF_ERROR(Placed(CheckStored(thing), source));
  const auto [known, is_new] = survey->decided.emplace(what + thing.id, content);
  return known->second == content ? Status() : Status(OtherContent(source, what + thing.id));
}

Status TakeDecisions(const std::string& source, const Decisions& decisions, Survey* survey) {
  for (const Disposition& one : decisions.dispositions) {
    TRUETRIAD_RETURN_IF_ERROR(TakeDecided(source, "decision ", one, ContentOf(one), survey));
  }
  for (const StationCheck& one : decisions.checks) {
    TRUETRIAD_RETURN_IF_ERROR(TakeDecided(source, "station check ", one, LineOf(one), survey));
  }
  return {};
}

bool IsSameStore(const std::string& one, const std::string& other) {
  const std::optional<std::string> file = FileOfStore(one);
  const std::optional<std::string> other_file = FileOfStore(other);
  if (!file || !other_file) return one == other;
  std::error_code failure;
  return fs::equivalent(*file, *other_file, failure) || *file == *other_file;
}

Status CheckTarget(const std::vector<std::string>& sources, const std::string& target) {
  if (JsonLinesPath(target)) {
    return Error(
        ErrorCode::kInvalidArgument,
        "--store=" + target +
            ": a file of JSON lines cannot be the target; name a file for SQLite, as in "
            "--store=fleet.db, and write JSON lines from it with `truetriad fleet export`");
  }
  for (const std::string& source : sources) {
    if (!IsSameStore(source, target)) continue;
    return Error(ErrorCode::kConflictingArguments,
                 {ShownStore(source)},
                 "is the target (--store) itself; name the other stores, which are to be added to "
                 "the target");
  }
  return {};
}

/// Error: the run is invalid, or its shard states another number of shards than the store.
Status CheckRunOfStore(const UnitRun& run, int shards) {
  const std::string name = "run " + run.id;
  if (const Status checked = CheckRun(run); !checked) {
    return Error(checked.error().code, name + ": " + checked.error().message);
  }
  const std::optional<Shard> shard = ShardFromText(run.shard);
  if (shard && shard->count == shards) return {};
  return Error(ErrorCode::kDoesNotMatch,
               name + " is of shard `" + run.shard +
                   "`, but its store states the number of shards " + std::to_string(shards) +
                   "; another program has changed the store");
}

/// Calls `take` with each run of a source, which may be a database or a file of runs.
Result<LinesRead> ReadSource(const std::string& url, const std::function<Status(UnitRun)>& take) {
  if (const std::optional<std::string> path = JsonLinesPath(url)) {
    InputGuard::Add(*path);
    return ForEachLine(*path, take);
  }
  TRUETRIAD_ASSIGN_OR_RETURN(const std::unique_ptr<Store> store, OpenStoreToRead(url));
  LinesRead source;
  source.is_ended = true;
  TRUETRIAD_ASSIGN_OR_RETURN(source.header, store->Header());
  TRUETRIAD_ASSIGN_OR_RETURN(source.decisions, store->ReadDecisions());
  const Status read = store->ForEachRun({}, [&](UnitRun run) -> Status {
    TRUETRIAD_RETURN_IF_ERROR(CheckRunOfStore(run, std::max(source.header.shards.count, 1)));
    return take(std::move(run));
  });
  TRUETRIAD_RETURN_IF_ERROR(read);
  return source;
}

/// The error for a source that may lack runs.
Error Unfinished(const std::string& source, std::size_t runs) {
  return Error(
      ErrorCode::kDamagedFile,
      {source},
      "has " + std::to_string(runs) +
          " runs, but no line at its end that confirms their number: `fleet run` is still writing "
          "this file or was stopped, an older truetriad wrote it, or lines have been cut off. Run "
          "the shard again with --resume, which adds the missing runs, or collect the present runs "
          "with --unfinished");
}

/// Calls `take` with the runs of a source in batches. Errors name the source.
Result<LinesRead> ReadInParts(const std::string& name,
                              const std::function<Status(const std::vector<UnitRun>&)>& take) {
  constexpr std::size_t kRunsAtOnce = 500;  // About 10 MB, added in half a second.
  std::vector<UnitRun> runs;
  Result<LinesRead> source = ReadSource(name, [&](UnitRun run) -> Status {
    runs.push_back(std::move(run));
    if (runs.size() < kRunsAtOnce) return {};
    const Status taken = take(runs);
    runs.clear();
    return taken;
  });
  if (!source) return Placed(source.error(), name).error();
  TRUETRIAD_RETURN_IF_ERROR(take(runs));
  return source;
}

/// The number of `runs` that are new to the store. Error: a run has other contents in the store.
Result<std::size_t> NewRuns(const std::string& name,
                            const std::vector<UnitRun>& runs,
                            Store& store) {
  std::vector<std::string> names;
  for (const UnitRun& run : runs) names.push_back(run.id);
  TRUETRIAD_ASSIGN_OR_RETURN(const std::vector<UnitRun> there, store.ReadRuns(names));
  std::map<std::string, std::string> contents;
  for (const UnitRun& run : there) contents[run.id] = ContentOf(run);
  std::set<std::string> fresh;
  for (const UnitRun& run : runs) {
    const auto known = contents.find(run.id);
    if (known == contents.end()) {
      fresh.insert(run.id);
    } else if (known->second != ContentOf(run)) {
      return OtherContent(name, "run " + run.id);
    }
  }
  return fresh.size();
}

/// Examines a source. Error: the source cannot be added.
Status Look(const std::string& name, bool takes_unfinished, Store& store, Survey* survey) {
  Collected& collected = survey->collected;
  const std::size_t before = collected.runs;
  const std::hash<std::string> hash;
  TRUETRIAD_ASSIGN_OR_RETURN(
      LinesRead source, ReadInParts(name, [&](const std::vector<UnitRun>& runs) -> Status {
        for (const UnitRun& run : runs) {
          survey->present.insert(ShardFromText(run.shard)->index);
          const std::size_t content = hash(ContentOf(run));
          if (survey->contents.try_emplace(hash(run.id), content).first->second != content) {
            return OtherContent(name, "run " + run.id);
          }
        }
        collected.runs += runs.size();
        TRUETRIAD_RETURN_IF_ERROR(NewRuns(name, runs, store));
        return {};
      }));
  const StatedShards& shards = source.header.shards;
  if (shards.count > 0) {
    if (survey->shards > 0 && survey->shards != shards.count) {
      return Error(ErrorCode::kConflictingArguments,
                   {ShownStore(name)},
                   "states the shard count " + std::to_string(shards.count) + ", but " +
                       survey->said_by + " states " + std::to_string(survey->shards) +
                       "; name only stores of the same fleet run");
    }
    survey->shards = shards.count;
    survey->said_by = ShownStore(name);
  }
  if (shards.only) survey->present.insert(*shards.only);
  if (!source.is_ended) {
    if (!takes_unfinished) {
      return Unfinished(JsonLinesPath(name).value_or(name), source.counts.runs);
    }
    collected.unfinished.push_back(ShownStore(name));
  }
  TRUETRIAD_RETURN_IF_ERROR(TakeDecisions(name, source.decisions, survey));
  for (Disposition& one : source.decisions.dispositions) {
    survey->dispositions[one.run].push_back(std::move(one));
  }
  std::ranges::move(source.decisions.checks, std::back_inserter(survey->checks));
  return TakePolicy(source.header.policy, name, collected.runs > before, survey);
}

/// Adds the runs of a source with their decisions in short transactions, so that a production line
/// that writes to the store waits only briefly.
Status AddRuns(const std::string& name, Store& store, Survey* survey) {
  const auto add = [&](const std::vector<UnitRun>& runs) {
    std::size_t added = 0;
    const Status status = store.Together([&]() -> Status {
      TRUETRIAD_ASSIGN_OR_RETURN(added, NewRuns(name, runs, store));
      TRUETRIAD_RETURN_IF_ERROR(store.AddAll(runs));  // Existing runs stay unchanged.
      Decisions decisions;
      for (const UnitRun& run : runs) {
        std::ranges::copy(survey->dispositions[run.id], std::back_inserter(decisions.dispositions));
      }
      return store.AddDecisions(decisions);
    });
    survey->collected.added += status ? added : 0;
    return status;
  };
  const Result<LinesRead> source = ReadInParts(name, add);
  if (source) return {};
  return Error(source.error().code,
               source.error().message +
                   "; the runs added so far are kept, and collecting again adds the others");
}

/// Those of the shards 0 to `count` - 1 that are not in `present` and have no runs in the store.
Result<std::vector<int>> MissingShards(Store& store, int count, std::set<int> present) {
  TRUETRIAD_ASSIGN_OR_RETURN(const std::vector<std::string> shards,
                             store.QueryTexts("SELECT DISTINCT shard FROM run"));
  for (const std::string& text : shards) {
    if (const auto shard = ShardFromText(text)) present.insert(shard->index);
  }
  std::vector<int> missing;
  for (int i = 0; i < count; ++i) {
    if (!present.contains(i)) missing.push_back(i);
  }
  return missing;
}

/// Quantities for which current runs have different limits.
constexpr std::string_view kOtherLimits =
    "SELECT DISTINCT name FROM (SELECT DISTINCT name, component, lower, upper FROM judgement "
    "JOIN standing ON standing.run = judgement.run) AS one GROUP BY name, component "
    "HAVING count(*) > 1 ORDER BY name";

/// Units whose last decision does not hold for their current run.
constexpr std::string_view kDecisionsLifted =
    "SELECT standing.serial, made.verdict, made.who, made.why, standing.run "
    "FROM disposition AS made JOIN run ON run.run = made.run "
    "JOIN standing ON standing.serial = run.serial "
    "WHERE standing.disposed_by IS NULL AND made.disposition = (SELECT max(one.disposition) "
    "FROM disposition AS one JOIN run AS its ON its.run = one.run "
    "WHERE one.wrong_serial IS DISTINCT FROM 1 AND its.serial = standing.serial) ORDER BY "
    "standing.serial";

/// Units that are good by their current run or a decision, although their latest run is not good.
constexpr std::string_view kOverruled =
    "SELECT standing.serial FROM latest CROSS JOIN standing WHERE standing.serial = latest.serial "
    "AND latest.verdict IN ('FAIL', 'NO_RESULT') AND latest.run <> standing.run "
    "AND standing.final_verdict IN ('PASS', 'NO_LIMITS') ORDER BY standing.serial";

/// For each current run of a deliverable unit: the first earlier run of each other unit that has
/// all readings of the current run. Runs with a wrong serial number are left out. The shards and
/// stations have compared only their own units.
constexpr std::string_view kCopies =
    "SELECT own.serial, own.run, own.log, min(its.run), its.serial "
    "FROM (SELECT digest FROM reading GROUP BY digest HAVING count(*) > 1) AS seen "
    "JOIN reading AS known ON known.digest = seen.digest "
    "JOIN reading AS first ON first.digest = seen.digest AND first.run < known.run "
    "JOIN run AS one ON one.run = known.run "
    "JOIN run AS its ON its.run = first.run AND its.serial <> one.serial "
    "JOIN standing AS own ON own.serial = one.serial AND own.run = known.run "
    "WHERE own.final_verdict IN ('PASS', 'NO_LIMITS') AND its.verdict <> 'NO_RESULT' "
    "AND its.run NOT IN (SELECT run FROM given_up) "
    "AND NOT EXISTS (SELECT 1 FROM reading AS made_from WHERE made_from.run = own.run "
    "AND NOT EXISTS (SELECT 1 FROM reading AS same WHERE same.run = its.run "
    "AND same.digest = made_from.digest)) "
    "GROUP BY own.serial, own.run, own.log, its.serial ORDER BY own.run, min(its.run)";

/// Makes the files beside the store agree with it and collects notes for the user.
Status AgreeAll(const std::string& target, Collected* collected) {
  const auto text = [](const auto& row, std::size_t column) { return row[column].value_or(""); };
  TRUETRIAD_ASSIGN_OR_RETURN(const std::unique_ptr<Store> store, OpenStore(target));
  TRUETRIAD_ASSIGN_OR_RETURN(const Table copies, store->Query(std::string(kCopies)));
  for (const auto& row : copies.rows) {
    collected->copies.push_back("unit `" + text(row, 0) + "` (run " + text(row, 1) + ", " +
                                text(row, 2) + ") has the same readings as run " + text(row, 3) +
                                ", which belongs to unit `" + text(row, 4) + "`");
  }
  TRUETRIAD_ASSIGN_OR_RETURN(const std::vector<std::string> limits,
                             store->QueryTexts(std::string(kOtherLimits)));
  std::string names;
  for (const std::string& name : limits) names += (names.empty() ? "" : ", ") + name;
  if (!names.empty()) {
    collected->notes.push_back("the units were judged by different limits of " + names);
  }
  TRUETRIAD_ASSIGN_OR_RETURN(const Table lifted, store->Query(std::string(kDecisionsLifted)));
  for (const auto& row : lifted.rows) {
    collected->notes.push_back(
        text(row, 0) + ": the decision of " + text(row, 2) + " (" + text(row, 1) + ": " +
        text(row, 3) + ") does not hold for the current run " + text(row, 4) +
        ", which is of another recording, misses other limits or has no result");
  }
  TRUETRIAD_ASSIGN_OR_RETURN(const std::vector<std::string> overruled,
                             store->QueryTexts(std::string(kOverruled)));
  for (const std::string& serial : overruled) {
    TRUETRIAD_ASSIGN_OR_RETURN(const auto unit, store->StandingOf(serial));
    if (unit) collected->notes.push_back(serial + ": " + ReasonOf(*unit));
  }
  TRUETRIAD_ASSIGN_OR_RETURN(const std::vector<std::string> units_held_back,
                             store->UnitsHeldBack());
  for (const std::string& serial : units_held_back) {
    TRUETRIAD_ASSIGN_OR_RETURN(const Agreement agreed,
                               AgreeFolders(*store, serial, UnitsBeside(target)));
    for (std::string& note : agreed.Notes(serial)) collected->notes.push_back(std::move(note));
    if (agreed.IsUnsafe()) collected->unsafe.push_back(serial);
  }
  return {};
}

/// Examines all sources, then adds them to the store at `url`, which messages call `target`. If a
/// source cannot be added, nothing is added.
Result<Collected> AddAll(const std::vector<std::string>& sources,
                         const std::string& target,
                         const std::string& url,
                         bool takes_unfinished) {
  TRUETRIAD_ASSIGN_OR_RETURN(const std::unique_ptr<Store> store, OpenStore(url));
  Survey survey;
  Collected& collected = survey.collected;
  TRUETRIAD_ASSIGN_OR_RETURN(const Table runs, store->Query("SELECT 1 FROM run LIMIT 1"));
  TRUETRIAD_ASSIGN_OR_RETURN(const StoreHeader header, store->Header());
  TRUETRIAD_ASSIGN_OR_RETURN(const Decisions decisions, store->ReadDecisions());
  TRUETRIAD_RETURN_IF_ERROR(TakeDecisions(target, decisions, &survey));
  for (const std::string& source : sources) {
    TRUETRIAD_RETURN_IF_ERROR(Look(source, takes_unfinished, *store, &survey));
  }
  TRUETRIAD_RETURN_IF_ERROR(TakePolicy(header.policy, target, !runs.rows.empty(), &survey));
  if (survey.shards > 0) TRUETRIAD_RETURN_IF_ERROR(store->StateShard({0, survey.shards}));
  if (survey.states_policy) TRUETRIAD_RETURN_IF_ERROR(store->StateRetestPolicy(*survey.policy));
  for (const std::string& source : sources) {
    TRUETRIAD_RETURN_IF_ERROR(AddRuns(source, *store, &survey));
  }
  Decisions all{{}, std::move(survey.checks)};
  for (const auto& [run, of_run] : survey.dispositions) {
    std::ranges::copy(of_run, std::back_inserter(all.dispositions));
  }
  TRUETRIAD_RETURN_IF_ERROR(store->AddDecisions(all));
  collected.shards = std::max(survey.shards, 1);
  TRUETRIAD_ASSIGN_OR_RETURN(collected.missing,
                             MissingShards(*store, collected.shards, survey.present));
  return std::move(collected);
}

/// AddAll for a store in a new file. The file gets its name when it is complete. Error: another
/// file has this name by then.
Result<Collected> AddAllToNew(const std::vector<std::string>& sources,
                              const std::string& target,
                              const fs::path& file,
                              bool takes_unfinished) {
  const fs::path folder = TemporaryNameBeside(file.string()), whole = folder / file.filename();
  Result<Collected> collected =
      AddAll(sources, target, "sqlite:" + whole.string(), takes_unfinished);
  if (collected && renameat2(AT_FDCWD, whole.c_str(), AT_FDCWD, file.c_str(), RENAME_NOREPLACE) &&
      link(whole.c_str(), file.c_str()) != 0) {  // Some file systems support only one call.
    collected = Error(ErrorCode::kCannotWrite,
                      {file.string()},
                      std::string("cannot be created: ") + std::strerror(errno));
  }
  std::error_code ignored;
  fs::remove_all(folder, ignored);
  return collected;
}

}  // namespace

Result<Collected> Collect(const std::vector<std::string>& sources,
                          const std::string& target,
                          bool takes_unfinished) {
  for (const std::string& source : sources) TRUETRIAD_RETURN_IF_ERROR(CheckStoreUrl(source));
  TRUETRIAD_RETURN_IF_ERROR(CheckStoreUrl(target));
  TRUETRIAD_RETURN_IF_ERROR(CheckTarget(sources, target));
  const std::optional<std::string> file = FileOfStore(target);
  std::error_code failure;
  TRUETRIAD_ASSIGN_OR_RETURN(Collected collected,
                             file && !fs::exists(*file, failure)
                                 ? AddAllToNew(sources, target, *file, takes_unfinished)
                                 : AddAll(sources, target, target, takes_unfinished));
  TRUETRIAD_RETURN_IF_ERROR(AgreeAll(target, &collected));
  return collected;
}

}  // namespace truetriad::fleet
