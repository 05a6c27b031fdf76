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

/// One part of several of a fleet's units, each calibrated by a run of its own.
struct Shard {
  int index = 0;  ///< From 0.
  int count = 1;  ///< At most kMostShards.
};
inline constexpr int kMostShards = 1'000'000;

/// "2/8"; empty: the only one. Unset: it is no such text, or the index is not below the count.
std::optional<Shard> ShardFromText(std::string_view text);
/// The same the other way.
std::string ShardText(const Shard& shard);

/// A field of a row, as text; unset: NULL.
using Cell = std::optional<std::string>;
/// The number of a field; `otherwise` of NULL, or of what is none.
template <typename Number>
Number NumberOf(const Cell& cell, Number otherwise) {
  if (cell) std::from_chars(cell->data(), cell->data() + cell->size(), otherwise);
  return otherwise;
}

/// A value of a row: NULL, text, numbers, or bytes. Only std::string owns what it says.
using Value = std::variant<std::monostate,
                           std::string_view,
                           std::string,
                           std::int64_t,
                           double,
                           const std::vector<double>*>;

/// Rows to be inserted into one table, unless they are there.
struct TableRows {
  std::string_view table;
  std::vector<std::vector<Value>> rows;
};

/// What is stated of a store as a whole, by name.
using StoreFacts = std::map<std::string, std::string, std::less<>>;

/// Rows of a question.
struct Table {
  std::vector<std::string> columns;
  std::vector<bool> are_numbers;  ///< By column: every value is one.
  std::vector<bool> are_bytes;    ///< By column: every value is the digits of some.
  std::vector<std::vector<Cell>> rows;
};

enum class Access { kRead, kWrite };

/// Of how many shards the runs of a store are part.
struct StatedShards {
  int count = 0;            ///< 0: nobody has said it.
  std::optional<int> only;  ///< All runs are of this one.
};

/// Which runs.
struct RunSelection {
  bool only_standing = false;  ///< Of each unit the run that counts.
  /// A condition in SQL on `run` or `standing` and the tags by their names; empty: any.
  std::string where = {};
  bool with_standing = false;  ///< UnitRun::standing is wanted.
  bool is_whole = true;        ///< Inputs, findings and covariance are wanted.
};

/// What somebody decided about a unit, whatever the verdict of its run. Holds until a later
/// decision, or a later run that counts and is of another recording, which a refusal must have been
/// measured before.
struct Disposition {
  std::string id;       ///< NewRunId; of several of one unit the greatest is the last.
  std::string serial;   ///< Of the unit.
  std::string created;  ///< ISO 8601, UTC.
  std::string who, why;
  Verdict verdict = Verdict::kPass;  ///< One of kVerdictsOfPeople.
  std::string run = {};              ///< The one that counted, or is another unit's.
  /// Whether what the run read is another unit's, since its serial number was wrong, or is its own
  /// after all; unset: this decision does not say, and leaves what was said before.
  std::optional<bool> wrong_serial = {};

  bool GivesUp() const { return wrong_serial.value_or(false); }
};
/// What somebody can decide: that the unit may leave, or that it may not.
inline constexpr std::array kVerdictsOfPeople = {Verdict::kPass, Verdict::kFail};

/// Error (usage): who or why is blank, longer than 200 or 2000 bytes, more than one line or no
/// UTF-8, the verdict is none of people, or the serial number was wrong and it is not FAIL.
Status CheckDisposition(const Disposition& disposition);

/// A station's golden unit, measured again.
struct StationCheck {
  std::string id;  ///< NewRunId.
  std::string station;
  std::string serial;   ///< Of the golden unit.
  std::string created;  ///< ISO 8601, UTC.
  /// Likewise; by the recording's own clock, or the file's time: that is how old a check is.
  std::string recorded;
  bool agrees = false;
  /// Of all differences together, and the largest of them in sigma; NaN: not known.
  double p = std::numeric_limits<double>::quiet_NaN();
  double largest = std::numeric_limits<double>::quiet_NaN();
  std::string parameter;  ///< That with the largest difference.
  std::string log;
  std::string recording = {};      ///< RecordingOf its readings; empty: not known.
  std::string repeatability = {};  ///< That the golden unit was granted, as it was stated.
};

/// What a golden unit says of its station.
enum class GoldenState {
  kGood,
  kDisagrees,  ///< Its last recording did not agree, however long ago: that holds until one does.
  kOverdue,    ///< Its last recording is too old, or nobody knows how old.
  kToCome,     ///< Its last recording is of a time to come: a clock is or was wrong.
};
/// By the last check of the golden unit that counts, `now_s` seconds after the beginning of 1970,
/// where a recording is too old that is older than `due_s`.
GoldenState GoldenStateOf(const StationCheck& last, double now_s, double due_s);

/// What decisions and checks a store has.
struct Decisions {
  std::vector<Disposition> dispositions;  ///< In their order.
  std::vector<StationCheck> checks;       ///< Likewise.
};

/// By what a recording is known, wherever its files are and however they are written: the digests
/// of its sensors' readings, sorted.
std::string RecordingOf(const std::vector<SensorReadings>& readings);

/// Which of a unit's runs counts.
enum class RetestCounts { kLast, kFirst, kBest };
std::string_view RetestCountsName(RetestCounts counts);  ///< "last", "first", "best".
std::optional<RetestCounts> RetestCountsFromName(std::string_view name);

struct RetestPolicy {
  /// Of those that may count; the best is the last of those with the best verdict, in the order of
  /// their enumeration.
  RetestCounts counts = RetestCounts::kLast;
  /// Of how many recordings after the first runs may count, 0 to a million; unset: of all.
  std::optional<std::int64_t> most;

  bool operator==(const RetestPolicy&) const = default;
};

/// "best, 2 more".
std::string PolicyText(const RetestPolicy& policy);

/// What a store states of itself.
struct StoreHeader {
  StatedShards shards;
  std::string store = {};                   ///< A name that was made with it and is no other's.
  std::optional<RetestPolicy> policy = {};  ///< Unset: nobody has said it.
};

class Database;
class RunLines;

/// Where runs are kept: in a database, or, to travel to one, in a file of runs (json_lines.h). A
/// run is added once and never changed. All functions: an error (bad input) where the store cannot
/// be reached or written. A file of runs answers no questions (Query, ForEachRun, checks of
/// stations: an error, bad input), and nothing is known of standings there, since it has a part of
/// the units' runs: `fleet collect` makes a store of it.
class Store {
 public:
  /// A store in `database`. Error (bad input): the tables are of another version.
  static Result<std::unique_ptr<Store>> Open(std::unique_ptr<Database> database);
  /// A file of runs to be written. Errors as RunLines::Open.
  static Result<std::unique_ptr<Store>> OpenLines(const std::string& path);
  ~Store();

  /// On the disk when it returns. A run that is there already is not added to a database again.
  Status Add(const UnitRun& run) { return AddAll({&run, 1}); }
  /// The same of several at once, which is faster.
  Status AddAll(std::span<const UnitRun> runs);
  // Runs that are asked for here have what their table says, and no lists.

  /// Whether a run of this name is there.
  Result<bool> Has(const std::string& run);
  /// The greatest name of a run of the same unit or the same log, or of a decision about the unit;
  /// empty: there is none.
  Result<std::string> LatestRun(const UnitRun& run);
  /// A run of another unit that has all readings of this one and was not refused for it, unless a
  /// person said that its serial number was wrong; unset: there is none.
  Result<std::optional<UnitRun>> RunOfSameReadings(const UnitRun& run);
  /// Runs of which a person said that their serial number was wrong.
  Result<std::vector<UnitRun>> RunsGivenUp();
  /// `take`s the last run of each log, with its tags.
  Status ForEachLastRun(const std::function<void(const UnitRun&)>& take);
  /// Of which shard further runs are; the first who says how many there are, states it. Error
  /// (usage): another number was stated, or the file of runs is of another shard.
  Status StateShard(const Shard& shard);
  /// Which run of a unit counts; the first who says it, states it. Error (usage): another policy
  /// was stated, or the file of runs has begun without one.
  Status StateRetestPolicy(const RetestPolicy& policy);
  /// The last run of the run's unit that missed limits since any of its others was good; empty:
  /// there is none.
  Result<std::string> FailedSinceGood(const UnitRun& run);
  Result<StoreHeader> Header();
  /// Of one unit, the runs of which a person said that their serial number was wrong, by their
  /// names, each with that decision as if it were the unit's standing.
  Result<std::map<std::string, Standing>> GivenUpOf(const std::string& serial);
  /// Unset: there is no such unit.
  Result<std::optional<Standing>> StandingOf(const std::string& serial);
  /// Units whose files may have to be told something (AgreeFolders): somebody decided about them,
  /// or they are not good and have a result of another run.
  Result<std::vector<std::string>> UnitsHeldBack();
  /// Of units that are not good, by the run that counts, the last run of each log.
  Result<std::vector<UnitRun>> LogsOfUnitsNotGood();
  /// A unit whose serial number differs in capital letters alone; empty: there is none.
  Result<std::string> UnitOfOtherLetters(const std::string& serial);
  /// Those of the unit's runs that have files, in the order of their names.
  Result<std::vector<UnitRun>> FoldersOfUnit(const std::string& serial);
  /// Adds a disposition of the unit's run that it names, or that counts now, and gives it as it was
  /// added: with that run, and with a later name than all of its runs and all decisions. Nothing is
  /// changed. Error (usage): there is no such unit or run, a serial number was wrong and it is not
  /// clear of which recording, the unit is to be good by a run that was given up or does not count,
  /// or its readings count for another one.
  Result<Disposition> Dispose(const Disposition& disposition);
  /// Adds a check, with a later name where the clock has gone back. The check by which the golden
  /// unit's state at the station is known, where this one is not it: a recording counts for a
  /// golden unit by its first check at a station, and the last recording says the unit's state.
  Result<std::optional<StationCheck>> AddStationCheck(const StationCheck& check);
  /// Those that count, in their order: of all stations, or of one the last of each golden unit.
  Result<std::vector<StationCheck>> StationChecks();
  Result<std::vector<StationCheck>> LastStationChecks(const std::string& station);
  Result<Decisions> ReadDecisions();
  /// Those of another store, of which all runs are here; what is there already is not added again.
  Status AddDecisions(const Decisions& decisions);
  /// Says in a file of runs that all that was to be added has been, until more is.
  Status MarkEnd();
  /// Answers a statement that only reads. Error (usage): it is none.
  Result<Table> Query(const std::string& sql);
  /// Of each row of that the first field.
  Result<std::vector<std::string>> QueryTexts(const std::string& sql);
  /// Error (usage): statements or conditions that somebody has typed must not be part of a
  /// question, since who is connected may do more by a question than read the store.
  Status AllowTypedText();
  /// Tells of what takes time; empty: nobody is told.
  void TellNotes(std::function<void(const std::string&)> on_note);
  /// `take`s whole runs, one after the other, in the order of their serials and then names;
  /// memory does not grow with their number. Errors also: those of `take`; (usage) a condition
  /// that is none.
  Status ForEachRun(const RunSelection& which, const std::function<Status(UnitRun)>& take);
  /// Those of these runs that are there, whole.
  Result<std::vector<UnitRun>> ReadRuns(const std::vector<std::string>& runs);
  /// Does all of `work`, which uses this store, or nothing of it, also where it throws. It may be
  /// called several times: a connection that is lost is opened anew.
  Status Together(const std::function<Status()>& work);

 private:
  explicit Store(std::unique_ptr<Database> database);
  /// All facts, after those that are stated: together, unless the first of them is there.
  Result<StoreFacts> StateFacts(
      const std::vector<std::pair<std::string_view, std::string>>& stated);
  /// The rows of a run, unless it is there. In a transaction.
  Status InsertRun(const UnitRun& run);
  /// Error (usage): the decision would give readings back that count for another unit.
  Status CheckReadings(const Disposition& disposition);
  /// Error (usage): the run is none of the unit's, or cannot be conceded since `counting` counts.
  Status CheckIsOfUnit(const Disposition& disposition, const std::string& counting);
  /// Of the unit's only recording with a result that was given up, or that was not; empty: there is
  /// none. Error (usage): there are several.
  Result<std::string> OnlyRecording(const std::string& serial, bool is_given_up);
  /// How many of them were not there. In a transaction.
  Result<std::int64_t> Insert(const TableRows& rows);
  /// Makes `id` greater than all of a table and `other`; false: it is there already.
  Result<bool> MakeLast(const std::string& table, const std::string& other, std::string* id);
  /// What a statement says.
  Result<Table> Asked(std::string_view sql, const std::vector<Value>& values = {});
  /// Its first field; empty: there is none.
  Result<std::string> Text(std::string_view sql, const std::vector<Value>& values = {});
  /// The runs that `condition` is true of.
  Result<std::vector<UnitRun>> RunsWhere(const std::string& condition,
                                         const std::vector<Value>& values = {});
  /// The same as things, one a row.
  template <typename Thing>
  Result<std::vector<Thing>> Things(const std::string& sql, const std::vector<Value>& values = {});
  /// `work` in a transaction: in that which there is, or one of its own.
  Status Transact(Access access, const std::function<Status()>& work);
  /// The runs that `condition`, on columns of `run` alone, is true of.
  Result<std::vector<UnitRun>> RunsOfPage(const RunSelection& which, const std::string& condition);
  /// What units amount to, for those of their runs that count.
  Status TakeStandings(const std::string& condition, std::vector<UnitRun>* runs);

  std::unique_ptr<Database> database_;
  bool is_in_transaction_ = false;
  std::unique_ptr<RunLines> lines_;  ///< Where runs go, with what is asked of them in database_.
};

/// `url` for people and files: without password.
std::string ShownStore(const std::string& url);

/// What a store is called, from wherever it is seen: a file by its whole path.
std::string NameOfStore(const std::string& url);

/// Opens a store, or makes it: PATH, sqlite:PATH, NAME.jsonl, jsonl:PATH, postgresql://…,
/// postgres://…, and name=value of libpq as postgresql:name=value …. Error (bad input): it cannot
/// be reached, is none of this program's, of another version of its schema, or on a file system
/// that SQLite cannot lock, or the file is none (a pipe, a device). Error (usage): another kind of
/// URL, one that names no file, or this build cannot speak to PostgreSQL.
Result<std::unique_ptr<Store>> OpenStore(const std::string& url);

/// The same of one that is there; nothing can be written to it, nor, while an InputGuard lives,
/// be put in its place.
Result<std::unique_ptr<Store>> OpenStoreToRead(const std::string& url);

/// Error (bad input): what is there is no file, since a pipe would never end; to read, it is not
/// there; to write, its folder cannot be made.
Status CheckStoreFile(const std::string& path, Access access);

/// The file of a store that is one; unset: it is kept by a server.
std::optional<std::string> FileOfStore(const std::string& url);

/// What libpq takes of a store's URL: postgresql://…, postgres://…, or the name=value of
/// postgresql:name=value …. Unset: it is none of PostgreSQL.
std::optional<std::string> PostgresOptions(const std::string& url);

/// Error (usage): `url` names no file, what SQLite would take for something else than a file, or
/// looks like a connection to a server that was written otherwise; that is not shown, since it may
/// hold a password.
Status CheckStoreUrl(const std::string& url);

/// A URL of PostgreSQL for messages: server, port, database and user, and nothing else that it may
/// hold. Where it is not clear what is which, as in a password with a bare @, / or ?, or values in
/// quotes, none of it.
std::string ShownPostgres(const std::string& url);

// What comes from other stores and files is looked at once, where it comes in. All errors are of
// bad input, and say what was seen.

/// Whether NewRunId may have made it, at some moment that there is.
bool IsRunId(std::string_view name);

/// Error: its name or time is none, or its name is of after 2200; it is good and misses a limit, or
/// outside its limits and misses none; the serial number is empty, longer than 1000 bytes or has a
/// NUL; a number is not finite, or negative where it cannot be; a parameter is there twice, or the
/// covariance is not of as many.
Status CheckRun(const UnitRun& run);

/// Error: the name, time or run is none, or CheckDisposition.
Status CheckStored(const Disposition& disposition);
/// Error: the name or time is none, or no station is named.
Status CheckStored(const StationCheck& check);

}  // namespace truetriad::fleet
