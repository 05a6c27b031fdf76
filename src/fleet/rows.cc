// SPDX-License-Identifier: Apache-2.0
#include "fleet/rows.h"

#include <array>
#include <charconv>
#include <cmath>

#include "fleet/schema.h"

namespace truetriad::fleet {
namespace {

constexpr std::string_view kInsertUnit = "INSERT INTO unit VALUES ($1) ON CONFLICT DO NOTHING";
constexpr std::string_view kInsertRun =
    "INSERT INTO run VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13, $14, $15, "
    "$16, $17, $18) ON CONFLICT DO NOTHING";
constexpr std::string_view kInsertTag = "INSERT INTO tag VALUES ($1, $2, $3)";
constexpr std::string_view kInsertInput = "INSERT INTO input VALUES ($1, $2, $3, $4, $5)";
constexpr std::string_view kInsertParameter = "INSERT INTO parameter VALUES ($1, $2, $3, $4, $5)";
constexpr std::string_view kInsertFinding =
    "INSERT INTO finding VALUES ($1, $2, $3, $4, $5, $6, $7, $8)";
constexpr std::string_view kInsertJudgement =
    "INSERT INTO judgement VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11)";

Value Text(std::string_view text) { return text; }
Value Integer(std::int64_t number) { return number; }
/// Open sides of limits, and numbers that are none, are NULL.
Value Real(double number) { return std::isfinite(number) ? Value(number) : Value(); }

Row RowOf(const Finding& finding, std::string_view run, Value place) {
  constexpr std::string_view kAxes = "xyz";
  return {kInsertFinding,
          {run,
           place,
           FindingCodeName(finding.code),
           SeverityName(finding.severity),
           finding.sensor ? Text(TriadName(*finding.sensor)) : Value(),
           finding.axis ? Text(kAxes.substr(static_cast<std::size_t>(*finding.axis), 1)) : Value(),
           finding.pose ? Integer(*finding.pose) : Value(),
           Text(finding.text)}};
}

Row RowOf(const LimitCheck& check, std::string_view run, Value place) {
  return {kInsertJudgement,
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
           Integer(check.pass ? 1 : 0)}};
}

}  // namespace

std::vector<Row> RowsOf(const UnitRun& run) {
  const std::string_view id = run.id;
  std::vector<Row> rows;
  rows.push_back({kInsertUnit, {Text(run.serial)}});
  rows.push_back({kInsertRun,
                  {id,
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
                   run.covariance.empty() ? Value() : Value(&run.covariance)},
                  /*is_run=*/true});
  const auto add_tag = [&](const TagKey& tag) {
    if (!(run.tags.*tag.value).empty()) {
      rows.push_back({kInsertTag, {id, tag.key, Text(run.tags.*tag.value)}});
    }
  };
  for (const TagKey& tag : kDeviceTags) add_tag(tag);
  for (const TagKey& tag : kRunTags) add_tag(tag);
  // Numbered from 1 on.
  std::int64_t place = 0;
  for (const InputFile& input : run.inputs) {
    rows.push_back({kInsertInput,
                    {id, ++place, Text(input.file), Text(input.sha256), Integer(input.samples)}});
  }
  place = 0;
  for (const Parameter& parameter : run.parameters) {
    rows.push_back(
        {kInsertParameter, {id, ++place, Text(parameter.name), parameter.value, parameter.sigma}});
  }
  place = 0;
  for (const Finding& finding : run.findings) rows.push_back(RowOf(finding, id, ++place));
  place = 0;
  for (const LimitCheck& check : run.judgements) rows.push_back(RowOf(check, id, ++place));
  return rows;
}

std::string MigrationFrom(int version, const TypeNames& types) {
  std::string sql(kMigrations.at(static_cast<std::size_t>(version)));
  for (const auto& [from, to] :
       {std::pair<std::string_view, std::string_view>{"{real}", types.real},
        {"{bytes}", types.bytes}}) {
    for (std::size_t at = 0; (at = sql.find(from, at)) != std::string::npos; at += to.size()) {
      sql.replace(at, from.size(), to);
    }
  }
  return sql;
}

Status CheckSchemaVersion(const std::string& store, std::int64_t version) {
  if (version <= kSchemaVersion) return {};
  return Error(ErrorCode::kCannotWrite,
               {store},
               "has version " + std::to_string(version) +
                   " of the tables, and this program knows " + std::to_string(kSchemaVersion) +
                   "; use the newer truetriad that wrote it");
}

Status CheckShards(const std::string& store, const std::string& there, const std::string& stated) {
  if (there == stated) return {};
  return Error(ErrorCode::kConflictingArguments,
               store + ": its runs are shared among " + there + ", not " + stated +
                   "; give --shard=I/" + there + ", or another store");
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
