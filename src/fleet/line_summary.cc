// SPDX-License-Identifier: Apache-2.0
#include "fleet/line_summary.h"

#include <algorithm>
#include <array>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "line/capability.h"
#include "line/control_chart.h"

namespace truetriad::fleet {
namespace {

struct YieldCount {
  int units = 0, good_at_first = 0, good = 0, good_without_limits = 0, good_by_decision = 0,
      runs = 0;

  void Add(const UnitCourse& course) {
    ++units;
    good_at_first += course.IsGoodAtFirst() ? 1 : 0;
    good += course.IsGood() ? 1 : 0;
    good_without_limits += course.final_verdict == Verdict::kNoLimits ? 1 : 0;
    good_by_decision += course.is_conceded ? 1 : 0;
    runs += course.attempts;
  }
  Json ToJson() const {
    return {{"units", units},
            {"good_at_first", good_at_first},
            {"good", good},
            {"good_without_limits", good_without_limits},
            {"good_by_decision", good_by_decision},
            {"runs", runs}};
  }
};

/// Yield by the value of the tag; empty if no unit has the tag.
Json CountsByTag(const LineReading& line, const std::string& tag) {
  std::map<std::string, YieldCount> counts;
  for (std::size_t i = 0; i < line.courses.size(); ++i) {
    const UnitCourse& course = line.courses[i];
    counts[tag == "station" ? course.first_station : line::TagOf(line.data.units[i], tag)].Add(
        course);
  }
  // For a station, `runs` is the number of all recordings made there, also of units that were first
  // measured elsewhere.
  if (tag == "station") {
    for (auto& [station, count] : counts) count.runs = 0;
    for (const auto& [station, recordings] : line.recordings_at) counts[station].runs = recordings;
  }
  Json list = Json::array();
  if (counts.size() == 1 && counts.contains("")) return list;
  for (const auto& [value, count] : counts) {
    list.push_back({{"value", value}});
    list.back().update(count.ToJson());
  }
  return list;
}

Json YieldOf(const LineReading& line, double confidence) {
  YieldCount all;
  int retested = 0;
  std::map<std::string, int> recorded_by;
  for (const UnitCourse& course : line.courses) {
    all.Add(course);
    retested += course.attempts > 1 ? 1 : 0;
    ++recorded_by[course.recorded_by];
  }
  Json json = all.ToJson();
  json["retested"] = retested;
  json["good_share"] = EstimateJson(line::ShareOf(all.good, all.units, confidence));
  json["good_at_first_share"] =
      EstimateJson(line::ShareOf(all.good_at_first, all.units, confidence));
  json["by_tag"] = Json::object();
  for (const char* const tag : {"lot", "station"}) {
    const Json counts = CountsByTag(line, tag);
    if (!counts.empty()) json["by_tag"][tag] = counts;
  }
  // In data.units, units whose time is unknown come first.
  const int unknown = recorded_by.contains("") ? recorded_by.at("") : 0;
  std::string first, last;
  if (unknown < all.units) {
    first = line.data.units[static_cast<std::size_t>(unknown)].recorded;
    last = line.data.units.back().recorded;
  }
  json["first"] = first;
  json["last"] = last;
  json["recorded_by"] = Json::object();
  for (const auto& [by, units] : recorded_by) {
    json["recorded_by"][by.empty() ? "nothing" : by] = units;
  }
  // Below one hour of data the rate is not meaningful.
  const double hours = (line::SecondsOf(last) - line::SecondsOf(first)) / 3600.0;
  json["units_per_hour"] = hours >= 1.0 ? (all.units - unknown - 1) / hours : line::kNotKnown;
  return json;
}

/// Reasons why units are not good, most frequent first, with their shares of those units.
Json ReasonsOf(const LineReading& line) {
  std::map<std::string, int> counts;
  int all = 0;
  for (std::size_t i = 0; i < line.courses.size(); ++i) {
    if (line.courses[i].IsGood()) continue;
    const line::UnitRecord& unit = line.data.units[i];
    ++counts[unit.code.empty() ? std::string(VerdictName(line.courses[i].final_verdict))
                               : unit.code];
    ++all;
  }
  std::vector<std::pair<std::string, int>> sorted(counts.begin(), counts.end());
  std::ranges::stable_sort(sorted, std::greater(), &std::pair<std::string, int>::second);
  Json reasons = Json::array();
  int so_far = 0;
  for (const auto& [code, units] : sorted) {
    so_far += units;
    reasons.push_back({{"code", code},
                       {"units", units},
                       {"share", units / static_cast<double>(all)},
                       {"cumulative", so_far / static_cast<double>(all)}});
  }
  return reasons;
}

Json ToJson(const line::CapabilityIndices& indices, bool is_overall, bool has_limits) {
  Json json = {{"sigma", EstimateJson(indices.sigma)}, {"dof", indices.dof}};
  if (!has_limits) return json;
  json[is_overall ? "pp" : "cp"] = EstimateJson(indices.cp);
  json[is_overall ? "ppk" : "cpk"] = EstimateJson(indices.cpk);
  json["expected_outside"] = indices.expected_outside;
  return json;
}

Json ToJson(const line::Capability::Pair& pair, bool has_limits) {
  return {{"within", ToJson(pair.within, false, has_limits)},
          {"overall", ToJson(pair.overall, true, has_limits)}};
}

Json CapabilityOf(const Quantity& quantity, double confidence) {
  const line::Capability capability = line::FindCapability({.values = quantity.values,
                                                            .sigma = quantity.sigma,
                                                            .lower = quantity.lower,
                                                            .upper = quantity.upper},
                                                           confidence);
  Json json = {{"name", quantity.name}};
  if (quantity.has_limits) {
    json["unit"] = quantity.unit;
    json["lower"] = quantity.lower;
    json["target"] = quantity.target;
    json["upper"] = quantity.upper;
    json["missed"] = quantity.missed;
    json["other_limits"] = quantity.other_limits;
    json["outside"] = capability.observed_outside;
  }
  json["units"] = capability.units;
  json["mean"] = capability.mean;
  json["lowest"] = capability.lowest;
  json["highest"] = capability.highest;
  json["normality_p"] = capability.normality_p;
  json["calibration_sigma"] = capability.calibration_sigma;
  json["observed"] = ToJson(capability.observed, quantity.has_limits);
  json["process"] = ToJson(capability.process, quantity.has_limits);
  return json;
}

/// The report as JSON: names of parameters (null: all parameters together) and serial numbers of
/// units replace their indices.
Json ChartsJson(const line::LineData& measured, const line::ChartReport& report) {
  const auto name_of = [&](int parameter) {
    return parameter < 0 ? Json() : Json(measured.parameters[static_cast<std::size_t>(parameter)]);
  };
  const auto names_of = [&](const std::vector<int>& parameters) {
    Json list = Json::array();
    for (const int parameter : parameters) list.push_back(name_of(parameter));
    return list;
  };
  const auto unit_of = [&](int unit) -> const line::UnitRecord& {
    return measured.units[static_cast<std::size_t>(unit)];
  };
  Json stations = Json::array();
  for (const line::StationCharts& station : report.stations) {
    Json charts = Json::array(), alarms = Json::array(), outliers = Json::array();
    for (const line::Chart& chart : station.charts) {
      Json points = Json::array();
      for (const line::ChartPoint& point : chart.points) {
        points.push_back({{"serial", unit_of(point.unit).serial},
                          {"recorded", unit_of(point.unit).recorded},
                          {"value", point.value},
                          {"lower", point.lower},
                          {"upper", point.upper}});
      }
      charts.push_back({{"kind", line::NameOf(chart.kind)},
                        {"parameter", name_of(chart.parameter)},
                        {"line", chart.line},
                        {"run_length", chart.run_length},
                        {"centre", chart.centre},
                        {"sigma", chart.sigma},
                        {"points", points}});
    }
    for (const line::ChartAlarm& alarm : station.alarms) {
      alarms.push_back({{"kind", line::NameOf(alarm.kind)},
                        {"parameter", name_of(alarm.parameter)},
                        {"serial", unit_of(alarm.unit).serial},
                        {"recorded", unit_of(alarm.unit).recorded},
                        {"last_serial", unit_of(alarm.last_unit).serial},
                        {"value", alarm.value},
                        {"limit", alarm.limit},
                        {"most", name_of(alarm.most)}});
    }
    for (const int unit : station.baseline_outliers) outliers.push_back(unit_of(unit).serial);
    stations.push_back({{"station", station.station},
                        {"units", station.units},
                        {"baseline_units", station.baseline_units},
                        {"baseline_outliers", outliers},
                        {"constant", names_of(station.constant)},
                        {"sparse", names_of(station.sparse)},
                        {"dependent", names_of(station.dependent)},
                        {"note", station.note},
                        {"alarms", alarms},
                        {"charts", charts}});
  }
  return stations;
}

std::string_view NameOf(GoldenState state) {
  constexpr std::array<std::string_view, 4> kNames = {"good", "disagrees", "overdue", "overdue"};
  return kNames[static_cast<std::size_t>(state)];
}

/// For each golden unit of a station: the valid checks, and the state by the last of them.
Result<Json> GoldenOf(Store& store, const SummaryOptions& options) {
  TRUETRIAD_ASSIGN_OR_RETURN(const std::vector<StationCheck> checks, store.StationChecks());
  std::map<std::pair<std::string, std::string>, std::vector<StationCheck>> by_unit;
  for (const StationCheck& check : checks) by_unit[{check.station, check.serial}].push_back(check);
  const double now_s = line::SecondsOf(options.now);
  Json stations = Json::array();
  for (const auto& [unit, of_unit] : by_unit) {
    Json list = Json::array();
    for (const StationCheck& check : of_unit) {
      list.push_back({{"serial", check.serial},
                      {"created", check.created},
                      {"recorded", check.recorded},
                      {"agrees", check.agrees},
                      {"p", check.p},
                      {"largest", check.largest},
                      {"parameter", check.parameter}});
    }
    const StationCheck& last = of_unit.back();
    stations.push_back(
        {{"station", unit.first},
         {"serial", unit.second},
         {"state", NameOf(GoldenStateOf(last, now_s, 3600.0 * options.golden_due_h))},
         {"age_h", (now_s - line::SecondsOf(last.recorded)) / 3600.0},
         {"disagreed", std::ranges::count(of_unit, false, &StationCheck::agrees)},
         {"checks", std::move(list)}});
  }
  return stations;
}

}  // namespace

Json EstimateJson(const line::Estimate& estimate) {
  return {{"value", estimate.value},
          {"lower", estimate.interval.lower},
          {"upper", estimate.interval.upper}};
}

Result<Json> Summarise(Store& store, const SummaryOptions& options) {
  TRUETRIAD_ASSIGN_OR_RETURN(LineReading line, ReadUnits(store, options.where));
  Json summary = {{"yield", YieldOf(line, options.confidence)},
                  {"reasons", ReasonsOf(line)},
                  {"limits", Json::array()},
                  {"parameters", Json::array()}};
  for (const auto& [name, checks] : line.judged) {
    summary["limits"].push_back(CapabilityOf(line.JudgedOf(name), options.confidence));
  }
  for (std::size_t place = 0; place < line.data.parameters.size(); ++place) {
    summary["parameters"].push_back(CapabilityOf(line.ParameterOf(place), options.confidence));
  }
  line.judged.clear();
  const line::LineData measured = line.TakeMeasured();
  line::ChartOptions chart_options;
  chart_options.most_points = options.chart_points;
  chart_options.baseline_units = options.baseline_units;
  summary["charts"] = ChartsJson(measured, line::ControlCharts(measured, chart_options));
  TRUETRIAD_ASSIGN_OR_RETURN(summary["golden"], GoldenOf(store, options));
  if (!options.study.empty()) {
    TRUETRIAD_ASSIGN_OR_RETURN(summary["study"], StudyOf(store, options));
  }
  return summary;
}

}  // namespace truetriad::fleet
