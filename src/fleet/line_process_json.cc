// SPDX-License-Identifier: Apache-2.0
#include <string>
#include <vector>

#include "fleet/line_summary_parts.h"

namespace truetriad::fleet {
namespace {

/// Indices of the reports become names and serial numbers.
class ProcessJsonWriter {
 public:
  explicit ProcessJsonWriter(const LineSummary& summary) : summary_(summary) {}

  Json Charts() const {
    Json stations = Json::array();
    for (const line::StationCharts& station : summary_.charts.stations) {
      Json charts = Json::array(), alarms = Json::array(), outliers = Json::array();
      for (const line::Chart& chart : station.charts) charts.push_back(OfChart(chart));
      for (const line::ChartAlarm& alarm : station.alarms) alarms.push_back(OfAlarm(alarm));
      for (const int unit : station.baseline_outliers) outliers.push_back(Measured(unit).serial);
      stations.push_back({{"station", station.station},
                          {"units", station.units},
                          {"baseline_units", station.baseline_units},
                          {"baseline_outliers", outliers},
                          {"constant", Names(station.constant)},
                          {"sparse", Names(station.sparse)},
                          {"dependent", Names(station.dependent)},
                          {"note", station.note},
                          {"alarms", alarms},
                          {"charts", charts}});
    }
    return stations;
  }

 private:
  /// Null: of all parameters together.
  Json Name(int parameter) const {
    if (parameter < 0) return nullptr;
    return summary_.measured.parameters[static_cast<std::size_t>(parameter)];
  }
  Json Names(const std::vector<int>& parameters) const {
    Json list = Json::array();
    for (const int parameter : parameters) list.push_back(Name(parameter));
    return list;
  }
  const line::UnitRecord& Measured(int unit) const {
    return summary_.measured.units[static_cast<std::size_t>(unit)];
  }
  Json OfChart(const line::Chart& chart) const {
    Json points = Json::array();
    for (const line::ChartPoint& point : chart.points) {
      points.push_back({{"serial", Measured(point.unit).serial},
                        {"recorded", Measured(point.unit).recorded},
                        {"value", point.value},
                        {"lower", point.lower},
                        {"upper", point.upper}});
    }
    return {{"kind", line::NameOf(chart.kind)},
            {"parameter", Name(chart.parameter)},
            {"line", chart.line},
            {"run_length", chart.run_length},
            {"centre", chart.centre},
            {"sigma", chart.sigma},
            {"points", points}};
  }

  Json OfAlarm(const line::ChartAlarm& alarm) const {
    return {{"kind", line::NameOf(alarm.kind)},
            {"parameter", Name(alarm.parameter)},
            {"serial", Measured(alarm.unit).serial},
            {"recorded", Measured(alarm.unit).recorded},
            {"last_serial", Measured(alarm.last_unit).serial},
            {"value", alarm.value},
            {"limit", alarm.limit},
            {"most", Name(alarm.most)}};
  }

  const LineSummary& summary_;
};

}  // namespace

Json ProcessJson(const LineSummary& summary) {
  return {{"charts", ProcessJsonWriter(summary).Charts()}};
}

}  // namespace truetriad::fleet
