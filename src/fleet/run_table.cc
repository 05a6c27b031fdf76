// SPDX-License-Identifier: Apache-2.0
#include "fleet/run_table.h"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <utility>
#include <variant>

#include "fleet/json_lines.h"
#include "fleet/rows.h"
#include "json/json.h"

namespace truetriad::fleet {
namespace {

/// A field; nothing, text, or a number.
using TableCell = std::variant<std::monostate, std::string, std::int64_t, double>;

/// What every run has, in the order of the columns.
struct FixedColumn {
  std::string_view name, type;
  TableCell (*cell)(const UnitRun& run);
};
template <std::string UnitRun::*kField>
TableCell TextCell(const UnitRun& run) {
  return run.*kField;
}
/// What the unit amounts to, of the run that counts.
template <Verdict Standing::*kField>
TableCell StandingVerdict(const UnitRun& run) {
  if (!run.standing) return {};
  return std::string(VerdictName((*run.standing).*kField));
}
constexpr FixedColumn kFixedColumns[] = {
    {"run", "STRING", TextCell<&UnitRun::id>},
    {"serial", "STRING", TextCell<&UnitRun::serial>},
    {"created", "TIMESTAMP", TextCell<&UnitRun::created>},
    {"verdict",
     "STRING",
     [](const UnitRun& run) -> TableCell { return std::string(VerdictName(run.verdict)); }},
    {"final_verdict", "STRING", StandingVerdict<&Standing::final_verdict>},
    {"first_verdict", "STRING", StandingVerdict<&Standing::first_verdict>},
    {"attempts",
     "INT64",
     [](const UnitRun& run) -> TableCell {
       return run.standing ? TableCell(run.standing->attempts) : TableCell();
     }},
    {"disposed_by",
     "STRING",
     [](const UnitRun& run) -> TableCell {
       return run.standing ? TableCell(run.standing->disposed_by) : TableCell();
     }},
    {"code", "STRING", TextCell<&UnitRun::code>},
    {"message", "STRING", TextCell<&UnitRun::message>},
    {"mode", "STRING", TextCell<&UnitRun::mode>},
    {"log", "STRING", TextCell<&UnitRun::log>},
    {"log_bytes", "INT64", [](const UnitRun& run) -> TableCell { return run.log_bytes; }},
    {"log_modified_ns",
     "INT64",
     [](const UnitRun& run) -> TableCell { return run.log_modified_ns; }},
    {"software", "STRING", TextCell<&UnitRun::software_version>},
    {"config_sha256", "STRING", TextCell<&UnitRun::config_sha256>},
    {"shard", "STRING", TextCell<&UnitRun::shard>},
    {"folder", "STRING", TextCell<&UnitRun::folder>},
    {"wall_s", "DOUBLE", [](const UnitRun& run) -> TableCell { return run.wall_s; }},
    {"cpu_s", "DOUBLE", [](const UnitRun& run) -> TableCell { return run.cpu_s; }},
    {"effective_dof", "DOUBLE", [](const UnitRun& run) -> TableCell { return run.effective_dof; }},
    {"temperature_degc",
     "DOUBLE",
     [](const UnitRun& run) -> TableCell {
       if (std::isnan(run.temperature_degc)) return {};
       return run.temperature_degc;
     }},
    {"recorded",
     "TIMESTAMP",
     [](const UnitRun& run) -> TableCell {
       return run.recorded.empty() ? TableCell() : TableCell(run.recorded);
     }},
    {"recorded_by", "STRING", TextCell<&UnitRun::recorded_by>},
};

/// The table of a store's runs: all have the same columns.
class RunTable {
 public:
  struct Column {
    std::string name;
    std::string_view type;
  };

  /// Looks which parameters and judgements there are.
  static Result<RunTable> Of(Store& store) {
    RunTable table;
    for (const FixedColumn& column : kFixedColumns) {
      table.columns_.push_back({std::string(column.name), column.type});
    }
    for (const TagKey* tag : TagKeys()) table.columns_.push_back({std::string(tag->key), "STRING"});
    TRUETRIAD_ASSIGN_OR_RETURN(
        const Table names,
        store.Query("SELECT name FROM parameter GROUP BY name ORDER BY min(place), name"));
    for (const auto& row : names.rows) {
      const std::string name = row[0].value_or("");
      table.places_[name] = table.columns_.size();
      table.columns_.push_back({name, "DOUBLE"});
      table.columns_.push_back({name + ".sigma", "DOUBLE"});
    }
    TRUETRIAD_ASSIGN_OR_RETURN(const Table judged,
                               store.Query("SELECT name, component FROM judgement GROUP BY name, "
                                           "component ORDER BY min(place), name, component"));
    for (const auto& row : judged.rows) {
      const std::string name = JudgedName(row[0].value_or(""), row[1].value_or(""));
      table.places_[name] = table.columns_.size();
      table.columns_.push_back({name, "DOUBLE"});
    }
    return table;
  }

  const std::vector<Column>& columns() const { return columns_; }

  std::vector<TableCell> RowOf(const UnitRun& run) const {
    std::vector<TableCell> row;
    row.reserve(columns_.size());
    for (const FixedColumn& column : kFixedColumns) row.push_back(column.cell(run));
    for (const TagKey* tag : TagKeys()) row.emplace_back(run.tags.*tag->value);
    row.resize(columns_.size());
    for (const Parameter& parameter : run.parameters) {
      const auto found = places_.find(parameter.name);
      if (found == places_.end()) continue;  // Of a run that has come since.
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
  static std::vector<const TagKey*> TagKeys() {
    std::vector<const TagKey*> tags;
    for (const TagKey& tag : kDeviceTags) tags.push_back(&tag);
    for (const TagKey& tag : kRunTags) tags.push_back(&tag);
    return tags;
  }

  std::vector<Column> columns_;
  /// Of what is judged, and of a parameter's value; its sigma is next.
  std::map<std::string, std::size_t> places_;
};

/// A number that is none has no text.
std::string NumberText(double number) { return std::isfinite(number) ? ShortestText(number) : ""; }

std::string CsvField(std::string text) {
  constexpr std::string_view kFormula = "=+-@\t\r";
  if (!text.empty() && kFormula.find(text[0]) != std::string_view::npos) text.insert(0, "'");
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? "\"\"" : std::string(1, c);
  return quoted + '"';
}

std::string CsvField(const TableCell& cell) {
  if (const auto* const text = std::get_if<std::string>(&cell)) return CsvField(*text);
  if (const auto* const whole = std::get_if<std::int64_t>(&cell)) return std::to_string(*whole);
  const auto* const number = std::get_if<double>(&cell);
  return number == nullptr ? "" : NumberText(*number);
}

Json JsonField(const TableCell& cell) {
  if (const auto* const text = std::get_if<std::string>(&cell)) return *text;
  if (const auto* const whole = std::get_if<std::int64_t>(&cell)) return std::to_string(*whole);
  const auto* const number = std::get_if<double>(&cell);
  return number == nullptr ? Json() : Json(*number);
}

std::string LineOfJson(const Json& json) {
  return json.dump(-1, ' ', /*ensure_ascii=*/true, Json::error_handler_t::replace) + '\n';
}

RunSelection WithStanding(RunSelection which) {
  which.with_standing = true;
  return which;
}

/// A file of `head`, the lines of each run, and what `tail` says of their number.
Result<std::size_t> WriteRuns(Store& store,
                              const RunSelection& which,
                              const std::string& path,
                              const std::string& head,
                              const std::function<std::string(const UnitRun&)>& line_of,
                              const std::function<std::string(std::size_t runs)>& tail = {}) {
  WholeFile file(path);
  TRUETRIAD_RETURN_IF_ERROR(file.status());
  file.Write(head);
  std::size_t runs = 0;
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

Result<std::size_t> ExportCsv(Store& store, const RunSelection& which, const std::string& path) {
  constexpr std::string_view kLineEnd = "\r\n";
  TRUETRIAD_ASSIGN_OR_RETURN(const RunTable table, RunTable::Of(store));
  std::string head;
  for (const RunTable::Column& column : table.columns()) {
    head += (head.empty() ? "" : ",") + CsvField(column.name);
  }
  return WriteRuns(
      store, WithStanding(which), path, head.append(kLineEnd), [&](const UnitRun& run) {
        std::string line;
        for (const TableCell& cell : table.RowOf(run)) line += CsvField(cell) + ',';
        line.pop_back();
        return line.append(kLineEnd);
      });
}

Result<std::size_t> ExportJsonLines(Store& store,
                                    const RunSelection& which,
                                    const std::string& path) {
  LinesHeader header;
  TRUETRIAD_ASSIGN_OR_RETURN(header.shards, store.Shards());
  if (header.shards.count == 0) header.shards.count = 1;
  TRUETRIAD_ASSIGN_OR_RETURN(header.store, store.Identity());
  TRUETRIAD_ASSIGN_OR_RETURN(header.policy, store.StatedRetestPolicy());
  TRUETRIAD_ASSIGN_OR_RETURN(const Decisions decisions, store.ReadDecisions());
  std::map<std::string, std::vector<Disposition>> by_serial;
  for (const Disposition& one : decisions.dispositions) by_serial[one.serial].push_back(one);
  std::string head = HeaderLine(header);
  for (const StationCheck& check : decisions.checks) head += LineOf(check);
  LineCounts counts{.station_checks = decisions.checks.size()};
  const auto lines_of = [&](const UnitRun& run) {
    std::string lines = LineOf(run);
    const auto decided = by_serial.find(run.serial);
    if (decided == by_serial.end()) return lines;
    // Where the run that it was about is not there, what holds is said of the one that counts.
    const bool holds = which.only_standing && run.standing && !run.standing->disposed_by.empty();
    for (Disposition one : decided->second) {
      if (holds) one.run = run.id;
      if (one.run != run.id) continue;
      lines += LineOf(one);
      ++counts.dispositions;
    }
    return lines;
  };
  return WriteRuns(store, WithStanding(which), path, head, lines_of, [&](std::size_t runs) {
    counts.runs = runs;
    return EndLine(counts);
  });
}

Result<std::size_t> ExportTypedTable(Store& store,
                                     const RunSelection& which,
                                     const std::string& path) {
  TRUETRIAD_ASSIGN_OR_RETURN(const RunTable table, RunTable::Of(store));
  Json head = Json::array();
  for (const RunTable::Column& column : table.columns()) {
    head.push_back({{"name", column.name}, {"type", column.type}});
  }
  return WriteRuns(store, WithStanding(which), path, LineOfJson(head), [&](const UnitRun& run) {
    Json row = Json::array();
    for (const TableCell& cell : table.RowOf(run)) row.push_back(JsonField(cell));
    return LineOfJson(row);
  });
}

}  // namespace truetriad::fleet
