// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <memory>
#include <string>
#include <system_error>
#include <vector>

#include <gflags/gflags.h>

#include "fleet/run_table.h"
#include "fleet/store.h"
#include "io/input_guard.h"
#include "io/whole_file.h"
#include "tools/truetriad/command.h"
#include "tools/truetriad/flags.h"
#include "tools/truetriad/fleet_flags.h"
#include "tools/truetriad/log_conversion.h"
#include "tools/truetriad/output_folder.h"
#include "truetriad/io/calibration_file.h"

DEFINE_string(runs,
              "standing",
              "WHICH: of which runs: standing, those that count, one a unit; or all");

namespace truetriad {
namespace {

constexpr char kStandingRuns[] = "standing", kAllRuns[] = "all";

/// Writes the typed table beside the output, and has the program of the optional part make Parquet
/// of it.
Result<std::size_t> ExportParquet(fleet::Store& store, const fleet::RunSelection& which) {
  if (InputGuard::Holds(FLAGS_output)) return InputGuard::Refusal(FLAGS_output);
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
  TRUETRIAD_ASSIGN_OR_RETURN(const std::unique_ptr<fleet::Store> store,
                             fleet::OpenStoreToRead(FLAGS_store));
  if (!FLAGS_where.empty()) TRUETRIAD_RETURN_IF_ERROR(store->AllowTypedText());
  TRUETRIAD_RETURN_IF_ERROR(EnsureFolderOf(FLAGS_output));
  TRUETRIAD_ASSIGN_OR_RETURN(const std::size_t runs,
                             WriteRuns(*store, {FLAGS_runs == kStandingRuns, FLAGS_where}));
  return VerbResult{.text = FLAGS_output + ": " + std::to_string(runs) + " runs\n",
                    .result = {{"file", FLAGS_output}, {"format", FLAGS_to}, {"runs", runs}}};
}

}  // namespace

Command FleetExportCommand() {
  return {
      .name = "fleet export",
      .summary = "How do I use the runs of a store in a spreadsheet or another program?",
      .examples = R"(build/truetriad simulate -c configs/scenarios/fleet.yaml -o out/line
build/truetriad fleet run out/line -o out/day --report=false
build/truetriad fleet export --store=out/day/fleet.db --to=csv -o out/day/runs.csv)",
      .details =
          R"(csv and parquet: a row a run, with the value and sigma of every parameter, and with what is judged. jsonl:
whole runs, from which `fleet collect` makes the store again; of all runs with --runs=all. parquet needs Node.js.
)",
      .flags = "store=FILE! to=FORMAT! output=FILE! runs where",
      .values = {{"to", {"csv", "jsonl", "parquet"}}, {"runs", {kStandingRuns, kAllRuns}}},
      .run = RunFleetExport};
}

}  // namespace truetriad
