// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include <gflags/gflags.h>
#include <unistd.h>

#include "base/utf8.h"
#include "fleet/line_reader.h"
#include "fleet/store.h"
#include "tools/truetriad/command.h"
#include "tools/truetriad/flags.h"
#include "tools/truetriad/fleet_flags.h"

DEFINE_string(sql, "", "SELECT: a question in SQL; the tables are in docs/fleet.md");
DEFINE_string(where,
              "",
              "CONDITION: of which runs, as in \"final_verdict <> 'PASS' AND lot = 'L17'\"");
DEFINE_bool(csv, false, "print CSV");

namespace truetriad {
namespace {

/// What is asked where only `--where` is given: of each unit the run that counts.
std::string Question() {
  if (!FLAGS_sql.empty()) return FLAGS_sql;
  return "SELECT serial, final_verdict, verdict, code, first_verdict, attempts, disposed_by, "
         "recorded, recorded_by, log, folder" +
         fleet::FromWhere("standing", {.where = FLAGS_where}) + " ORDER BY recorded, serial";
}

/// Fields with commas, quotes or line ends are quoted, as is what a spreadsheet takes for a
/// formula.
std::string CsvField(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? "\"\"" : std::string(1, c);
  return quoted + '"';
}

std::string CsvOf(const fleet::Table& table) {
  std::string text;
  const auto add = [&text](const auto& row, const auto& field_of) {
    for (std::size_t i = 0; i < row.size(); ++i) text += (i > 0 ? "," : "") + field_of(row[i]);
    text += '\n';
  };
  add(table.columns, CsvField);
  for (const auto& row : table.rows) {
    add(row, [](const std::optional<std::string>& field) { return field ? CsvField(*field) : ""; });
  }
  return text;
}

/// On a terminal, control characters are none; a file or another program takes the bytes.
std::string ForStdout(std::string text) {
  return isatty(STDOUT_FILENO) == 1 ? Printable(text) : std::move(text);
}

/// One line of text, whatever is in it.
std::string Flat(std::string text) {
  for (char& c : text) {
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = ' ';
  }
  return text;
}

/// As it is shown to people: of bytes how many there are.
std::string Shown(const fleet::Table& table,
                  std::size_t column,
                  const std::optional<std::string>& field) {
  if (!field || !table.are_bytes[column]) return Flat(field.value_or(""));
  return "<blob " + std::to_string(field->size() / 2) + " bytes>";  // Two digits each.
}

std::string TextOf(const fleet::Table& table) {
  std::vector<std::size_t> widths;
  for (const std::string& column : table.columns) widths.push_back(column.size());
  for (const auto& row : table.rows) {
    for (std::size_t i = 0; i < row.size(); ++i) {
      widths[i] = std::max(widths[i], Shown(table, i, row[i]).size());
    }
  }
  std::string text;
  const auto add = [&](std::size_t i, const std::string& field) {
    const std::string space(widths[i] - field.size(), ' ');
    const bool is_last = i + 1 == widths.size();
    text += table.are_numbers[i] ? space + field : field + (is_last ? "" : space);
    text += is_last ? "\n" : "  ";
  };
  for (std::size_t i = 0; i < widths.size(); ++i) add(i, table.columns[i]);
  for (const auto& row : table.rows) {
    for (std::size_t i = 0; i < row.size(); ++i) add(i, Shown(table, i, row[i]));
  }
  return text;
}

Json JsonOf(const fleet::Table& table) {
  Json rows = Json::array();
  for (const auto& row : table.rows) {
    Json& item = rows.emplace_back(Json::object());
    for (std::size_t i = 0; i < row.size(); ++i) {
      Json& field = item[table.columns[i]];
      if (!row[i]) continue;
      field = *row[i];
      if (!table.are_numbers[i]) continue;
      const Json number = Json::parse(*row[i], nullptr, /*allow_exceptions=*/false);
      if (number.is_number()) field = number;
    }
  }
  return rows;
}

Result<VerbResult> RunFleetQuery(const std::vector<std::string>&) {
  if (!FLAGS_sql.empty() && !FLAGS_where.empty()) {
    return Error(ErrorCode::kConflictingArguments, "--sql and --where ask two questions; give one");
  }
  TRUETRIAD_ASSIGN_OR_RETURN(const std::unique_ptr<fleet::Store> store,
                             fleet::OpenStoreToRead(FLAGS_store));
  if (!FLAGS_sql.empty() || !FLAGS_where.empty()) {
    TRUETRIAD_RETURN_IF_ERROR(store->AllowTypedText());
  }
  TRUETRIAD_ASSIGN_OR_RETURN(const fleet::Table table, store->Query(Question()));
  if (table.rows.empty() && !FLAGS_csv) Note(FLAGS_sql.empty() ? "no units" : "no rows");
  return VerbResult{.text = FLAGS_csv ? ForStdout(CsvOf(table)) : TextOf(table),
                    .result = {{"columns", table.columns}, {"rows", JsonOf(table)}}};
}

}  // namespace

Command FleetQueryCommand() {
  return {
      .name = "fleet query",
      .summary = "What does the store say? In SQL, or of runs with some property.",
      .examples = R"(build/truetriad simulate -c configs/scenarios/fleet.yaml -o out/line
build/truetriad fleet run out/line -o out/day --report=false
build/truetriad fleet query --store=out/day/fleet.db --where="final_verdict = 'NO_LIMITS'")",
      .details = R"(Nothing can be changed. Without a question: of every unit the run that counts.
)",
      .flags = "store! sql where csv",
      .words = {"sql"},
      .run = RunFleetQuery};
}

}  // namespace truetriad
