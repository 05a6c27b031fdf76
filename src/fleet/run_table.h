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

/// One row for each run: its fields, the standing of its unit if the run counts, its tags, for each
/// parameter the value and its standard uncertainty (NAME.sigma), and for each quantity with limits
/// the value in true units (NAME.judged); empty where a run lacks them. RFC 4180, UTF-8, with a row
/// of names. A text that a spreadsheet would take for a formula is preceded by an apostrophe.
Result<std::size_t> ExportCsv(Store& store, const RunSelection& which, const std::string& path);

/// The lines of json_lines.h: complete runs with their decisions, all checks of stations and the
/// retest policy, from which `fleet collect` rebuilds the store.
Result<std::size_t> ExportJsonLines(Store& store,
                                    const RunSelection& which,
                                    const std::string& path);

/// The table of the CSV for truetriad-export-parquet: a line of JSON with the columns, [{"name": …,
/// "type": "STRING" | "INT64" | "DOUBLE" | "TIMESTAMP"}, …], then a list for each run; integers are
/// text, since JSON's numbers cannot hold all, times are as in the store.
Result<std::size_t> ExportTypedTable(Store& store,
                                     const RunSelection& which,
                                     const std::string& path);

}  // namespace truetriad::fleet
