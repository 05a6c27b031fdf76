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

/// The part of a fleet's units that one of several fleet runs calibrates.
struct Shard {
  int index = 0;  ///< From 0.
  int count = 1;  ///< At most kMostShards.
};
inline constexpr int kMostShards = 1'000'000;  // Chosen: above any real count; more is rejected.

/// Reads "2/8", index and number of shards; empty: the only shard. Unset: the text is invalid.
std::optional<Shard> ShardFromText(std::string_view text);
/// The inverse of ShardFromText.
std::string ShardText(const Shard& shard);

/// A field of a row as text; unset: NULL.
using Cell = std::optional<std::string>;
/// The number in a field; `otherwise` if the field is NULL or not a number.
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
  /// An SQL condition on columns of `run`, `standing` and tags (FromWhere); empty: all runs.
  std::string where = {};
  bool with_standing = false;  ///< Fills UnitRun::standing.
  bool is_whole = true;        ///< Fills inputs, readings, findings and covariance.
};

/// A person's decision about a unit, whatever the verdict of its run. It holds until a later
/// decision. A concession (PASS) also ends when the current run is of another recording, has no
/// result or misses other limits; a refusal (FAIL) also ends when the current recording was
/// calibrated and measured after it.
struct Disposition {
  std::string id;       ///< As NewRunId; a unit's last decision has the greatest id.
  std::string serial;   ///< Of the unit.
  std::string created;  ///< ISO 8601, UTC.
  std::string who, why;
  Verdict verdict = Verdict::kPass;  ///< One of kVerdictsOfPeople.
  std::string run = {};              ///< The current run, or another one of the unit.
  /// True: the serial number of `run` was wrong, so its recording belongs to another unit. False:
  /// the number was right after all. Unset: an earlier statement stays valid.
  std::optional<bool> wrong_serial = {};

  bool GivesUp() const { return wrong_serial.value_or(false); }
};
/// The verdicts of a decision: the unit may be delivered, or it may not.
inline constexpr std::array kVerdictsOfPeople = {Verdict::kPass, Verdict::kFail};

/// Error (usage): `who` or `why` is blank, has several lines, is not UTF-8 or is longer than 200
/// (`who`) or 2000 (`why`) bytes; the verdict is not in kVerdictsOfPeople; or the serial number was
/// wrong but the verdict is not FAIL.
Status CheckDisposition(const Disposition& disposition);

/// A repeated measurement of a station's golden unit.
struct StationCheck {
  std::string id;  ///< NewRunId.
  std::string station;
  std::string serial;   ///< Of the golden unit.
  std::string created;  ///< ISO 8601, UTC.
  /// Time of measurement (ISO 8601, UTC), by the recording's clock or the time of its file. The age
  /// of a check counts from this time.
  std::string recorded;
  bool agrees = false;
  /// The p-value of all differences together; the largest difference in sigma; NaN: unknown.
  double p = std::numeric_limits<double>::quiet_NaN();
  double largest = std::numeric_limits<double>::quiet_NaN();
  std::string parameter;  ///< The parameter with the largest difference.
  std::string log;
  std::string recording = {};      ///< RecordingOf its readings; empty: unknown.
  std::string repeatability = {};  ///< As the user stated it for the golden unit.
};

/// The state of a station according to a golden unit.
enum class GoldenState {
  kGood,
  kDisagrees,  ///< The last recording disagreed, however long ago; a later one must agree.
  kOverdue,    ///< The last recording is too old, or its age is unknown.
  kToCome,     ///< The last recording is dated in the future: a clock is or was wrong.
};
/// The state at `now_s` (seconds since 1970) by the last valid check of a golden unit. If its
/// recording is older than `due_s` seconds, it is overdue.
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
  /// Applies to the runs that `most` admits. kBest takes the run with the best verdict, by the
  /// order of the enumeration Verdict; of several such runs, the last one.
  RetestCounts counts = RetestCounts::kLast;
  /// How many recordings after the first may decide the verdict, 0 to a million; unset: all.
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

/// A store of runs: a database, or a file of runs (json_lines.h), which `fleet collect` adds to a
/// database. A run is added once and never changed. All functions: error (bad input) if the store
/// cannot be reached or written. For a file of runs, Query, ForEachRun, decisions and checks of
/// stations return an error (bad input), and there are no standings, since the file has only some
/// of the units' runs.
class Store {
 public:
  /// A store in `database`. Error (bad input): its tables have another version.
  static Result<std::unique_ptr<Store>> Open(std::unique_ptr<Database> database);
  /// A file of runs for writing. Errors as RunLines::Open.
  static Result<std::unique_ptr<Store>> OpenLines(const std::string& path);
  ~Store();

  /// Adds a run, which is on disk on return. A run already in a database is not added again.
  Status Add(const UnitRun& run) { return AddAll({&run, 1}); }
  /// Adds several runs, which is faster than one after another.
  Status AddAll(std::span<const UnitRun> runs);
  // Unless stated otherwise, the functions below fill only those fields of UnitRun that are columns
  // of the table `run`.

  /// Whether a run of this name exists.
  Result<bool> Has(const std::string& run);
  /// The greatest name of a run of the same unit or log, or of a decision about the unit; empty if
  /// there is none.
  Result<std::string> LatestRun(const UnitRun& run);
  /// The first run of another unit that has all readings of this run; unset: there is none. Runs
  /// without a result, such as refused copies, and runs with a wrong serial number are ignored.
  Result<std::optional<UnitRun>> RunOfSameReadings(const UnitRun& run);
  /// The runs for which a person stated that their serial number was wrong.
  Result<std::vector<UnitRun>> RunsGivenUp();
  /// Calls `take` with the last run of each log and its tags.
  Status ForEachLastRun(const std::function<void(const UnitRun&)>& take);
  /// States the shard to which further runs belong; the first call fixes the store's number of
  /// shards. Error (usage): the store has another number of shards, or is a file of runs of another
  /// shard.
  Status StateShard(const Shard& shard);
  /// Sets the rule for a unit's current run; the first call fixes it. Error (usage): the store has
  /// another policy, the policy is invalid, or a file of runs was begun without a policy.
  Status StateRetestPolicy(const RetestPolicy& policy);
  /// The unit's last run with FAIL; empty: there is none, or a good run other than `run` is later.
  Result<std::string> FailedSinceGood(const UnitRun& run);
  Result<StoreHeader> Header();
  /// By name, the runs of one unit for which a person stated that their serial number was wrong.
  /// The standing of each is made from that decision.
  Result<std::map<std::string, Standing>> GivenUpOf(const std::string& serial);
  /// Unset: there is no such unit, or the store is a file of runs.
  Result<std::optional<Standing>> StandingOf(const std::string& serial);
  /// Units whose files AgreeFolders may have to change: a person decided about them or gave up one
  /// of their runs, or they are not good although another of their runs has a result.
  Result<std::vector<std::string>> UnitsHeldBack();
  /// The last run of each log of the units whose final verdict is not good.
  Result<std::vector<UnitRun>> LogsOfUnitsNotGood();
  /// A unit whose serial number differs only in upper or lower case; empty if there is none.
  Result<std::string> UnitOfOtherLetters(const std::string& serial);
  /// The unit's runs that have files, in the order of their names.
  Result<std::vector<UnitRun>> FoldersOfUnit(const std::string& serial);
  /// Adds a decision and returns it as added. If it names no run, it is about the unit's current
  /// run, or, if it states `wrong_serial`, about the unit's only recording. It gets a name later
  /// than all runs of the unit and all decisions. An error changes nothing. Error (usage): there is
  /// no such unit or run; `wrong_serial` could be about several recordings; the unit would be good
  /// by a run that has a wrong serial number, is not current or has no result; the run's readings
  /// belong to another unit.
  Result<Disposition> Dispose(const Disposition& disposition);
  /// Adds a check. If the clock has gone back, the check gets a later name. If another check
  /// decides the golden unit's state at the station, returns that check: only the first check of a
  /// recording counts, and the last recording decides.
  Result<std::optional<StationCheck>> AddStationCheck(const StationCheck& check);
  /// The valid checks by time of measurement: all, or the last of each golden unit at one station.
  Result<std::vector<StationCheck>> StationChecks();
  Result<std::vector<StationCheck>> LastStationChecks(const std::string& station);
  Result<Decisions> ReadDecisions();
  /// Adds decisions and checks of another store. Their runs must be here. Existing entries stay.
  Status AddDecisions(const Decisions& decisions);
  /// Marks a file of runs as complete until more is added; does nothing for a database.
  Status MarkEnd();
  /// Runs a query. Error (usage): it is not valid, or would change the store.
  Result<Table> Query(const std::string& sql);
  /// The first field of each row of a query.
  Result<std::vector<std::string>> QueryTexts(const std::string& sql);
  /// Error (usage): the database lets the connected user do more by a query than read the store, so
  /// text that a person typed must not be part of a query.
  Status AllowTypedText();
  /// Sets the callback for notes on delays, such as a lost connection; empty: none.
  void TellNotes(std::function<void(const std::string&)> on_note);
  /// Calls `take` with the selected runs one after another, by serial number and then by name;
  /// memory does not grow with their number. Further errors: those of `take`; (usage) the condition
  /// is invalid.
  Status ForEachRun(const RunSelection& which, const std::function<Status(UnitRun)>& take);
  /// Those of the named runs that exist, with all their fields.
  Result<std::vector<UnitRun>> ReadRuns(const std::vector<std::string>& runs);
  /// Runs `work`, which uses this store, in one transaction; an error or exception undoes all of
  /// it. If the connection is lost, it is reopened and `work` is called again.
  Status Together(const std::function<Status()>& work);

 private:
  explicit Store(std::unique_ptr<Database> database);
  /// Adds the facts `stated`, or none if the first of them exists, and returns all facts.
  Result<StoreFacts> StateFacts(
      const std::vector<std::pair<std::string_view, std::string>>& stated);
  /// Inserts the rows of a run unless it exists. Must be called in a transaction.
  Status InsertRun(const UnitRun& run);
  /// Error (usage): the decision relies on a run whose readings belong to another unit or whose
  /// serial number was wrong.
  Status CheckReadings(const Disposition& disposition);
  /// Error (usage): the run is not the unit's, or a run other than the current one, `counting`,
  /// would be conceded.
  Status CheckIsOfUnit(const Disposition& disposition, const std::string& counting);
  /// The last run of the unit's only recording with a result. `is_given_up`: considers only
  /// recordings with a wrong serial number, otherwise only the others. Empty: there is none. Error
  /// (usage): there are several.
  Result<std::string> OnlyRecording(const std::string& serial, bool is_given_up);
  /// Inserts rows and returns the number of new ones. Must be called in a transaction.
  Result<std::int64_t> Insert(const TableRows& rows);
  /// Makes `id` greater than `other` and all names in a table. False: the table has `id` already.
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
  /// The selected runs for which `condition`, which uses columns of `run` only, is true.
  Result<std::vector<UnitRun>> RunsOfPage(const RunSelection& which, const std::string& condition);
  /// Fills the standings of the current runs among `runs`.
  Status TakeStandings(const std::string& condition, std::vector<UnitRun>* runs);

  std::unique_ptr<Database> database_;
  bool is_in_transaction_ = false;
  std::unique_ptr<RunLines> lines_;  ///< A file of runs; database_ then has what is queried.
};

/// `url` without its password, for messages and files.
std::string ShownStore(const std::string& url);

/// A name of the store that is valid in any working directory: for a file its absolute path.
std::string NameOfStore(const std::string& url);

/// Opens or creates a store: PATH, sqlite:PATH, NAME.jsonl, jsonl:PATH, postgresql://…,
/// postgres://…, or postgresql: with options of libpq, name=value …. Error (bad input): it cannot
/// be reached, is not a store of this program, has another schema version, is on a file system
/// where SQLite cannot lock, or is not a regular file (a pipe, a device). Error (usage): the URL is
/// of another kind or has no file name, or libpq is not installed.
Result<std::unique_ptr<Store>> OpenStore(const std::string& url);

/// Opens an existing store for reading only. While an InputGuard exists, this program does not
/// overwrite the file of the store either.
Result<std::unique_ptr<Store>> OpenStoreToRead(const std::string& url);

/// Error (bad input): the path is not a regular file (reading a pipe would never end); the file is
/// to be read and does not exist; the file is to be written and its folder cannot be created.
Status CheckStoreFile(const std::string& path, Access access);

/// The file of a store; unset: a server keeps it.
std::optional<std::string> FileOfStore(const std::string& url);

/// The options for libpq in a store's URL: postgresql://…, postgres://…, or the name=value of
/// postgresql:name=value …. Unset: not a URL of PostgreSQL.
std::optional<std::string> PostgresOptions(const std::string& url);

/// Error (usage): `url` names no file, or one with a special meaning for SQLite, or looks like a
/// misspelled server URL. The message does not show a server URL, since it may contain a password.
Status CheckStoreUrl(const std::string& url);

/// A URL of PostgreSQL for messages: only server, port, database and user. If these are ambiguous,
/// since a password has a bare @, / or ? or a value is quoted, none of them is shown.
std::string ShownPostgres(const std::string& url);

// Data from other stores and files is checked once, on input. All errors are bad input and name the
// wrong value.

/// Whether `name` has the form of NewRunId with a valid time.
bool IsRunId(std::string_view name);

/// Error: the run's name or a time is invalid, or its name is after 2200; the run is good but
/// misses a limit, or is FAIL but misses none; the serial number is empty, longer than 1000 bytes
/// or has a NUL; a path has a NUL; a number is not finite, or negative where it must not be; a
/// parameter occurs twice, or the covariance has another size.
Status CheckRun(const UnitRun& run);

/// Error: the name, time or run of the decision is invalid, or CheckDisposition has an error.
Status CheckStored(const Disposition& disposition);
/// Error: the name or a time of the check is invalid, or its station is empty.
Status CheckStored(const StationCheck& check);

}  // namespace truetriad::fleet
