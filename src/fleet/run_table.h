// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "fleet/store.h"
#include "fleet/unit_run.h"
#include "io/whole_file.h"
#include "truetriad/base/result.h"

namespace truetriad::fleet {

// Runs as files for other programs. All of them take a store's runs one after the other; memory
// does not grow with their number. Errors as Store::ForEachRun, and (bad input) the file cannot be
// written; what cannot be written whole is not there. The number of runs is returned.

/// A field of CSV, in quotation marks where it has commas, quotation marks or ends of lines.
std::string CsvQuoted(const std::string& text);

/// A row a run: what it is, what its unit amounts to where the run counts, its tags, of each
/// parameter the value and, as NAME.sigma, the standard uncertainty, and, as NAME.judged, of what
/// limits are for the value in true units; empty where a run has none. RFC 4180, UTF-8, with a
/// first row of names. A text that a spreadsheet would take for a formula has an apostrophe in
/// front.
Result<std::size_t> ExportCsv(Store& store, const RunSelection& which, const std::string& path);

/// The lines of json_lines.h: whole runs with what was decided about them, all checks of stations
/// and the retest policy, from which `fleet collect` makes the store again.
Result<std::size_t> ExportJsonLines(Store& store,
                                    const RunSelection& which,
                                    const std::string& path);

/// The same table as the CSV, for truetriad-export-parquet: a line of JSON with the columns,
/// [{"name": …, "type": "STRING" | "INT64" | "DOUBLE" | "TIMESTAMP"}, …], then a list a run;
/// integers as text, which JSON's numbers do not hold, times as in the store.
Result<std::size_t> ExportTypedTable(Store& store,
                                     const RunSelection& which,
                                     const std::string& path);

}  // namespace truetriad::fleet
