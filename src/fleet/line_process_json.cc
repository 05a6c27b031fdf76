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

  Json Effects() const {
    const line::EffectReport& report = summary_.effects;
    Json factors = Json::array(), effects = Json::array(), joint = Json::array(),
         spreads = Json::array();
    for (const line::FactorLevels& factor : report.factors) {
      factors.push_back({{"name", factor.name}, {"levels", factor.levels}});
    }
    for (const line::ParameterEffect& effect : report.effects) effects.push_back(OfEffect(effect));
    for (const line::JointEffect& effect : report.joint) {
      joint.push_back({{"factor", Factor(effect.factor)},
                       {"parameters", effect.parameters},
                       {"wilks", effect.wilks},
                       {"f", effect.f},
                       {"dof", effect.dof},
                       {"error_dof", effect.error_dof},
                       {"p", effect.p},
                       {"p_adjusted", effect.p_adjusted}});
    }
    for (const line::ResidualSpread& spread : report.spreads) {
      spreads.push_back({{"parameter", Name(spread.parameter)},
                         {"units", spread.units},
                         {"outliers", spread.outliers},
                         {"without_sigma", spread.without_sigma},
                         {"sigma", spread.sigma},
                         {"calibration_sigma", spread.calibration_sigma},
                         {"process_sigma", spread.process_sigma}});
    }
    return {{"factors", factors},
            {"effects", effects},
            {"joint", joint},
            {"spreads", spreads},
            {"notes", report.notes}};
  }

  Json Trends() const {
    const line::TrendReport& report = summary_.trends;
    Json trends = Json::array();
    for (const line::Trend& trend : report.trends) {
      trends.push_back({{"parameter", Name(trend.parameter)},
                        {"units", trend.units},
                        {"change", trend.change},
                        {"sigma", trend.sigma},
                        {"p", trend.p},
                        {"p_adjusted", trend.p_adjusted},
                        {"inflation", trend.inflation}});
    }
    return {
        {"first", report.first}, {"last", report.last}, {"note", report.note}, {"trends", trends}};
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
  Json Factor(int factor) const {
    return summary_.effects.factors[static_cast<std::size_t>(factor)].name;
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

  Json OfEffect(const line::ParameterEffect& effect) const {
    Json levels = Json::array();
    for (const line::LevelEffect& level : effect.levels) {
      levels.push_back({{"level", level.level},
                        {"units", level.units},
                        {"effect", level.effect},
                        {"sigma", level.sigma}});
    }
    return {{"factor", Factor(effect.factor)},
            {"parameter", Name(effect.parameter)},
            {"f", effect.f},
            {"dof", effect.dof},
            {"error_dof", effect.error_dof},
            {"p", effect.p},
            {"p_adjusted", effect.p_adjusted},
            {"sigma_between", effect.sigma_between},
            {"levels", levels}};
  }

  const LineSummary& summary_;
};

}  // namespace

Json ProcessJson(const LineSummary& summary) {
  const ProcessJsonWriter writer(summary);
  return {{"charts", writer.Charts()}, {"effects", writer.Effects()}, {"trends", writer.Trends()}};
}

}  // namespace truetriad::fleet
