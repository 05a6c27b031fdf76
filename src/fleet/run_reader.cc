// SPDX-License-Identifier: Apache-2.0
#include "fleet/run_reader.h"

#include <bit>
#include <charconv>
#include <cstdint>
#include <map>
#include <optional>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "fleet/line_selection.h"
#include "json/json.h"

namespace truetriad::fleet {
namespace {

/// Units that are in memory at once.
constexpr int kUnitsAPage = 100;

using StoredField = std::optional<std::string>;
using StoredRow = std::vector<StoredField>;

double RealIn(const StoredField& field, double otherwise = 0.0) {
  double number = otherwise;
  if (field) std::from_chars(field->data(), field->data() + field->size(), number);
  return number;
}

std::int64_t IntegerIn(const StoredField& field) {
  std::int64_t number = 0;
  if (field) std::from_chars(field->data(), field->data() + field->size(), number);
  return number;
}

std::string TextIn(const StoredField& field) { return field.value_or(""); }

/// Doubles from the digits of their bytes, the least significant first.
std::vector<double> RealsFromHex(std::string_view digits) {
  constexpr std::size_t kDigits = 16;
  std::vector<double> reals;
  reals.reserve(digits.size() / kDigits);
  for (; digits.size() >= kDigits; digits.remove_prefix(kDigits)) {
    std::uint64_t bits = 0;
    for (std::size_t byte = kDigits; byte > 0; byte -= 2) {
      unsigned value = 0;
      std::from_chars(digits.data() + byte - 2, digits.data() + byte, value, 16);
      bits = bits << 8U | value;
    }
    reals.push_back(std::bit_cast<double>(bits));
  }
  return reals;
}

constexpr std::string_view kRunColumns =
    "run, serial, log, log_bytes, log_modified_ns, created, software, config_sha256, shard, "
    "folder, verdict, code, message, mode, wall_s, cpu_s, effective_dof, covariance, "
    "temperature_degc, recorded, recorded_by";

/// Error (bad input): the verdict is none.
Result<Verdict> StatedVerdict(const StoredField& field, const std::string& run) {
  const std::string name = TextIn(field);
  if (const std::optional<Verdict> verdict = VerdictFromName(name)) return *verdict;
  return Error(ErrorCode::kWrongFormat,
               "run " + run + ": its verdict is `" + name +
                   "`, which is none; the store has been changed by another program");
}

Result<UnitRun> RunFrom(const StoredRow& row) {
  UnitRun run;
  run.id = TextIn(row[0]);
  run.serial = TextIn(row[1]);
  run.log = TextIn(row[2]);
  run.log_bytes = IntegerIn(row[3]);
  run.log_modified_ns = IntegerIn(row[4]);
  run.created = TextIn(row[5]);
  run.software_version = TextIn(row[6]);
  run.config_sha256 = TextIn(row[7]);
  run.shard = TextIn(row[8]);
  run.folder = TextIn(row[9]);
  TRUETRIAD_ASSIGN_OR_RETURN(run.verdict, StatedVerdict(row[10], run.id));
  run.code = TextIn(row[11]);
  run.message = TextIn(row[12]);
  run.mode = TextIn(row[13]);
  run.wall_s = RealIn(row[14]);
  run.cpu_s = RealIn(row[15]);
  run.effective_dof = RealIn(row[16]);
  run.covariance = RealsFromHex(TextIn(row[17]));
  if (row[18]) run.temperature_degc = RealIn(row[18]);
  run.recorded = TextIn(row[19]);
  run.recorded_by = TextIn(row[20]);
  return run;
}

void TakeTag(const StoredRow& row, UnitRun* run) {
  const auto take = [&](const TagKey& tag) {
    if (row[1] == tag.key) run->tags.*tag.value = TextIn(row[2]);
  };
  for (const TagKey& tag : kDeviceTags) take(tag);
  for (const TagKey& tag : kRunTags) take(tag);
}

void TakeInput(const StoredRow& row, UnitRun* run) {
  run->inputs.push_back({TextIn(row[1]), TextIn(row[2]), IntegerIn(row[3])});
}

void TakeParameter(const StoredRow& row, UnitRun* run) {
  run->parameters.push_back({TextIn(row[1]), RealIn(row[2]), RealIn(row[3])});
}

void TakeFinding(const StoredRow& row, UnitRun* run) {
  Json json = {{"code", TextIn(row[1])}, {"severity", TextIn(row[2])}, {"text", TextIn(row[6])}};
  if (row[3]) json["sensor"] = *row[3];
  if (row[4]) json["axis"] = *row[4];
  if (row[5]) json["pose"] = IntegerIn(row[5]);
  if (row[7]) json["remedy"] = *row[7];
  if (row[8]) json["values"] = Json::parse(*row[8]);
  if (row[9]) json["treatment"] = *row[9];
  run->findings.push_back(FindingFrom(json));
}

void TakeJudgement(const StoredRow& row, UnitRun* run) {
  LimitCheck check;
  check.name = TextIn(row[1]);
  check.component = TextIn(row[2]);
  check.limit.lower = RealIn(row[3], check.limit.lower);
  if (row[4]) check.limit.target = RealIn(row[4]);
  check.limit.upper = RealIn(row[5], check.limit.upper);
  check.worst = RealIn(row[6]);
  check.sigma = RealIn(row[7]);
  check.outside = RealIn(row[8]);
  check.pass = IntegerIn(row[9]) != 0;
  run->judgements.push_back(check);
}

/// What belongs to runs, a row each, and where it goes.
struct Part {
  std::string_view columns;  ///< Behind `run`.
  std::string_view table;
  std::string_view order;
  void (*take)(const StoredRow& row, UnitRun* run);
};
constexpr Part kParts[] = {
    {"name, value", "tag", "name", TakeTag},
    {"file, sha256, samples", "input", "place", TakeInput},
    {"name, value, sigma", "parameter", "place", TakeParameter},
    {"code, severity, sensor, axis, pose, text, remedy, \"values\", treatment",
     "finding",
     "place",
     TakeFinding},
    {"name, component, lower, target, upper, value, sigma, outside, pass",
     "judgement",
     "place",
     TakeJudgement},
};

/// What is selected of the store's runs.
std::string SourceOf(const RunSelection& which) {
  const std::string source = which.only_standing ? "standing" : "run";
  // Tags cost a question each: only where somebody may ask for them.
  if (which.where.empty()) return " FROM " + source + " WHERE TRUE";
  return FromWhere(source, {.where = which.where});
}

/// What units amount to, for those of their runs that count.
Status TakeStandings(Store& store, const std::string& condition, std::vector<UnitRun>* runs) {
  if (runs->empty()) return {};
  std::unordered_map<std::string_view, UnitRun*> by_name;
  for (UnitRun& run : *runs) by_name[run.id] = &run;
  TRUETRIAD_ASSIGN_OR_RETURN(
      const Table table,
      store.Query("SELECT run, first_verdict, final_verdict, attempts, disposed_by, disposed_why "
                  "FROM standing WHERE " +
                  condition));
  for (const StoredRow& row : table.rows) {
    const auto found = by_name.find(*row[0]);
    if (found == by_name.end()) continue;
    TRUETRIAD_ASSIGN_OR_RETURN(const Verdict first, StatedVerdict(row[1], *row[0]));
    TRUETRIAD_ASSIGN_OR_RETURN(const Verdict last, StatedVerdict(row[2], *row[0]));
    found->second->standing = Standing{.run = *row[0],
                                       .first_verdict = first,
                                       .final_verdict = last,
                                       .attempts = IntegerIn(row[3]),
                                       .disposed_by = TextIn(row[4]),
                                       .disposed_why = TextIn(row[5])};
  }
  return {};
}

/// The runs that `condition`, on columns of `run` alone, is true of.
Result<std::vector<UnitRun>> RunsOfPage(Store& store,
                                        const RunSelection& which,
                                        const std::string& condition) {
  const std::string sql =
      "SELECT " + std::string(kRunColumns) + SourceOf(which) + " AND " + condition;
  TRUETRIAD_ASSIGN_OR_RETURN(const Table table, store.Query(sql + " ORDER BY serial, run"));
  std::vector<UnitRun> runs;
  std::map<std::string_view, UnitRun*> by_name;
  runs.reserve(table.rows.size());
  for (const StoredRow& row : table.rows) {
    TRUETRIAD_ASSIGN_OR_RETURN(UnitRun run, RunFrom(row));
    runs.push_back(std::move(run));
    by_name[runs.back().id] = &runs.back();
  }
  if (runs.empty()) return runs;
  for (const Part& part : kParts) {
    const std::string name(part.table);
    TRUETRIAD_ASSIGN_OR_RETURN(
        const Table rows,
        store.Query("SELECT run, " + std::string(part.columns) + " FROM " + name +
                    " WHERE run IN (SELECT run FROM run WHERE " + condition + ") ORDER BY run, " +
                    std::string(part.order)));
    for (const StoredRow& row : rows.rows) {
      // Runs that are not wanted have none.
      const auto found = by_name.find(*row[0]);
      if (found != by_name.end()) part.take(row, found->second);
    }
  }
  return runs;
}

}  // namespace

Result<std::vector<UnitRun>> ReadNamedRuns(Store& store, const std::vector<std::string>& names) {
  std::string condition = "run IN (";
  for (const std::string& name : names) {
    condition += (condition.ends_with('(') ? "" : ",") + SqlText(name);
  }
  return RunsOfPage(store, {}, condition + ")");
}

Status ReadRuns(Store& store,
                const RunSelection& which,
                const std::function<Status(UnitRun)>& take) {
  std::string after;  // A condition: behind the last unit that was read.
  for (;;) {
    TRUETRIAD_ASSIGN_OR_RETURN(
        const Table last,
        store.Query("SELECT max(serial) FROM (SELECT serial FROM unit" +
                    (after.empty() ? "" : " WHERE " + after) + " ORDER BY serial LIMIT " +
                    std::to_string(kUnitsAPage) + ") AS page"));
    if (last.rows.empty() || !last.rows[0][0]) return {};
    const std::string quoted = SqlText(*last.rows[0][0]);
    const std::string of_units = (after.empty() ? "" : after + " AND ") + "serial <= " + quoted;
    TRUETRIAD_ASSIGN_OR_RETURN(std::vector<UnitRun> runs, RunsOfPage(store, which, of_units));
    if (which.with_standing) TRUETRIAD_RETURN_IF_ERROR(TakeStandings(store, of_units, &runs));
    for (UnitRun& run : runs) TRUETRIAD_RETURN_IF_ERROR(take(std::move(run)));
    after = "serial > " + quoted;
  }
}

}  // namespace truetriad::fleet
