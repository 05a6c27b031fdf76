// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "fleet/store.h"
#include "fleet/unit_run.h"
#include "io/whole_file.h"
#include "truetriad/base/result.h"

namespace truetriad::fleet {

// Export of runs to files for other programs. Runs are read one after another, so memory does not
// grow with their number. Errors as Store::ForEachRun, and (bad input) the file cannot be written;
// an incomplete file is not kept. The functions return the number of runs.

/// A field of CSV, quoted if it contains commas, quotation marks or ends of lines.
std::string CsvQuoted(const std::string& text);

/// Writes CSV (RFC 4180, UTF-8) with a row of column names and a row for each run: its fields; the
/// standing of its unit if the run is current; its tags; for each parameter the value and its
/// standard uncertainty (NAME.sigma); and for each quantity with limits the value in true units
/// (NAME.judged). A cell is empty if the run has no such value. An apostrophe precedes a text that
/// a spreadsheet would take for a formula.
Result<std::size_t> ExportCsv(Store& store, const RunSelection& which, const std::string& path);

/// Writes a file of runs (json_lines.h): complete runs with their decisions, all checks of stations
/// and the retest policy. `fleet collect` rebuilds the store from this file.
Result<std::size_t> ExportJsonLines(Store& store,
                                    const RunSelection& which,
                                    const std::string& path);

/// Writes the table of ExportCsv for truetriad-export-parquet. The first line is a JSON list of
/// columns, [{"name": …, "type": "STRING" | "INT64" | "DOUBLE" | "TIMESTAMP"}, …]; each further
/// line is a list with the values of a run. Integers are text, so that no digit is lost.
Result<std::size_t> ExportTypedTable(Store& store,
                                     const RunSelection& which,
                                     const std::string& path);

}  // namespace truetriad::fleet
