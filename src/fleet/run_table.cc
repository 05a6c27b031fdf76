// SPDX-License-Identifier: Apache-2.0
#include "fleet/run_table.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <map>
#include <utility>

#include "fleet/database.h"
#include "fleet/fields.h"
#include "fleet/json_lines.h"
#include "tree/json.h"

namespace truetriad::fleet {
namespace {

/// A column of the table with its Parquet type.
struct Column {
  std::string name;
  std::string_view type;
};

constexpr std::string_view kText = "STRING", kWhole = "INT64", kReal = "DOUBLE",
                           kTime = "TIMESTAMP";

/// The columns of every run, and for a current run those of its unit's standing, in order.
const std::vector<Column>& FixedColumns() {
  static const auto& columns =
      *new std::vector<Column>{{"run", kText},           {"serial", kText},
                               {"created", kTime},       {"verdict", kText},
                               {"final_verdict", kText}, {"first_verdict", kText},
                               {"attempts", kWhole},     {"disposed_by", kText},
                               {"code", kText},          {"message", kText},
                               {"mode", kText},          {"log", kText},
                               {"log_bytes", kWhole},    {"log_modified_ns", kWhole},
                               {"software", kText},      {"config_sha256", kText},
                               {"shard", kText},         {"folder", kText},
                               {"wall_s", kReal},        {"cpu_s", kReal},
                               {"effective_dof", kReal}, {"temperature_degc", kReal},
                               {"recorded", kTime},      {"recorded_by", kText}};
  return columns;
}

/// The table of a store's runs, all with the same columns.
class RunTable {
 public:
  /// Reads which parameters and judgements the store has: each of them gets a column.
  static Result<RunTable> Of(Store& store) {
    RunTable table;
    table.columns_ = FixedColumns();
    for (const std::string_view tag : TagNames()) {
      table.columns_.push_back({std::string(tag), kText});
    }
    TRUETRIAD_ASSIGN_OR_RETURN(
        const Table names,
        store.Query("SELECT name FROM parameter GROUP BY name ORDER BY min(place), name"));
    for (const auto& row : names.rows) {
      const std::string name = row[0].value_or("");
      table.places_[name] = table.columns_.size();
      table.columns_.push_back({name, kReal});
      table.columns_.push_back({name + ".sigma", kReal});
    }
    TRUETRIAD_ASSIGN_OR_RETURN(const Table judged,
                               store.Query("SELECT name, component FROM judgement GROUP BY name, "
                                           "component ORDER BY min(place), name, component"));
    for (const auto& row : judged.rows) {
      const std::string name = JudgedName(row[0].value_or(""), row[1].value_or(""));
      table.places_[name] = table.columns_.size();
      table.columns_.push_back({name, kReal});
    }
    return table;
  }

  const std::vector<Column>& columns() const { return columns_; }

  /// The cells of a run: texts, numbers or null.
  std::vector<Json> RowOf(const UnitRun& run) const {
    Json fixed = TreeOf(run.standing.value_or(Standing()));
    for (Json& cell : fixed) {
      if (!run.standing) cell = nullptr;
    }
    fixed.update(TreeOf(run));
    std::vector<Json> row;
    row.reserve(columns_.size());
    for (const Column& column : FixedColumns()) {
      Json cell = fixed.at(column.name);
      row.push_back(column.type == kTime && cell == "" ? Json() : std::move(cell));
    }
    TagFields([&row](std::string_view, const std::string& value) { row.emplace_back(value); },
              run.tags);
    row.resize(columns_.size());
    for (const Parameter& parameter : run.parameters) {
      const auto found = places_.find(parameter.name);
      if (found == places_.end()) continue;  // A run that was added meanwhile has this parameter.
      row[found->second] = parameter.value;
      row[found->second + 1] = parameter.sigma;
    }
    for (const LimitCheck& check : run.judgements) {
      const auto found = places_.find(JudgedName(check.name, check.component));
      if (found != places_.end()) row[found->second] = check.worst;
    }
    return row;
  }

 private:
  static std::string JudgedName(const std::string& name, const std::string& component) {
    return name + (component.empty() ? "" : "." + component) + ".judged";
  }

  std::vector<Column> columns_;
  /// The index of the column of each judgement and of each parameter's value, after which its sigma
  /// follows.
  std::map<std::string, std::size_t> places_;
};

std::string CsvField(std::string text) {
  constexpr std::string_view kFormula = "=+-@\t\r";
  if (!text.empty() && kFormula.find(text[0]) != std::string_view::npos) text.insert(0, "'");
  return CsvQuoted(text);
}

std::string CsvField(const Json& cell) {
  if (cell.is_string()) return CsvField(cell.get<std::string>());
  if (cell.is_number_integer()) return cell.dump();
  // A non-finite number has no text.
  const bool is_number = cell.is_number() && std::isfinite(cell.get<double>());
  return is_number ? NumberText(cell.get<double>()) : "";
}

/// Writes a file: `head`, the lines of each run, and `tail`, called with the number of runs.
Result<std::size_t> WriteRuns(Store& store,
                              RunSelection which,
                              const std::string& path,
                              const std::string& head,
                              const std::function<std::string(const UnitRun&)>& line_of,
                              const std::function<std::string(std::size_t runs)>& tail = {},
                              bool replaces_store = false) {
  WholeFile file(path, replaces_store);
  TRUETRIAD_RETURN_IF_ERROR(file.status());
  file.Write(head);
  std::size_t runs = 0;
  which.with_standing = true;
  TRUETRIAD_RETURN_IF_ERROR(store.ForEachRun(which, [&](const UnitRun& run) -> Status {
    file.Write(line_of(run));
    ++runs;
    return file.status();
  }));
  if (tail) file.Write(tail(runs));
  TRUETRIAD_RETURN_IF_ERROR(file.Commit());
  return runs;
}

}  // namespace

std::string CsvQuoted(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? "\"\"" : std::string(1, c);
  return quoted + '"';
}

Result<std::size_t> ExportCsv(Store& store, const RunSelection& which, const std::string& path) {
  constexpr std::string_view kLineEnd = "\r\n";
  TRUETRIAD_ASSIGN_OR_RETURN(const RunTable table, RunTable::Of(store));
  std::string head;
  for (const Column& column : table.columns()) {
    head += (head.empty() ? "" : ",") + CsvField(column.name);
  }
  return WriteRuns(store, which, path, head.append(kLineEnd), [&](const UnitRun& run) {
    std::string line;
    for (const Json& cell : table.RowOf(run)) line += CsvField(cell) + ',';
    line.pop_back();
    return line.append(kLineEnd);
  });
}

Result<std::size_t> ExportJsonLines(Store& store,
                                    const RunSelection& which,
                                    const std::string& path) {
  TRUETRIAD_ASSIGN_OR_RETURN(StoreHeader header, store.Header());
  header.shards.count = std::max(header.shards.count, 1);
  TRUETRIAD_ASSIGN_OR_RETURN(const Decisions decisions, store.ReadDecisions());
  std::map<std::string, std::vector<Disposition>> by_serial;
  for (const Disposition& one : decisions.dispositions) by_serial[one.serial].push_back(one);
  TRUETRIAD_ASSIGN_OR_RETURN(const std::vector<UnitRun> given_up, store.RunsGivenUp());
  std::string head = HeaderLine(header);
  for (const StationCheck& check : decisions.checks) head += LineOf(check);
  LineCounts counts{.station_checks = decisions.checks.size()};
  const auto lines_of = [&](const UnitRun& run) {
    std::string lines = LineOf(run);
    const auto decided = by_serial.find(run.serial);
    if (decided == by_serial.end()) return lines;
    // If only current runs are exported, a decision about another run moves to the current one.
    const bool holds = which.only_standing && run.standing && !run.standing->disposed_by.empty();
    const bool is_given_up = std::ranges::find(given_up, run.id, &UnitRun::id) != given_up.end();
    for (Disposition one : decided->second) {
      // A decision that another recording has a wrong serial number does not move.
      if (holds && (!one.wrong_serial || (one.GivesUp() && is_given_up))) one.run = run.id;
      if (one.run != run.id) continue;
      lines += LineOf(one);
      ++counts.dispositions;
    }
    return lines;
  };
  const auto end_of = [&](std::size_t runs) {
    counts.runs = runs;
    return EndLine(counts);
  };
  // An export of this store may be replaced. A shard's file of runs, whose header also names a
  // store, may not.
  const std::optional<StoreHeader> there = HeaderOf(path);
  const bool is_export = there && there->store == header.store && !there->shards.only;
  return WriteRuns(store, which, path, head, lines_of, end_of, is_export);
}

Result<std::size_t> ExportTypedTable(Store& store,
                                     const RunSelection& which,
                                     const std::string& path) {
  TRUETRIAD_ASSIGN_OR_RETURN(const RunTable table, RunTable::Of(store));
  Json head = Json::array();
  for (const Column& column : table.columns()) {
    head.push_back({{"name", column.name}, {"type", column.type}});
  }
  return WriteRuns(store, which, path, LineOfJson(head), [&](const UnitRun& run) {
    Json row = Json::array();
    // Integers are written as text, so that no digit is lost.
    for (const Json& cell : table.RowOf(run)) {
      row.push_back(cell.is_number_integer() ? Json(cell.dump()) : cell);
    }
    return LineOfJson(row);
  });
}

}  // namespace truetriad::fleet
