// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "fleet/line_reader.h"
#include "fleet/store.h"
#include "line/capability.h"
#include "line/control_chart.h"
#include "line/gauge_study.h"
#include "line/golden_history.h"
#include "tree/json.h"
#include "truetriad/base/result.h"

namespace truetriad::fleet {

struct SummaryOptions {
  std::string where = {};  ///< Of which units, as FromWhere; empty: all.
  /// Which runs are a gauge study, likewise; empty: none is asked for.
  std::string study = {};
  std::string study_by = "operator";  ///< Tag: the appraisers of the study.
  std::map<std::string, double> references =
      {};                      ///< By quantity: what a study's one part is known as.
  double golden_due_h = 24.0;  ///< Age at which a station's golden check is overdue.
  std::string now = {};        ///< ISO 8601, UTC.
  double confidence = 0.95;
  int baseline_units = 200;  ///< Of control charts, as ChartOptions.
  int chart_points = 0;      ///< The last points of each control chart that are kept.
};

struct YieldCount {
  /// Of the tag; of stations that of a unit's first run: what failed at one and was good at another
  /// counts for the first. Empty: all units, or those without it.
  std::string value = {};
  int units = 0, good_at_first = 0, good = 0, runs = 0;
};

struct LineYield {
  YieldCount all;
  line::Estimate good_share, good_at_first_share;
  /// "station", "lot": where units have it.
  std::map<std::string, std::vector<YieldCount>> by_tag;
  int retested = 0;  ///< Units with more than one run.
  /// When the first unit and the last were measured; empty: no unit's time is known.
  std::string first, last;
  std::map<std::string, int> recorded_by;   ///< Units, by what says that; empty: nothing does.
  double units_per_hour = line::kNotKnown;  ///< Between those; NaN: less than an hour.
};

/// Why units are not good, most frequent first.
struct Reason {
  std::string code = {};
  int units = 0;
  double share = 0.0, cumulative = 0.0;  ///< Of the units that are not good.
};

/// A quantity, without what its units have.
struct QuantitySummary : Quantity {
  line::Capability capability = {};
};

/// A gauge study of one quantity; type1 where the runs are of one part.
struct QuantityStudy {
  std::string name = {}, unit = {};
  bool has_limits = false;
  double tolerance = line::kNotKnown;  ///< Between two limits.
  std::optional<line::GaugeStudy> gauge = {};
  std::optional<line::Type1Study> type1 = {};
  std::string refused = {};  ///< Why there is neither.
};

struct StudySummary {
  std::string where = {}, by = {};
  int runs = 0;
  std::vector<QuantityStudy> quantities =
      {};  ///< Those with limits, then the parameters that vary.
};

/// What a line's engineer asks of a store, in the order of asking.
struct LineSummary {
  LineYield yield;
  std::vector<Reason> reasons;
  std::vector<QuantitySummary> limits;      ///< By name.
  std::vector<QuantitySummary> parameters;  ///< In the order of the data.
  line::ChartReport charts;
  std::vector<line::GoldenHistory> golden;
  std::optional<StudySummary> study;
  line::LineData measured;  ///< What the indices of charts are of.
};

/// Error: as ReadUnits; usage: a condition or tag that is none; not
/// enough: the runs of `study` make none.
Result<LineSummary> Summarise(Store& store, const SummaryOptions& options);

/// The gauge study of the runs that `options.study` selects: parts are the serial numbers,
/// appraisers what the tag `options.study_by` says. Error (not enough): no quantity makes a study,
/// and what the first lacks; usage: a reference is of no quantity.
Result<StudySummary> SummariseStudy(Store& store, const SummaryOptions& options);

/// As in output.json, "fleet-summary"; without `measured`.
Json ToJson(const LineSummary& summary);
/// For people, in a terminal.
std::string SummaryText(const LineSummary& summary);
/// A line a quantity and parameter.
std::string SummaryCsv(const LineSummary& summary);

}  // namespace truetriad::fleet
