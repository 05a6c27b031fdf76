// SPDX-License-Identifier: Apache-2.0
#include "fleet/fleet_page_line.h"

#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <utility>

#include "fleet/line_summary.h"
#include "line/control_chart.h"
#include "report/format.h"

namespace truetriad::fleet {
namespace {

/// Points of a chart, the last ones: what a screen can show.
constexpr int kPointsOfChart = 400;

const line::UnitRecord& UnitOf(const line::LineData& data, int unit) {
  return data.units[static_cast<std::size_t>(unit)];
}

/// Of all together: empty.
std::string ParameterOf(const line::LineData& data, int parameter) {
  return parameter < 0 ? "" : data.parameters[static_cast<std::size_t>(parameter)];
}

Json AlarmJson(const line::LineData& data, const line::ChartAlarm& alarm) {
  return {{"kind", line::NameOf(alarm.kind)},
          {"parameter", ParameterOf(data, alarm.parameter)},
          {"most", ParameterOf(data, alarm.most)},
          {"serial", UnitOf(data, alarm.unit).serial},
          {"recorded", UnitOf(data, alarm.unit).recorded},
          {"value", alarm.value},
          {"limit", alarm.limit}};
}

Json StationJson(const line::LineData& data, const line::StationCharts& station) {
  Json alarms = Json::array();
  for (const line::ChartAlarm& alarm : station.alarms) alarms.push_back(AlarmJson(data, alarm));
  return {{"station", station.station},
          {"units", station.units},
          {"baseline", station.baseline_units},
          {"note", station.note},
          {"alarms", alarms}};
}

/// By column: what is drawn, and which unit it is of.
Json ChartJson(const line::LineData& data, const line::Chart& chart) {
  Json json = {{"kind", line::NameOf(chart.kind)},
               {"parameter", ParameterOf(data, chart.parameter)},
               {"line", chart.line},
               {"centre", chart.centre},
               {"sigma", chart.sigma},
               {"serial", Json::array()},
               {"value", Json::array()},
               {"lower", Json::array()},
               {"upper", Json::array()}};
  // Six digits are a pixel of any screen.
  const auto rounded = [](double value) -> Json {
    if (!std::isfinite(value)) return nullptr;
    return std::strtod(Significant(value, 6).c_str(), nullptr);
  };
  for (const line::ChartPoint& point : chart.points) {
    json["serial"].push_back(UnitOf(data, point.unit).serial);
    json["value"].push_back(rounded(point.value));
    json["lower"].push_back(rounded(point.lower));
    json["upper"].push_back(rounded(point.upper));
  }
  return json;
}

}  // namespace

Result<PageLine> LineOfPage(Store& store, const std::string& where) {
  SummaryOptions options{.selection = {.where = where}, .chart_points = kPointsOfChart};
  TRUETRIAD_ASSIGN_OR_RETURN(
      const Table last,
      store.Query("SELECT max(created)" + FromWhere("standing", {.where = where})));
  if (!last.rows.empty()) options.now = last.rows[0][0].value_or("");
  TRUETRIAD_ASSIGN_OR_RETURN(LineSummary summary, Summarise(store, options));
  // The page has them in a form of its own.
  const line::ChartReport charts = std::exchange(summary.charts, {});
  const Json json = ToJson(summary);
  PageLine page{.summary = {{"yield", json.at("yield")},
                            {"limits", json.at("limits")},
                            {"golden", json.at("golden")},
                            {"stations", Json::array()}}};
  for (const line::StationCharts& station : charts.stations) {
    page.summary["stations"].push_back(StationJson(summary.measured, station));
    Json& list = page.charts.emplace_back(Json::array());
    for (const line::Chart& chart : station.charts) {
      list.push_back(ChartJson(summary.measured, chart));
    }
  }
  return page;
}

}  // namespace truetriad::fleet
