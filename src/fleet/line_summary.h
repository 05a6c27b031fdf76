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

/// Column of `standing`: why a unit is not good, by its run or by who decided otherwise.
inline constexpr std::string_view kReason =
    "CASE WHEN final_verdict <> verdict THEN 'decided by ' || disposed_by ELSE code END";

/// A text in SQL, whatever is in it.
std::string SqlText(std::string_view text);
/// " FROM … WHERE …": what the condition `where` is true of in the table or view `source`, with a
/// column for each tag. `where` is SQL over the columns of `standing` (of a run those of its unit)
/// and the tags, each by its name; empty: all.
std::string FromWhere(std::string_view source, const std::string& where);

/// What became of a unit, beside the run that counts.
struct UnitCourse {
  Verdict first_verdict = Verdict::kNoResult, final_verdict = Verdict::kNoResult;
  std::string first_station = {};  ///< Of its first run.
  std::string recorded_by = {};    ///< As UnitRun.
  bool is_conceded = false;        ///< Good by a person's decision, not by its run.
  int attempts = 1;

  bool IsGoodAtFirst() const { return !IsRed(first_verdict); }
  bool IsGood() const { return !IsRed(final_verdict); }
};

/// A number of all units that have it: one that limits were set on, or a parameter, which has none.
struct Quantity {
  std::string name;  ///< "accelerometer.bias.x".
  std::string unit;  ///< "m/s^2"; empty: none, or that of the log.
  bool has_limits = false;
  /// Those of the last unit; infinite: open. target: NaN where there is none.
  double lower = -std::numeric_limits<double>::infinity();
  double upper = std::numeric_limits<double>::infinity();
  double target = std::numeric_limits<double>::quiet_NaN();
  int missed = 0;                 ///< Units that were outside.
  int other_limits = 0;           ///< Units that were judged by other limits than the last.
  std::vector<int> units;         ///< Places in LineData::units.
  Eigen::VectorXd values, sigma;  ///< Of these.
};

/// Units in the order in which they were measured.
struct LineReading {
  line::LineData data;                            ///< Each unit by the run that counts.
  std::vector<UnitCourse> courses;                ///< Of data.units.
  std::map<std::string, int> recordings_at = {};  ///< By station, of the runs that are asked for.

  /// What limits were set on, by name, and a parameter by its place among the data's. Made when it
  /// is asked for: all of them together need as much memory as the units.
  Quantity JudgedOf(const std::string& name) const;
  Quantity ParameterOf(std::size_t place) const;
  /// Each unit by its first calibration at each station, whether it counts or not: with what was
  /// only good the second time, or elsewhere, a station would look better than it is. `data` is
  /// lost.
  line::LineData TakeMeasured();

  /// What a unit was judged by; target: NaN where there is none.
  struct Limits {
    double lower = 0.0, upper = 0.0, target = 0.0;
  };
  struct Judgement {
    std::uint32_t unit = 0;    ///< Place in data.units.
    std::uint32_t limits = 0;  ///< Place in `limits`, twice; one more where it is missed.
    double value = 0.0, sigma = 0.0;

    bool IsMissed() const { return limits % 2 == 1; }
  };
  std::map<std::string, std::vector<Judgement>> judged;  ///< By name.
  std::vector<Limits> limits;                            ///< Those that differ.
  /// Places of those that TakeMeasured gives, in data.units or, behind those, in `others`.
  std::vector<std::uint32_t> measured;
  std::vector<line::UnitRecord> others;
};

/// The units of the store, each by the run that counts. Needs the memory of the numbers, not that
/// of the store. Error: as Store::Query; usage: `where` is no condition.
Result<LineReading> ReadUnits(Store& store, const std::string& where = {});

/// All runs, whether they count or not, each as if it were a unit; none is measured.
Result<LineReading> ReadRuns(Store& store, const std::string& where);

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
