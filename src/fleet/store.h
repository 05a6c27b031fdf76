// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <charconv>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "fleet/unit_run.h"
#include "truetriad/base/result.h"

namespace truetriad::fleet {

/// The part of a fleet's units that one of several runs calibrates.
struct Shard {
  int index = 0;  ///< From 0.
  int count = 1;  ///< At most kMostShards.
};
inline constexpr int kMostShards = 1'000'000;  // Chosen: above any real count; more is rejected.

/// "2/8"; empty: the only shard. Unset: not such a text, or the index is not below the count.
std::optional<Shard> ShardFromText(std::string_view text);
/// The inverse of ShardFromText.
std::string ShardText(const Shard& shard);

/// A field of a row as text; unset: NULL.
using Cell = std::optional<std::string>;
/// The number in a field; `otherwise` for NULL and for other texts.
template <typename Number>
Number NumberOf(const Cell& cell, Number otherwise) {
  if (cell) std::from_chars(cell->data(), cell->data() + cell->size(), otherwise);
  return otherwise;
}

/// A value of a row: NULL, text, numbers or bytes. Only std::string owns its text.
using Value = std::variant<std::monostate,
                           std::string_view,
                           std::string,
                           std::int64_t,
                           double,
                           const std::vector<double>*>;

/// Rows to insert into one table unless they exist.
struct TableRows {
  std::string_view table;
  std::vector<std::vector<Value>> rows;
};

/// Statements about a store as a whole, by name.
using StoreFacts = std::map<std::string, std::string, std::less<>>;

/// The rows of a query.
struct Table {
  std::vector<std::string> columns;
  std::vector<bool> are_numbers;  ///< By column: every value is a number.
  std::vector<bool> are_bytes;    ///< By column: every value is bytes as hexadecimal digits.
  std::vector<std::vector<Cell>> rows;
};

enum class Access { kRead, kWrite };

/// The number of shards of a store, and which of them its runs belong to.
struct StatedShards {
  int count = 0;            ///< 0: not stated.
  std::optional<int> only;  ///< All runs belong to this shard.
};

/// A selection of runs.
struct RunSelection {
  bool only_standing = false;  ///< Only the current run of each unit.
  /// A condition in SQL on `run` or `standing` and the tags by their names; empty: all runs.
  std::string where = {};
  bool with_standing = false;  ///< Fills UnitRun::standing.
  bool is_whole = true;        ///< Fills inputs, findings and covariance.
};

/// A person's decision about a unit, whatever the verdict of its run. It holds until a later
/// decision, or until a later run of another recording counts; after a refusal, that recording must
/// have been measured later.
struct Disposition {
  std::string id;       ///< NewRunId; a unit's greatest is its last decision.
  std::string serial;   ///< Of the unit.
  std::string created;  ///< ISO 8601, UTC.
  std::string who, why;
  Verdict verdict = Verdict::kPass;  ///< One of kVerdictsOfPeople.
  std::string run = {};              ///< The current run, or another one of the unit.
  /// Whether the recording of the run belongs to another unit because its serial number was wrong;
  /// false: it is the unit's own after all; unset: an earlier statement stays valid.
  std::optional<bool> wrong_serial = {};

  bool GivesUp() const { return wrong_serial.value_or(false); }
};
/// The verdicts of a decision: the unit may be delivered, or it may not.
inline constexpr std::array kVerdictsOfPeople = {Verdict::kPass, Verdict::kFail};

/// Error (usage): who or why is blank, longer than 200 or 2000 bytes, of several lines or not
/// UTF-8, the verdict is not in kVerdictsOfPeople, or the serial number was wrong but the verdict
/// is not FAIL.
Status CheckDisposition(const Disposition& disposition);

/// A repeated measurement of a station's golden unit.
struct StationCheck {
  std::string id;  ///< NewRunId.
  std::string station;
  std::string serial;   ///< Of the golden unit.
  std::string created;  ///< ISO 8601, UTC.
  /// Time of measurement, likewise, by the recording's clock or the file's time. The age of a check
  /// counts from it.
  std::string recorded;
  bool agrees = false;
  /// The p of all differences together, and the largest difference in sigma; NaN: unknown.
  double p = std::numeric_limits<double>::quiet_NaN();
  double largest = std::numeric_limits<double>::quiet_NaN();
  std::string parameter;  ///< The one with the largest difference.
  std::string log;
  std::string recording = {};      ///< RecordingOf its readings; empty: unknown.
  std::string repeatability = {};  ///< Allowed for the golden unit, as stated.
};

/// The state of a station according to a golden unit.
enum class GoldenState {
  kGood,
  kDisagrees,  ///< Its last recording disagreed, however long ago; a later one must agree.
  kOverdue,    ///< Its last recording is too old, or of unknown age.
  kToCome,     ///< Its last recording is dated in the future: a clock is or was wrong.
};
/// The state by the last valid check of a golden unit at `now_s` seconds after the beginning of
/// 1970; a recording older than `due_s` is overdue.
GoldenState GoldenStateOf(const StationCheck& last, double now_s, double due_s);

/// The decisions and checks of a store.
struct Decisions {
  std::vector<Disposition> dispositions;  ///< In the order of their ids.
  std::vector<StationCheck> checks;       ///< Likewise.
};

/// The identity of a recording, whatever its files and their format: the sorted digests of its
/// sensors' readings.
std::string RecordingOf(const std::vector<SensorReadings>& readings);

/// The rule by which one of a unit's runs is its current run.
enum class RetestCounts { kLast, kFirst, kBest };
std::string_view RetestCountsName(RetestCounts counts);  ///< "last", "first", "best".
std::optional<RetestCounts> RetestCountsFromName(std::string_view name);

struct RetestPolicy {
  /// Applies to the runs that `most` admits; kBest takes the last run with the best verdict, in the
  /// order of the enumeration Verdict.
  RetestCounts counts = RetestCounts::kLast;
  /// The number of recordings after the first whose runs may count, 0 to a million; unset: all.
  std::optional<std::int64_t> most;

  bool operator==(const RetestPolicy&) const = default;
};

/// The policy in words: "best, 2 more".
std::string PolicyText(const RetestPolicy& policy);

/// A store's statements about itself.
struct StoreHeader {
  StatedShards shards;
  std::string store = {};                   ///< A unique name, created with the store.
  std::optional<RetestPolicy> policy = {};  ///< Unset: not stated.
};

class Database;
class RunLines;

/// A store of runs: a database, or a file of runs (json_lines.h) for transport into one. A run is
/// added once and never changed. All functions: error (bad input) if the store cannot be reached or
/// written. A file of runs cannot be queried (Query, ForEachRun, checks of stations: error, bad
/// input) and knows no standings, since it has only some of the units' runs; `fleet collect` makes
/// a database of it.
class Store {
 public:
  /// A store in `database`. Error (bad input): its tables have another version.
  static Result<std::unique_ptr<Store>> Open(std::unique_ptr<Database> database);
  /// A file of runs for writing. Errors as RunLines::Open.
  static Result<std::unique_ptr<Store>> OpenLines(const std::string& path);
  ~Store();

  /// The run is on disk when it returns. A run already in a database is not added again.
  Status Add(const UnitRun& run) { return AddAll({&run, 1}); }
  /// The same for several runs, which is faster.
  Status AddAll(std::span<const UnitRun> runs);
  // Functions that return UnitRun below fill the columns of `run`, but not its lists.

  /// Whether a run of this name exists.
  Result<bool> Has(const std::string& run);
  /// The greatest name of a run of the same unit or log, or of a decision about the unit; empty if
  /// there is none.
  Result<std::string> LatestRun(const UnitRun& run);
  /// A run of another unit that has all readings of this one and was not refused as a copy, unless
  /// a person stated that its serial number was wrong; unset: there is none.
  Result<std::optional<UnitRun>> RunOfSameReadings(const UnitRun& run);
  /// The runs for which a person stated that their serial number was wrong.
  Result<std::vector<UnitRun>> RunsGivenUp();
  /// Calls `take` with the last run of each log and its tags.
  Status ForEachLastRun(const std::function<void(const UnitRun&)>& take);
  /// Sets the shard of further runs; the first call fixes the number of shards. Error (usage):
  /// another number is fixed, or the file of runs belongs to another shard.
  Status StateShard(const Shard& shard);
  /// Sets the rule for a unit's current run; the first call fixes it. Error (usage): another policy
  /// is fixed, or the file of runs began without one.
  Status StateRetestPolicy(const RetestPolicy& policy);
  /// The last run of the run's unit that missed limits after all its good runs; empty if there is
  /// none.
  Result<std::string> FailedSinceGood(const UnitRun& run);
  Result<StoreHeader> Header();
  /// The runs of one unit for which a person stated that their serial number was wrong, by name,
  /// each with that decision in the form of a standing.
  Result<std::map<std::string, Standing>> GivenUpOf(const std::string& serial);
  /// Unset: there is no such unit.
  Result<std::optional<Standing>> StandingOf(const std::string& serial);
  /// Units whose files may have to change (AgreeFolders): a person decided about them, or they are
  /// not good although another run has a result.
  Result<std::vector<std::string>> UnitsHeldBack();
  /// The last run of each log of the units that are not good by their current run.
  Result<std::vector<UnitRun>> LogsOfUnitsNotGood();
  /// A unit whose serial number differs only in upper or lower case; empty if there is none.
  Result<std::string> UnitOfOtherLetters(const std::string& serial);
  /// The unit's runs that have files, in the order of their names.
  Result<std::vector<UnitRun>> FoldersOfUnit(const std::string& serial);
  /// Adds a disposition of the unit's run that it names, else of the current run, and returns it as
  /// added: with that run, and with a name later than all of its runs and decisions. An error
  /// changes nothing. Error (usage): there is no such unit or run, it is unclear for which
  /// recording the serial number was wrong, the unit would be good by a run that was given up or
  /// does not count, or its readings count for another unit.
  Result<Disposition> Dispose(const Disposition& disposition);
  /// Adds a check, with a later name if the clock has gone back. Returns the check that decides the
  /// golden unit's state at the station, if it is another one: a recording counts by its first
  /// check at a station, and the last recording decides.
  Result<std::optional<StationCheck>> AddStationCheck(const StationCheck& check);
  /// The valid checks in order: of all stations, or of one station the last for each golden unit.
  Result<std::vector<StationCheck>> StationChecks();
  Result<std::vector<StationCheck>> LastStationChecks(const std::string& station);
  Result<Decisions> ReadDecisions();
  /// Adds decisions and checks of another store, whose runs are all here; existing ones stay.
  Status AddDecisions(const Decisions& decisions);
  /// Marks a file of runs as complete until more is added.
  Status MarkEnd();
  /// Runs a query. Error (usage): the statement does not only read.
  Result<Table> Query(const std::string& sql);
  /// The first field of each row of a query.
  Result<std::vector<std::string>> QueryTexts(const std::string& sql);
  /// Error (usage): text that a user typed must not be part of a query, since the connected user
  /// could do more by a query than read the store.
  Status AllowTypedText();
  /// Sets the callback for notes on slow work; empty: none.
  void TellNotes(std::function<void(const std::string&)> on_note);
  /// Calls `take` with complete runs one after another, in the order of serials and then names;
  /// memory does not grow with their number. Errors also: those of `take`; (usage) an invalid
  /// condition.
  Status ForEachRun(const RunSelection& which, const std::function<Status(UnitRun)>& take);
  /// Those of `runs` that exist, complete.
  Result<std::vector<UnitRun>> ReadRuns(const std::vector<std::string>& runs);
  /// Does all of `work`, which uses this store, or nothing of it, also if it throws. It may be
  /// called several times, since a lost connection is reopened.
  Status Together(const std::function<Status()>& work);

 private:
  explicit Store(std::unique_ptr<Database> database);
  /// Adds the facts `stated`, or none if the first of them exists, and returns all facts.
  Result<StoreFacts> StateFacts(
      const std::vector<std::pair<std::string_view, std::string>>& stated);
  /// Inserts the rows of a run unless it exists. In a transaction.
  Status InsertRun(const UnitRun& run);
  /// Error (usage): the decision would return readings that count for another unit.
  Status CheckReadings(const Disposition& disposition);
  /// Error (usage): the run is not the unit's, or cannot be conceded while `counting` counts.
  Status CheckIsOfUnit(const Disposition& disposition, const std::string& counting);
  /// The run of the unit's only recording with a result that was given up (`is_given_up`) or was
  /// not; empty if there is none. Error (usage): there are several.
  Result<std::string> OnlyRecording(const std::string& serial, bool is_given_up);
  /// Inserts rows and returns the number of new ones. In a transaction.
  Result<std::int64_t> Insert(const TableRows& rows);
  /// Makes `id` greater than all names of a table and `other`; false: it exists already.
  Result<bool> MakeLast(const std::string& table, const std::string& other, std::string* id);
  /// Returns the rows of a query.
  Result<Table> Asked(std::string_view sql, const std::vector<Value>& values = {});
  /// Returns the first field of a query; empty if there is none.
  Result<std::string> Text(std::string_view sql, const std::vector<Value>& values = {});
  /// The runs for which `condition` is true.
  Result<std::vector<UnitRun>> RunsWhere(const std::string& condition,
                                         const std::vector<Value>& values = {});
  /// The rows of a query as structs.
  template <typename Thing>
  Result<std::vector<Thing>> Things(const std::string& sql, const std::vector<Value>& values = {});
  /// Runs `work` in the present transaction, or in a new one.
  Status Transact(Access access, const std::function<Status()>& work);
  /// The runs for which `condition`, on columns of `run` only, is true.
  Result<std::vector<UnitRun>> RunsOfPage(const RunSelection& which, const std::string& condition);
  /// Fills the standings of the current runs among `runs`.
  Status TakeStandings(const std::string& condition, std::vector<UnitRun>* runs);

  std::unique_ptr<Database> database_;
  bool is_in_transaction_ = false;
  std::unique_ptr<RunLines> lines_;  ///< The file of runs; database_ holds what is queried of it.
};

/// `url` without its password, for messages and files.
std::string ShownStore(const std::string& url);

/// The name of a store from any working directory: for a file its absolute path.
std::string NameOfStore(const std::string& url);

/// Opens or creates a store: PATH, sqlite:PATH, NAME.jsonl, jsonl:PATH, postgresql://…,
/// postgres://…, and name=value of libpq as postgresql:name=value …. Error (bad input): it cannot
/// be reached, is not a store of this program, has another schema version, is on a file system
/// where SQLite cannot lock, or is not a regular file (a pipe, a device). Error (usage): another
/// kind of URL, one without a file name, or a build without PostgreSQL.
Result<std::unique_ptr<Store>> OpenStore(const std::string& url);

/// Opens an existing store for reading only; while an InputGuard lives, its file cannot be replaced
/// either.
Result<std::unique_ptr<Store>> OpenStoreToRead(const std::string& url);

/// Error (bad input): the path is not a regular file, since a pipe would never end; for reading, it
/// does not exist; for writing, its folder cannot be created.
Status CheckStoreFile(const std::string& path, Access access);

/// The file of a store; unset: a server keeps it.
std::optional<std::string> FileOfStore(const std::string& url);

/// The options for libpq in a store's URL: postgresql://…, postgres://…, or the name=value of
/// postgresql:name=value …. Unset: not a URL of PostgreSQL.
std::optional<std::string> PostgresOptions(const std::string& url);

/// Error (usage): `url` names no file or one with a special meaning for SQLite, or looks like a
/// misspelled server URL; the message does not show it, since it may hold a password.
Status CheckStoreUrl(const std::string& url);

/// A URL of PostgreSQL for messages: only server, port, database and user. Where the parts are
/// ambiguous, as for a password with a bare @, / or ?, or for quoted values, none of them.
std::string ShownPostgres(const std::string& url);

// Data from other stores and files is checked once, on input. All errors are bad input and name the
// wrong value.

/// Whether `name` has the form of NewRunId with a valid time.
bool IsRunId(std::string_view name);

/// Error: its name or time is invalid, or its name is after 2200; it is good but misses a limit, or
/// outside its limits but misses none; the serial number is empty, longer than 1000 bytes or has a
/// NUL; a number is not finite, or negative where it cannot be; a parameter occurs twice, or the
/// covariance has another size.
Status CheckRun(const UnitRun& run);

/// Error: the name, time or run is invalid, or as CheckDisposition.
Status CheckStored(const Disposition& disposition);
/// Error: the name or time is invalid, or the station is empty.
Status CheckStored(const StationCheck& check);

}  // namespace truetriad::fleet
