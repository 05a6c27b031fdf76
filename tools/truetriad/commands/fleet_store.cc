// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include <gflags/gflags.h>
#include <unistd.h>

#include "base/utf8.h"
#include "fleet/collect.h"
#include "fleet/line_summary.h"
#include "fleet/log_files.h"
#include "fleet/run_table.h"
#include "fleet/store.h"
#include "fleet/unit_folders.h"
#include "io/whole_file.h"
#include "tools/truetriad/command.h"
#include "tools/truetriad/flags.h"
#include "tools/truetriad/fleet_progress.h"
#include "tools/truetriad/log_conversion.h"
#include "tools/truetriad/output_folder.h"
#include "truetriad/io/calibration_file.h"

DEFINE_string(sql, "", "SELECT: a query in SQL; docs/fleet.md describes the tables");
DEFINE_string(where,
              "",
              "CONDITION: the runs to select, as in \"final_verdict <> 'PASS' AND lot = 'L17'\"");
DEFINE_bool(csv, false, "print CSV");
DEFINE_string(runs,
              "standing",
              "WHICH: standing (the run that decides each unit's verdict) or all");
DEFINE_bool(unfinished,
            false,
            "also take files of shards that are still being written or were cut off");
DEFINE_string(unit, "", "SERIAL: the serial number of a unit in the store");
DEFINE_string(who, "", "NAME: the person who decides");
DEFINE_string(verdict, "", "VERDICT: the verdict on the unit from now on");
DEFINE_string(why, "", "TEXT: the reason for the decision, in one line");
DEFINE_bool(wrong_serial,
            false,
            "states that the log is of another unit, and that it may be run again under the serial "
            "number of that unit; to take this back, give --wrong-serial=false");
DEFINE_string(
    run,
    "",
    "RUN: the run whose serial number was wrong; needed if the unit has several recordings");

namespace truetriad {
namespace {

/// The query of --sql. Without --sql, a query for the current runs of the units that --where
/// selects.
std::string Question() {
  if (!FLAGS_sql.empty()) return FLAGS_sql;
  return "SELECT serial, final_verdict, verdict, code, first_verdict, attempts, disposed_by, "
         "recorded, recorded_by, log, folder" +
         fleet::FromWhere("standing", FLAGS_where) + " ORDER BY recorded, serial";
}

std::string CsvOf(const fleet::Table& table) {
  std::string text;
  const auto add = [&text](const auto& row, const auto& field_of) {
    for (std::size_t i = 0; i < row.size(); ++i) text += (i > 0 ? "," : "") + field_of(row[i]);
    text += '\n';
  };
  add(table.columns, fleet::CsvQuoted);
  for (const auto& row : table.rows) {
    add(row, [](const std::optional<std::string>& field) {
      return field ? fleet::CsvQuoted(*field) : "";
    });
  }
  return text;
}

/// If stdout is a terminal, replaces control characters; a file or a program gets the bytes as is.
std::string ForStdout(std::string text) {
  return isatty(STDOUT_FILENO) == 1 ? Printable(text) : std::move(text);
}

/// Any text as one line.
std::string Flat(std::string text) {
  for (char& c : text) {
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = ' ';
  }
  return text;
}

/// A cell as shown to people; for binary data, the number of bytes.
std::string Shown(const fleet::Table& table,
                  std::size_t column,
                  const std::optional<std::string>& field) {
  if (!field || !table.are_bytes[column]) return Flat(field.value_or(""));
  return "<blob " + std::to_string(field->size() / 2) + " bytes>";  // Two hex digits are one byte.
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
    return Error(ErrorCode::kConflictingArguments,
                 "--sql and --where exclude each other; give one");
  }
  TRUETRIAD_ASSIGN_OR_RETURN(const std::unique_ptr<fleet::Store> store,
                             OpenStatedToRead(!FLAGS_sql.empty()));
  TRUETRIAD_ASSIGN_OR_RETURN(const fleet::Table table, store->Query(Question()));
  if (table.rows.empty() && !FLAGS_csv) Note(FLAGS_sql.empty() ? "no units" : "no rows");
  return VerbResult{.text = FLAGS_csv ? ForStdout(CsvOf(table)) : TextOf(table),
                    .result = {{"columns", table.columns}, {"rows", JsonOf(table)}}};
}

constexpr char kStandingRuns[] = "standing", kAllRuns[] = "all";

/// Writes the table with its types beside the output, and runs the optional program that converts
/// this table to Parquet.
Result<std::size_t> ExportParquet(fleet::Store& store, const fleet::RunSelection& which) {
  TRUETRIAD_RETURN_IF_ERROR(WholeFile(FLAGS_output).status());
  TRUETRIAD_ASSIGN_OR_RETURN(const std::string program,
                             FindNodeProgram("truetriad-export-parquet", "--to=parquet"));
  const std::string table = TemporaryNameBeside(FLAGS_output);
  const auto write = [&]() -> Result<std::size_t> {
    TRUETRIAD_ASSIGN_OR_RETURN(const std::size_t runs,
                               fleet::ExportTypedTable(store, which, table));
    TRUETRIAD_ASSIGN_OR_RETURN(
        const ProgramRun run,
        RunProgram(program, {table, "--output=" + FLAGS_output}, /*captures=*/true));
    if (run.exit_code == kExitGood) return runs;
    return Error(ErrorCode::kCannotWrite, {FLAGS_output}, "cannot be written: " + run.err);
  };
  const Result<std::size_t> runs = write();
  std::error_code ignored;
  std::filesystem::remove(table, ignored);
  return runs;
}

Result<std::size_t> WriteRuns(fleet::Store& store, const fleet::RunSelection& which) {
  if (FLAGS_to == "csv") return fleet::ExportCsv(store, which, FLAGS_output);
  if (FLAGS_to == "jsonl") return fleet::ExportJsonLines(store, which, FLAGS_output);
  if (FLAGS_to == "parquet") return ExportParquet(store, which);
  return Error(ErrorCode::kUnknownName,
               "--to=" + FLAGS_to + " is not a format; expected csv, jsonl or parquet");
}

Result<VerbResult> RunFleetExport(const std::vector<std::string>&) {
  TRUETRIAD_RETURN_IF_ERROR(CheckOneOf("runs", FLAGS_runs, {kStandingRuns, kAllRuns}));
  TRUETRIAD_ASSIGN_OR_RETURN(const std::unique_ptr<fleet::Store> store, OpenStatedToRead());
  TRUETRIAD_RETURN_IF_ERROR(EnsureFolderOf(FLAGS_output));
  TRUETRIAD_ASSIGN_OR_RETURN(const std::size_t runs,
                             WriteRuns(*store, {FLAGS_runs == kStandingRuns, FLAGS_where}));
  return VerbResult{.text = FLAGS_output + ": " + std::to_string(runs) + " runs\n",
                    .result = {{"file", FLAGS_output}, {"format", FLAGS_to}, {"runs", runs}}};
}

/// The numbers of `shards`: "1, 4 and 7 further ones".
std::string ShardList(const std::vector<int>& shards) {
  constexpr std::size_t kMost = 20;  // About a line.
  std::string text;
  for (std::size_t i = 0; i < std::min(shards.size(), kMost); ++i) {
    text += (text.empty() ? "" : ", ") + std::to_string(shards[i]);
  }
  if (shards.size() > kMost) {
    text += " and " + std::to_string(shards.size() - kMost) + " further ones";
  }
  return text;
}

Result<VerbResult> RunFleetCollect(const std::vector<std::string>& sources) {
  if (sources.empty()) {
    return Error(ErrorCode::kMissingArgument,
                 "nothing to collect; name the shards' files, as in day/*.jsonl, or stores");
  }
  TRUETRIAD_ASSIGN_OR_RETURN(const fleet::Collected collected,
                             fleet::Collect(sources, FLAGS_store, FLAGS_unfinished));
  if (!collected.missing.empty()) {
    Note("note: there is no file and no run of shard " + ShardList(collected.missing) + " of " +
         std::to_string(collected.shards) + " (the first shard is 0)");
  }
  for (const std::string& source : collected.unfinished) {
    Note("note: " + source + " is not finished: units of its shard may be missing");
  }
  constexpr std::size_t kMostCopies = 10;  // Each warning takes several lines.
  for (std::size_t i = 0; i < std::min(collected.copies.size(), kMostCopies); ++i) {
    Warn(collected.copies[i] +
         "; find out which unit was measured, and state for the run of the other unit that its "
         "serial number is wrong, with `truetriad fleet dispose SERIAL --store=" +
         fleet::ShownStore(FLAGS_store) +
         " --who=NAME --verdict=FAIL --wrong-serial --run=RUN --why=WHY`");
  }
  if (collected.copies.size() > kMostCopies) {
    Warn("and " + std::to_string(collected.copies.size() - kMostCopies) +
         " further units that have the readings of another unit");
  }
  Findings warnings;
  for (const std::string& note : collected.notes) {
    Warn(note);
    warnings.push_back(fleet::WarningOf(note));
  }
  const std::string store = fleet::ShownStore(FLAGS_store);
  Json shown = Json::array();
  for (const std::string& source : sources) shown.push_back(fleet::ShownStore(source));
  return VerbResult{
      // Exit code 4: the store is complete, but files of units that may not be delivered could not
      // be changed, or units share readings.
      .exit_code =
          collected.unsafe.empty() && collected.copies.empty() ? kExitGood : kExitOutsideLimits,
      .text = std::to_string(collected.runs) + (collected.runs == 1 ? " run in " : " runs in ") +
              std::to_string(sources.size()) + (sources.size() == 1 ? " source, " : " sources, ") +
              std::to_string(collected.added) + " of them new\n  Store: " + store + '\n',
      .result = {{"sources", shown},
                 {"runs", collected.runs},
                 {"added", collected.added},
                 {"shards", collected.shards},
                 {"missing", collected.missing},
                 {"copies", collected.copies},
                 {"unfinished", collected.unfinished},
                 {"unreached", collected.unsafe},
                 {"store", store}},
      .findings = std::move(warnings)};
}

std::vector<std::string> VerdictsOfPeople() {
  std::vector<std::string> names;
  for (const Verdict verdict : fleet::kVerdictsOfPeople) {
    names.emplace_back(VerdictName(verdict));
  }
  return names;
}

Result<VerbResult> RunFleetDispose(const std::vector<std::string>&) {
  const std::optional<Verdict> verdict = VerdictFromName(FLAGS_verdict);
  if (!verdict) {
    std::string names;
    for (const std::string& name : VerdictsOfPeople()) names += (names.empty() ? "" : ", ") + name;
    return BadValue("verdict", FLAGS_verdict, " is not known; expected one of " + names);
  }
  // A misspelt name must not create a store.
  TRUETRIAD_RETURN_IF_ERROR(fleet::OpenStoreToRead(FLAGS_store));
  TRUETRIAD_ASSIGN_OR_RETURN(const std::unique_ptr<fleet::Store> store,
                             fleet::OpenStore(FLAGS_store));
  const bool says_of_serial = !gflags::GetCommandLineFlagInfoOrDie("wrong_serial").is_default;
  const fleet::Disposition disposition = {
      .id = fleet::NewRunId(),
      .serial = fleet::Trimmed(FLAGS_unit),
      .created = TimestampUtc(),
      .who = FLAGS_who,
      .why = FLAGS_why,
      .verdict = *verdict,
      .run = FLAGS_run,
      .wrong_serial = says_of_serial ? std::optional(FLAGS_wrong_serial) : std::nullopt};
  TRUETRIAD_ASSIGN_OR_RETURN(const fleet::Disposition added, store->Dispose(disposition));
  TRUETRIAD_ASSIGN_OR_RETURN(
      const fleet::Agreement agreed,
      fleet::AgreeFolders(*store, added.serial, fleet::UnitsBeside(FLAGS_store)));
  std::vector<std::string> unreached;
  for (const fleet::Unreached& one : agreed.unreached) {
    Warn(one.error.message + "; `export` of these files does not notice this decision");
    unreached.push_back(one.error.message);
  }
  TRUETRIAD_ASSIGN_OR_RETURN(const std::optional<fleet::Standing> unit,
                             store->StandingOf(added.serial));
  // If this run had a wrong serial number, another run of the unit may be current now.
  const bool has_another = added.GivesUp() && unit && unit->run != added.run;
  std::string text = has_another
                         ? added.serial + ": run " + added.run +
                               " had a wrong serial number and no longer counts; the unit is " +
                               fleet::ReasonOf(*unit)
                         : added.serial + " is " + FLAGS_verdict +
                               (added.GivesUp()      ? ", its serial number was wrong"
                                : added.wrong_serial ? ", its serial number was right"
                                                     : "") +
                               " (run " + added.run + ")";
  text += '\n';
  for (const std::string& file : agreed.withdrawn) text += "Withdrawn: " + file + '\n';
  text += verdict == Verdict::kPass ? "Export again what is needed.\n"
                                    : "Exports of this unit in other folders are unchanged.\n";
  // Exit code 4: the store is updated, but files of a unit not to be delivered are unchanged.
  return VerbResult{.exit_code = agreed.IsUnsafe() ? kExitOutsideLimits : kExitGood,
                    .text = text,
                    .result = {{"disposition", added.id},
                               {"serial", added.serial},
                               {"run", added.run},
                               {"verdict", FLAGS_verdict},
                               {"wrong_serial", added.GivesUp()},
                               {"withdrawn", agreed.withdrawn},
                               {"unreached", unreached}}};
}

}  // namespace

Command FleetQueryCommand() {
  return {
      .name = "fleet query",
      .summary = "What does the store say, in answer to SQL or about selected units?",
      .examples = R"(build/truetriad simulate -c configs/scenarios/fleet.yaml -o out/line
build/truetriad fleet run out/line -o out/day --report=false
build/truetriad fleet query --store=out/day/fleet.db --where="final_verdict = 'NO_LIMITS'")",
      .details =
          R"(A query cannot change the store. Without SQL, prints the verdict and the current run of each unit.
)",
      .flags = "store! sql where csv",
      .words = {"sql"},
      .run = RunFleetQuery};
}

Command FleetExportCommand() {
  return {
      .name = "fleet export",
      .summary = "How do I use the runs of a store in a spreadsheet or another program?",
      .examples = R"(build/truetriad simulate -c configs/scenarios/fleet.yaml -o out/line
build/truetriad fleet run out/line -o out/day --report=false
build/truetriad fleet export --store=out/day/fleet.db --to=csv -o out/day/runs.csv)",
      .details =
          R"(csv and parquet have one row per run, with value and sigma of every parameter and every quantity with a
limit. jsonl has whole runs; `fleet collect` makes the store again from the file of `--runs=all`. parquet needs Node.js.
)",
      .flags = "store=FILE! to=FORMAT! output=FILE! runs where",
      .values = {{"to", {"csv", "jsonl", "parquet"}}, {"runs", {kStandingRuns, kAllRuns}}},
      .run = RunFleetExport};
}

Command FleetCollectCommand() {
  return {
      .name = "fleet collect",
      .summary = "How do I bring the runs of several machines into one store?",
      .examples = R"(build/truetriad simulate -c configs/scenarios/fleet.yaml -o out/line
build/truetriad fleet run out/line -o out/day --report=false --shard=0/2 --store=out/day/0.jsonl
build/truetriad fleet run out/line -o out/day --report=false --shard=1/2 --store=out/day/1.jsonl
build/truetriad fleet collect out/day/0.jsonl out/day/1.jsonl --store=out/day/all.db)",
      .details =
          R"(Sources are files of runs and stores, all with the same number of shards. Collecting again adds only new
runs; the runs that the store already has stay as they are. If a source is damaged, or a shard's file is not
finished, nothing is added. One file of runs does not have all runs of a unit, so if the unit may not be
delivered, the exports of its other runs are withdrawn only when all files are collected (exit code 4 if the
exports are not here).
)",
      .flags = "store=FILE! unfinished",
      .more_words = "file",
      .run = RunFleetCollect};
}

Command FleetDisposeCommand() {
  return {
      .name = "fleet dispose",
      .summary = "How do I record a decision about a unit, whatever the verdict of its run?",
      .examples = R"(build/truetriad simulate -c configs/scenarios/fleet.yaml -o out/line
build/truetriad fleet run out/line -o out/day --report=false
build/truetriad fleet dispose B0003 --store=out/day/fleet.db --who="R. Roe" --verdict=FAIL --why="connector bent")",
      .details =
          R"(The decision holds until a later decision, or until a run of another recording becomes the unit's current
run, which `fleet run` then reports; after FAIL, that recording or a list of logs must state the later time
of measurement. FAIL withdraws the exports of all runs of the unit, and `export` refuses the unit; PASS is a
concession. Calibrations, reports and exports state the decision; the store's runs stay as they are.
Readings belong to the unit under whose serial number they were first read, until --wrong-serial states that
this number was wrong; only --wrong-serial=false takes this back.
)",
      .flags = "unit! store! verdict! wrong-serial run who! why!",
      .values = {{"verdict", VerdictsOfPeople()}},
      .words = {"unit"},
      .run = RunFleetDispose};
}

}  // namespace truetriad
