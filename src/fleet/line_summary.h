// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>

#include "fleet/store.h"
#include "line/line_data.h"
#include "tree/json.h"
#include "truetriad/base/result.h"

namespace truetriad::fleet {

struct SummaryOptions {
  std::string where = {};  ///< Of which units, as FromWhere; empty: all.
  /// Which runs are a gauge study, likewise; empty: none is asked for. Parts are the serial
  /// numbers, appraisers what the tag `study_by` says.
  std::string study = {};
  std::string study_by = "operator";
  std::map<std::string, double> references =
      {};                      ///< By quantity: what a study's one part is known as.
  double golden_due_h = 24.0;  ///< Age at which a station's golden check is overdue.
  std::string now = {};        ///< ISO 8601, UTC.
  double confidence = 0.95;
  int baseline_units = 200;  ///< Of control charts, as ChartOptions.
  int chart_points = 0;      ///< The last points of each control chart that are kept.
};

/// What a line's engineer asks of a store, in the order of asking: the tree "fleet-summary" of
/// output.json, from which all that is shown of it is made. Yield counts a unit at the station of
/// its first run: what failed at one and was good at another counts for the first. Numbers that are
/// not known are NaN.
///
/// Error: as ReadUnits; usage: a condition or tag that is none, or a reference is of no quantity;
/// not enough: the runs of `study` make none, and what the first quantity lacks.
Result<Json> Summarise(Store& store, const SummaryOptions& options);

/// Its member "study". Errors likewise.
Result<Json> StudyOf(Store& store, const SummaryOptions& options);
Json EstimateJson(const line::Estimate& estimate);

/// For people, in a terminal.
std::string SummaryText(const Json& summary);
/// The same tables for a page, but reasons, charts and studies, a list of {heading, header,
/// alignment ("lrr"), rows, notes}.
Json SummaryTables(const Json& summary);
/// A line a quantity and parameter.
std::string SummaryCsv(const Json& summary);

}  // namespace truetriad::fleet
