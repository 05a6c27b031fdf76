// SPDX-License-Identifier: Apache-2.0
#include "fleet/rows.h"

#include <array>
#include <charconv>
#include <cmath>
#include <utility>

#include "fleet/schema.h"
#include "json/verb_json.h"

namespace truetriad::fleet {
namespace {

Value Text(std::string_view text) { return text; }
Value Integer(std::int64_t number) { return number; }
/// Open sides of limits, and numbers that are none, are NULL.
Value Real(double number) { return std::isfinite(number) ? Value(number) : Value(); }

void Append(const Finding& finding,
            std::string_view run,
            std::int64_t place,
            std::vector<Value>* values) {
  constexpr std::string_view kAxes = "xyz";
  const Json json = ToJson(finding);
  values->insert(
      values->end(),
      {run,
       place,
       FindingCodeName(finding.code),
       SeverityName(finding.severity),
       finding.sensor ? Text(TriadName(*finding.sensor)) : Value(),
       finding.axis ? Text(kAxes.substr(static_cast<std::size_t>(*finding.axis), 1)) : Value(),
       finding.pose ? Integer(*finding.pose) : Value(),
       Text(finding.text),
       finding.remedy.empty() ? Value() : Text(finding.remedy),
       json.contains("values")
           ? Value(json["values"].dump(-1, ' ', false, Json::error_handler_t::replace))
           : Value(),
       finding.treatment == Treatment::kNone ? Value() : Text(TreatmentName(finding.treatment))});
}

void Append(const LimitCheck& check,
            std::string_view run,
            std::int64_t place,
            std::vector<Value>* values) {
  values->insert(values->end(),
                 {run,
                  place,
                  Text(check.name),
                  Text(check.component),
                  Real(check.limit.lower),
                  check.limit.target ? Real(*check.limit.target) : Value(),
                  Real(check.limit.upper),
                  Real(check.worst),
                  Real(check.sigma),
                  Real(check.outside),
                  Integer(check.pass ? 1 : 0)});
}

void Append(const InputFile& input,
            std::string_view run,
            std::int64_t place,
            std::vector<Value>* values) {
  values->insert(values->end(),
                 {run, place, Text(input.file), Text(input.sha256), Integer(input.samples)});
}

void Append(const Parameter& parameter,
            std::string_view run,
            std::int64_t place,
            std::vector<Value>* values) {
  values->insert(values->end(),
                 {run, place, Text(parameter.name), parameter.value, parameter.sigma});
}

/// One row an item, numbered from 1 on.
template <typename Items>
TableRows RowsOfItems(std::string_view table,
                      std::size_t columns,
                      std::string_view run,
                      const Items& items) {
  TableRows rows{table, columns, {}};
  rows.values.reserve(columns * items.size());
  std::int64_t place = 0;
  for (const auto& item : items) Append(item, run, ++place, &rows.values);
  return rows;
}

TableRows RowsOfTags(const UnitRun& run) {
  TableRows rows{"tag", 3, {}};
  const auto add = [&](const TagKey& tag) {
    if ((run.tags.*tag.value).empty()) return;
    rows.values.insert(rows.values.end(), {Text(run.id), tag.key, Text(run.tags.*tag.value)});
  };
  for (const TagKey& tag : kDeviceTags) add(tag);
  for (const TagKey& tag : kRunTags) add(tag);
  return rows;
}

}  // namespace

std::vector<TableRows> RowsOf(const UnitRun& run) {
  return {{"unit", 1, {Text(run.serial)}},
          {kRunTable,
           21,
           {Text(run.id),
            Text(run.serial),
            Text(run.log),
            Integer(run.log_bytes),
            Integer(run.log_modified_ns),
            Text(run.created),
            Text(run.software_version),
            Text(run.config_sha256),
            Text(run.shard),
            Text(run.folder),
            VerdictName(run.verdict),
            Text(run.code),
            Text(run.message),
            Text(run.mode),
            Real(run.wall_s),
            Real(run.cpu_s),
            Real(run.effective_dof),
            run.covariance.empty() ? Value() : Value(&run.covariance),
            Real(run.temperature_degc),
            Text(run.recorded),
            Text(run.recorded_by)}},
          RowsOfTags(run),
          RowsOfItems("input", 5, run.id, run.inputs),
          RowsOfItems("parameter", 5, run.id, run.parameters),
          RowsOfItems("finding", 11, run.id, run.findings),
          RowsOfItems("judgement", 11, run.id, run.judgements)};
}

TableRows RowOf(const Disposition& disposition) {
  return {"disposition",
          6,
          {Text(disposition.id),
           Text(disposition.run),
           Text(disposition.created),
           Text(disposition.who),
           VerdictName(disposition.verdict),
           Text(disposition.why)}};
}

TableRows RowOf(const StationCheck& check) {
  return {"station_check",
          11,
          {Text(check.id),
           Text(check.station),
           Text(check.serial),
           Text(check.created),
           Integer(check.agrees ? 1 : 0),
           Real(check.p),
           Real(check.largest),
           Text(check.parameter),
           Text(check.log),
           Text(check.recording),
           Text(check.repeatability)}};
}

TableRows FactRow(std::string_view name, std::string_view value) {
  return {"fact", 2, {name, value}};
}

std::string InsertStatement(std::string_view table, std::size_t columns, std::size_t rows) {
  std::string sql = "INSERT INTO ";
  sql.append(table).append(" VALUES ");
  std::size_t number = 0;
  for (std::size_t row = 0; row < rows; ++row) {
    for (std::size_t column = 0; column < columns; ++column) {
      sql += column > 0 ? ", $" : row > 0 ? "), ($" : "($";
      sql += std::to_string(++number);
    }
  }
  return sql + ") ON CONFLICT DO NOTHING";
}

std::string RunsOfSameReadings(std::size_t files) {
  std::string runs;
  for (std::size_t i = 0; i < files; ++i) {
    runs += (i > 0 ? " INTERSECT " : "") +
            ("SELECT run FROM input WHERE samples > 0 AND sha256 = $" + std::to_string(i + 3));
  }
  return "SELECT run, serial, log FROM run WHERE serial <> $1 AND log <> $2 AND "
         "verdict <> 'NO_RESULT' AND run IN (" +
         runs + ") ORDER BY run LIMIT 100";
}

std::string MigrationsFrom(std::int64_t version, const TypeNames& types) {
  std::string sql;
  for (; version < kSchemaVersion; ++version) {
    sql += kMigrations.at(static_cast<std::size_t>(version));
  }
  for (const auto& [from, to] :
       {std::pair<std::string_view, std::string_view>{"{text}", types.text},
        {"{real}", types.real},
        {"{bytes}", types.bytes}}) {
    for (std::size_t at = 0; (at = sql.find(from, at)) != std::string::npos; at += to.size()) {
      sql.replace(at, from.size(), to);
    }
  }
  return sql;
}

Status CheckSchemaVersion(const std::string& store, std::int64_t version) {
  if (version <= kSchemaVersion) return {};
  return Error(ErrorCode::kStoreFailure,
               {store},
               "has version " + std::to_string(version) +
                   " of the tables, and this program knows " + std::to_string(kSchemaVersion) +
                   "; use the newer truetriad that wrote it");
}

Status CheckShards(const std::string& name, std::int64_t there, std::int64_t stated) {
  if (there == stated) return {};
  return Error(ErrorCode::kConflictingArguments,
               name + ": its runs are shared among " + std::to_string(there) + ", not " +
                   std::to_string(stated) + "; give --shard=I/" + std::to_string(there) +
                   ", or another store");
}

std::string ShortestText(double number) {
  std::array<char, 32> text{};
  return {text.data(), std::to_chars(text.data(), text.data() + text.size(), number).ptr};
}

std::string HexOf(std::span<const unsigned char> bytes) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string text;
  text.reserve(2 * bytes.size());
  for (const unsigned char byte : bytes) text += {kDigits[byte >> 4], kDigits[byte & 15U]};
  return text;
}

}  // namespace truetriad::fleet
