// SPDX-License-Identifier: Apache-2.0
#include "fleet/line_summary.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "fleet/line_selection.h"
#include "fleet/line_study.h"
#include "fleet/rows.h"

namespace truetriad::fleet {
namespace {

void Count(const UnitCourse& course, YieldCount* count) {
  ++count->units;
  count->good_at_first += course.IsGoodAtFirst() ? 1 : 0;
  count->good += course.IsGood() ? 1 : 0;
  count->runs += course.attempts;
}

std::vector<YieldCount> CountByTag(const LineReading& line, const std::string& tag) {
  std::map<std::string, YieldCount> counts;
  for (std::size_t i = 0; i < line.courses.size(); ++i) {
    const UnitCourse& course = line.courses[i];
    Count(course,
          &counts[tag == "station" ? course.first_station : line::TagOf(line.data.units[i], tag)]);
  }
  std::vector<YieldCount> list;
  for (auto& [value, count] : counts) {
    count.value = value;
    list.push_back(count);
  }
  // No unit says it.
  if (list.size() == 1 && list.front().value.empty()) list.clear();
  return list;
}

LineYield YieldOf(const LineReading& line, double confidence) {
  LineYield yield;
  const YieldCount& all = yield.all;
  double wall_s = 0.0, cpu_s = 0.0;
  for (const UnitCourse& course : line.courses) {
    Count(course, &yield.all);
    yield.retested += course.attempts > 1 ? 1 : 0;
    ++yield.recorded_by[course.recorded_by];
    wall_s += course.wall_s;
    cpu_s += course.cpu_s;
  }
  yield.good_share = line::ShareOf(all.good, all.units, confidence);
  yield.good_at_first_share = line::ShareOf(all.good_at_first, all.units, confidence);
  for (const char* tag : {"station", "lot"}) {
    std::vector<YieldCount> counts = CountByTag(line, tag);
    if (!counts.empty()) yield.by_tag[tag] = std::move(counts);
  }
  if (all.units == 0) return yield;
  yield.wall_s = wall_s / all.units;
  yield.cpu_s = cpu_s / all.units;
  // Units without a time come first.
  const int unknown = yield.recorded_by.contains("") ? yield.recorded_by.at("") : 0;
  if (unknown == all.units) return yield;
  yield.first = line.data.units[static_cast<std::size_t>(unknown)].recorded;
  yield.last = line.data.units.back().recorded;
  const double hours = (line::SecondsOf(yield.last) - line::SecondsOf(yield.first)) / 3600.0;
  // A line that was seen for less than an hour shows no units an hour.
  if (hours >= 1.0) yield.units_per_hour = (all.units - unknown - 1) / hours;
  return yield;
}

std::vector<Reason> ReasonsOf(const LineReading& line) {
  std::map<std::string, int> counts;
  int all = 0;
  for (std::size_t i = 0; i < line.courses.size(); ++i) {
    if (line.courses[i].IsGood()) continue;
    const line::UnitRecord& unit = line.data.units[i];
    ++counts[unit.code.empty() ? line.courses[i].final_verdict : unit.code];
    ++all;
  }
  std::vector<Reason> reasons;
  for (const auto& [code, units] : counts) {
    reasons.push_back({.code = code, .units = units, .share = units / static_cast<double>(all)});
  }
  std::stable_sort(reasons.begin(), reasons.end(), [](const Reason& one, const Reason& other) {
    return one.units > other.units;
  });
  int so_far = 0;
  for (Reason& reason : reasons) {
    so_far += reason.units;
    reason.cumulative = so_far / static_cast<double>(all);
  }
  return reasons;
}

/// The subgroups of these units; empty where successive units are one.
std::vector<std::string> SubgroupsOf(const line::LineData& data,
                                     const std::vector<int>& units,
                                     const std::string& tag) {
  std::vector<std::string> subgroups;
  if (tag.empty()) return subgroups;
  for (const int unit : units) {
    subgroups.push_back(line::TagOf(data.units[static_cast<std::size_t>(unit)], tag));
  }
  return subgroups;
}

QuantitySummary SummaryOf(const JudgedQuantity& judged,
                          const line::LineData& data,
                          const SummaryOptions& options) {
  QuantitySummary summary{.name = judged.name,
                          .unit = judged.unit,
                          .has_limits = true,
                          .lower = judged.lower,
                          .target = judged.target,
                          .upper = judged.upper,
                          .missed = judged.missed,
                          .other_limits = judged.other_limits};
  summary.capability =
      line::FindCapability({.values = judged.values,
                            .sigma = judged.sigma,
                            .subgroups = SubgroupsOf(data, judged.units, options.subgroup),
                            .lower = judged.lower,
                            .upper = judged.upper},
                           options.confidence);
  return summary;
}

QuantitySummary SummaryOfParameter(Eigen::Index parameter,
                                   const line::LineData& data,
                                   const SummaryOptions& options) {
  std::vector<int> units;
  std::vector<double> values, sigma;
  for (std::size_t i = 0; i < data.units.size(); ++i) {
    const double value = data.units[i].values[parameter];
    if (std::isnan(value)) continue;
    units.push_back(static_cast<int>(i));
    values.push_back(value);
    sigma.push_back(data.units[i].sigma[parameter]);
  }
  QuantitySummary summary{.name = data.parameters[static_cast<std::size_t>(parameter)]};
  summary.capability = line::FindCapability(
      {.values = Eigen::Map<Eigen::VectorXd>(values.data(), std::ssize(values)),
       .sigma = Eigen::Map<Eigen::VectorXd>(sigma.data(), std::ssize(sigma)),
       .subgroups = SubgroupsOf(data, units, options.subgroup)},
      options.confidence);
  return summary;
}

Result<std::vector<line::StationCheck>> ReadChecks(Store& store, const std::string& station) {
  TRUETRIAD_ASSIGN_OR_RETURN(
      const Table table,
      store.Query("SELECT station, serial, created, agrees, p, largest, parameter FROM " +
                  kChecksThatCount + " ORDER BY station_check"));
  std::vector<line::StationCheck> checks;
  for (const auto& row : table.rows) {
    const auto number = [&row](std::size_t column) {
      return row[column] ? std::strtod(row[column]->c_str(), nullptr) : line::kNotKnown;
    };
    line::StationCheck check{.station = row[0].value_or(""),
                             .serial = row[1].value_or(""),
                             .created = row[2].value_or(""),
                             .agrees = number(3) != 0.0,
                             .p = number(4),
                             .largest = number(5),
                             .parameter = row[6].value_or("")};
    if (station.empty() || check.station == station) checks.push_back(std::move(check));
  }
  return checks;
}

}  // namespace

Result<LineSummary> Summarise(Store& store, const SummaryOptions& options) {
  if (!options.subgroup.empty()) {
    TRUETRIAD_RETURN_IF_ERROR(CheckIsTag("subgroup", options.subgroup));
  }
  TRUETRIAD_ASSIGN_OR_RETURN(const LineSelection selection,
                             CheckedSelection(store, options.selection));
  TRUETRIAD_ASSIGN_OR_RETURN(LineReading line, ReadUnits(store, selection));
  LineSummary summary;
  summary.yield = YieldOf(line, options.confidence);
  summary.reasons = ReasonsOf(line);
  for (const JudgedQuantity& judged : line.judged) {
    summary.limits.push_back(SummaryOf(judged, line.data, options));
  }
  for (Eigen::Index j = 0; j < std::ssize(line.data.parameters); ++j) {
    summary.parameters.push_back(SummaryOfParameter(j, line.data, options));
  }
  TRUETRIAD_ASSIGN_OR_RETURN(const std::vector<line::StationCheck> checks,
                             ReadChecks(store, options.selection.station));
  summary.golden =
      line::FindGoldenHistories(checks, options.now, options.golden_due_h, options.confidence);
  if (!options.study.empty()) {
    TRUETRIAD_ASSIGN_OR_RETURN(summary.study, SummariseStudy(store, options));
  }
  line::ChartOptions chart_options;
  chart_options.most_points = options.chart_points;
  chart_options.baseline_units = options.baseline_units;
  summary.charts = line::ControlCharts(line.measured, chart_options);
  summary.measured = std::move(line.measured);
  return summary;
}

}  // namespace truetriad::fleet
