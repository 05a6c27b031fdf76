// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "fleet/store.h"
#include "line/line_data.h"
#include "tree/json.h"
#include "truetriad/base/result.h"

namespace truetriad::fleet {

/// Error (usage): `tag`, which `flag` states, is not the name of a tag.
Status CheckIsTag(std::string_view flag, const std::string& tag);

/// SQL expression on `standing`: why a unit is not good, by its run or by a person's decision.
inline constexpr std::string_view kReason =
    "CASE WHEN final_verdict <> verdict THEN 'decided by ' || disposed_by ELSE code END";

/// A string literal of SQL for any text.
std::string SqlText(std::string_view text);
/// " FROM … WHERE …" over the table or view `source` with a column for each tag. `where` is a
/// condition in SQL on the columns of `standing` (for a run those of its unit) and the tags by
/// their names; empty: all rows.
std::string FromWhere(std::string_view source, const std::string& where);

/// The history of a unit besides its current run.
struct UnitCourse {
  Verdict first_verdict = Verdict::kNoResult, final_verdict = Verdict::kNoResult;
  std::string first_station = {};  ///< Of its first run.
  std::string recorded_by = {};    ///< As UnitRun::recorded_by.
  bool is_conceded = false;        ///< Good by a person's decision, not by its run.
  int attempts = 1;

  bool IsGoodAtFirst() const { return !IsRed(first_verdict); }
  bool IsGood() const { return !IsRed(final_verdict); }
};

/// A quantity with limits, or a parameter without limits: its values for all units that have it.
struct Quantity {
  std::string name;  ///< "accelerometer.bias.x".
  std::string unit;  ///< "m/s^2"; empty: none, or that of the log.
  bool has_limits = false;
  /// The limits of the last unit; infinite: open. target: NaN if there is none.
  double lower = -std::numeric_limits<double>::infinity();
  double upper = std::numeric_limits<double>::infinity();
  double target = std::numeric_limits<double>::quiet_NaN();
  int missed = 0;                 ///< Units outside the limits.
  int other_limits = 0;           ///< Units with other limits than the last.
  std::vector<int> units;         ///< Indices in LineData::units.
  Eigen::VectorXd values, sigma;  ///< By `units`.
};

/// Units in the order of measurement.
struct LineReading {
  line::LineData data;                            ///< Each unit by its current run.
  std::vector<UnitCourse> courses;                ///< By data.units.
  std::map<std::string, int> recordings_at = {};  ///< Number of recordings by station.

  /// The quantity of a limit by name, or of a parameter by index. Each is built when needed, since
  /// all together take as much memory as the units.
  Quantity JudgedOf(const std::string& name) const;
  Quantity ParameterOf(std::size_t place) const;
  /// Each unit by its first calibration at each station, current or not: a station would look too
  /// good if units that were good only at a second attempt or elsewhere counted. Consumes `data`.
  line::LineData TakeMeasured();

  /// The limits of a judgement; target: NaN if there is none.
  struct Limits {
    double lower = 0.0, upper = 0.0, target = 0.0;
  };
  struct Judgement {
    std::uint32_t unit = 0;    ///< Index in data.units.
    std::uint32_t limits = 0;  ///< Twice the index in `limits`, plus 1 if missed.
    double value = 0.0, sigma = 0.0;

    bool IsMissed() const { return limits % 2 == 1; }
  };
  std::map<std::string, std::vector<Judgement>> judged;  ///< By name.
  std::vector<Limits> limits;                            ///< Each distinct set once.
  /// The units of TakeMeasured: indices in data.units, or, from its size on, in `others`.
  std::vector<std::uint32_t> measured;
  std::vector<line::UnitRecord> others;
};

/// The units of the store, each by its current run. Memory holds their numbers, not the store.
/// Error: as Store::Query; usage: `where` is not a valid condition.
Result<LineReading> ReadUnits(Store& store, const std::string& where = {});

/// All runs, current or not, each as if it were a unit; `measured` is empty.
Result<LineReading> ReadRuns(Store& store, const std::string& where);

struct SummaryOptions {
  std::string where = {};  ///< Selects units, as FromWhere; empty: all.
  /// Selects the runs of a gauge study, likewise; empty: no study. Parts are the serial numbers,
  /// appraisers the values of the tag `study_by`.
  std::string study = {};
  std::string study_by = "operator";
  std::map<std::string, double> references =
      {};                      ///< By quantity: the known value of a study's only part.
  double golden_due_h = 24.0;  ///< Age at which a station's golden check is overdue.
  std::string now = {};        ///< ISO 8601, UTC.
  double confidence = 0.95;
  int baseline_units = 200;  ///< Of control charts, as ChartOptions.
  int chart_points = 0;      ///< The number of last points kept of each chart.
};

/// The statistics of a line in the order of interest: the tree "fleet-summary" of output.json, from
/// which all views are made. Yield counts a unit at the station of its first run, even if another
/// station's run is good. Unknown numbers are NaN.
///
/// Error: as ReadUnits; usage: an invalid condition or tag, or a reference for an unknown quantity;
/// not enough: too few runs of `study`; the message states what the first quantity lacks.
Result<Json> Summarise(Store& store, const SummaryOptions& options);

/// The member "study" of the tree of Summarise. Errors as there.
Result<Json> StudyOf(Store& store, const SummaryOptions& options);
Json EstimateJson(const line::Estimate& estimate);

/// The summary as text for a terminal.
std::string SummaryText(const Json& summary);
/// The tables of SummaryText, without reasons, charts and studies, for a page: a list of {heading,
/// header, alignment ("lrr"), rows, notes}.
Json SummaryTables(const Json& summary);
/// One line for each quantity and parameter.
std::string SummaryCsv(const Json& summary);

}  // namespace truetriad::fleet
