// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "fleet/shard.h"
#include "fleet/unit_run.h"
#include "truetriad/base/result.h"

namespace truetriad::fleet {

/// The last run that was made of a log, by which another is known to be the same.
struct KnownRun {
  std::string log;
  std::int64_t log_bytes = 0, log_modified_ns = 0;
  std::string config_sha256, software_version;
  Verdict verdict = Verdict::kBadInput;
  std::string serial;
  Tags tags;
};

/// Rows of a question, as text; NULL is an unset value.
struct Table {
  std::vector<std::string> columns;
  std::vector<bool> are_numbers;  ///< By column: every value is one.
  std::vector<std::vector<std::optional<std::string>>> rows;
};

/// Of how many shards the runs of a store are part.
struct StatedShards {
  int count = 0;            ///< 0: nobody has said it.
  std::optional<int> only;  ///< All runs are of this one.
};

/// Which runs.
struct RunSelection {
  bool only_standing = false;  ///< Of each unit the run that counts.
  std::string where = {};      ///< A condition in SQL on `run` or `standing`; empty: any.
};

/// What somebody decided about a unit, whatever the verdict of its run.
struct Disposition {
  std::string id;       ///< NewRunId; of several of one run the greatest applies.
  std::string serial;   ///< Of the unit.
  std::string created;  ///< ISO 8601, UTC.
  std::string who, why;
  Verdict verdict = Verdict::kPass;  ///< One of kVerdictsOfPeople.
};
/// What somebody can decide; the others are of a machine.
inline constexpr std::array kVerdictsOfPeople = {
    Verdict::kPass, Verdict::kUsable, Verdict::kOutside, Verdict::kRefused};

/// Error (usage): who or why is blank, longer than 200 or 2000 characters or more than one line,
/// or the verdict is none of people.
Status CheckDisposition(const Disposition& disposition);

/// A station's golden unit, measured again.
struct StationCheck {
  std::string id;  ///< NewRunId.
  std::string station;
  std::string serial;   ///< Of the golden unit.
  std::string created;  ///< ISO 8601, UTC.
  bool agrees = false;
  /// Of all differences together, and the largest of them in sigma; NaN: not known.
  double p = std::numeric_limits<double>::quiet_NaN();
  double largest = std::numeric_limits<double>::quiet_NaN();
  std::string parameter;  ///< That with the largest difference.
  std::string log;
};

/// Which of a unit's runs counts.
enum class RetestCounts { kLast, kFirst, kBest };
std::string_view RetestCountsName(RetestCounts counts);  ///< "last", "first", "best".
std::optional<RetestCounts> RetestCountsFromName(std::string_view name);

struct RetestPolicy {
  /// Of those that may count; the best is the last of those with the best verdict: pass, usable,
  /// outside-limits, any other.
  RetestCounts counts = RetestCounts::kLast;
  /// How many runs after the first may count, 0 to a million; unset: all.
  std::optional<std::int64_t> most;

  bool operator==(const RetestPolicy&) const = default;
};

/// What a unit's runs amount to.
struct Standing {
  std::string run;  ///< That counts.
  Verdict first_verdict = Verdict::kBadInput;
  Verdict final_verdict = Verdict::kBadInput;  ///< Of that run, or of people.
  std::int64_t attempts = 0;
  std::optional<std::int64_t> most = {};  ///< RetestPolicy::most.
};

/// Where runs are kept. A run is added once and never changed. All functions: an error (bad input)
/// where the store cannot be reached or written.
class Store {
 public:
  virtual ~Store() = default;

  /// On the disk when it returns. A run that is there already is not added again.
  virtual Status Add(const UnitRun& run) = 0;
  /// The same of several, faster where a store can write them at once.
  virtual Status AddAll(std::span<const UnitRun> runs);
  /// Whether a run of this name is there.
  virtual Result<bool> Has(const std::string& run);
  /// Of each log the last run.
  virtual Result<std::vector<KnownRun>> LastRuns() = 0;
  /// Of which shard further runs are; the first who says how many there are, states it. Error
  /// (usage): another number was stated, or the store is of another shard.
  virtual Status StateShard(const Shard& shard) = 0;
  virtual Result<StatedShards> Shards();
  /// Which run of a unit counts; the first who says it, states it. Error (usage): another policy
  /// was stated.
  virtual Status StateRetestPolicy(const RetestPolicy& policy) = 0;
  /// Unset: there is no such unit, or this kind of store does not know.
  virtual Result<std::optional<Standing>> StandingOf(const std::string& /*serial*/) {
    return std::optional<Standing>();
  }
  /// Adds a disposition of the unit's run that counts now, and says which run that is. Nothing is
  /// changed: a later disposition, or a later run that counts, supersedes it. Error (usage):
  /// there is no such unit.
  virtual Result<std::string> Dispose(const Disposition& disposition) = 0;
  virtual Status AddStationCheck(const StationCheck& check) = 0;
  /// The last by name; unset: there is none of this station.
  virtual Result<std::optional<StationCheck>> LastStationCheck(const std::string& station) = 0;
  /// The dispositions and station checks of another store, of which all runs are here; those that
  /// are there already are not added again.
  virtual Status AddDecisions(Store& from) = 0;
  /// Answers a statement that only reads. Error (usage): it is none.
  virtual Result<Table> Query(const std::string& sql) = 0;
  /// `take`s whole runs, one after the other, in the order of their serials and then names;
  /// memory does not grow with their number. Errors also: those of `take`; (usage) a condition
  /// that is none.
  virtual Status ForEachRun(const RunSelection& which, const std::function<Status(UnitRun)>& take);
};

/// `url` for people and files: without password.
std::string ShownStore(const std::string& url);

/// What a store is called, from wherever it is seen: a file by its whole path.
std::string NameOfStore(const std::string& url);

/// Opens a store, or makes it: PATH, sqlite:PATH, NAME.jsonl, jsonl:PATH, postgresql://…,
/// postgres://…, and name=value of libpq as postgresql:name=value …. Error (bad input): it cannot
/// be reached, is none of this program's, of a newer version of it, or on a file system that SQLite
/// cannot lock. Error (usage): another kind of URL, or this build cannot speak to PostgreSQL.
Result<std::unique_ptr<Store>> OpenStore(const std::string& url);

/// The same of one that is there; nothing can be written to it, nor, while an InputGuard lives,
/// be put in its place.
Result<std::unique_ptr<Store>> OpenStoreToRead(const std::string& url);

/// The file of a store that is one; unset: it is kept by a server.
std::optional<std::string> FileOfStore(const std::string& url);

}  // namespace truetriad::fleet
