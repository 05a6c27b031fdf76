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

/// Error (usage): `tag`, the value of the flag --`flag`, is not the name of a tag.
Status CheckIsTag(std::string_view flag, const std::string& tag);

/// SQL expression on `standing`: the run's code, or "decided by NAME" if a person overruled it.
inline constexpr std::string_view kReason =
    "CASE WHEN final_verdict <> verdict THEN 'decided by ' || disposed_by ELSE code END";

/// A string literal of SQL for any text.
std::string SqlText(std::string_view text);
/// The SQL " FROM … WHERE …" for the table or view `source`, with one more column for each tag.
/// Rows of `run` also get those columns of their unit in `standing` that `run` lacks. `where` is an
/// SQL condition on all these columns; empty: all rows.
std::string FromWhere(std::string_view source, const std::string& where);

/// The history of a unit besides its current run.
struct UnitCourse {
  Verdict first_verdict = Verdict::kNoResult, final_verdict = Verdict::kNoResult;
  std::string first_station = {};  ///< Of the unit's first run.
  std::string recorded_by = {};    ///< As UnitRun::recorded_by.
  bool is_conceded = false;        ///< Good by a person's decision, not by its run.
  int attempts = 1;

  bool IsGoodAtFirst() const { return !IsRed(first_verdict); }
  bool IsGood() const { return !IsRed(final_verdict); }
};

/// A quantity with limits, or a parameter without limits: its values for all units that have it.
struct Quantity {
  std::string name;  ///< "accelerometer.bias.x".
  std::string unit;  ///< "m/s^2"; empty: no unit, or the unit of the log.
  bool has_limits = false;
  /// The limits of the last device, and their target. An infinite limit means that there is none on
  /// that side, a NaN that there is no target.
  double lower = -std::numeric_limits<double>::infinity();
  double upper = std::numeric_limits<double>::infinity();
  double target = std::numeric_limits<double>::quiet_NaN();
  int missed = 0;                 ///< Number of units that missed their own limits.
  int other_limits = 0;           ///< Number of units with other limits than the last one.
  std::vector<int> units;         ///< Indices in LineData::units.
  Eigen::VectorXd values, sigma;  ///< In the order of `units`.
};

/// Units in the order of measurement.
struct LineReading {
  line::LineData data;                            ///< Each unit by its current run.
  std::vector<UnitCourse> courses;                ///< In the order of data.units.
  std::map<std::string, int> recordings_at = {};  ///< Number of recordings by station.

  /// The quantity of a limit, by its name, and of a parameter, by its index. Each is built when
  /// needed: all quantities together would take as much memory as the units.
  Quantity JudgedOf(const std::string& name) const;
  Quantity ParameterOf(std::size_t place) const;
  /// The first calibration of each unit at each station, whether its run is current or not. With
  /// current runs only, a station would look too good: later runs, also at other stations, would
  /// replace bad ones. Moves all units out of `data` and `others`.
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
  std::map<std::string, std::vector<Judgement>> judged;  ///< By name of limit.
  std::vector<Limits> limits;                            ///< Each distinct set once.
  /// The units of TakeMeasured, as indices. With n = data.units.size(), index i < n means
  /// data.units[i], and index i >= n means others[i - n].
  std::vector<std::uint32_t> measured;
  std::vector<line::UnitRecord> others;
};

/// Reads the units that `where` selects, each by its current run. Keeps only the numbers of these
/// units in memory. Errors: as Store::Query; (usage) `where` is not a valid condition.
Result<LineReading> ReadUnits(Store& store, const std::string& where = {});

/// Reads the runs that `where` selects, current or not, each as a unit. `measured` stays empty.
Result<LineReading> ReadRuns(Store& store, const std::string& where);

struct SummaryOptions {
  std::string where = {};  ///< Selects units: a condition as for FromWhere; empty: all.
  /// Selects the runs of a gauge study: a condition as for FromWhere; empty: no study. The serial
  /// numbers are the parts, the values of the tag `study_by` the appraisers.
  std::string study = {};
  std::string study_by = "operator";
  std::map<std::string, double> references =
      {};                      ///< By quantity: the known value of a study's only part.
  double golden_due_h = 24.0;  ///< Age at which a station's golden check is overdue.
  std::string now = {};        ///< Present time, ISO 8601, UTC.
  double confidence = 0.95;
  int baseline_units = 200;  ///< As ChartOptions::baseline_units.
  int chart_points = 0;      ///< Number of last points that a chart keeps.
};

/// The statistics of a line as the tree "fleet-summary" of output.json, from which text, CSV and
/// page are made. The yield counts a unit at the station of its first run, even if its current run
/// is of another station. Unknown numbers are NaN.
///
/// Errors: as ReadUnits; (usage) a condition, a tag or a quantity with a reference is unknown; (not
/// enough data) the study has too few runs; the message states what its first quantity lacks.
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
