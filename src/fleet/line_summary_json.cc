// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cmath>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "fleet/database.h"
#include "fleet/line_summary.h"

namespace truetriad::fleet {
namespace {

Json ToJson(const line::Estimate& estimate) {
  return {{"value", estimate.value},
          {"lower", estimate.interval.lower},
          {"upper", estimate.interval.upper}};
}

Json ToJson(const YieldCount& count) {
  return {{"units", count.units},
          {"good_at_first", count.good_at_first},
          {"good", count.good},
          {"runs", count.runs}};
}

Json ToJson(const LineYield& yield) {
  Json json = ToJson(yield.all);
  json["retested"] = yield.retested;
  json["good_share"] = ToJson(yield.good_share);
  json["good_at_first_share"] = ToJson(yield.good_at_first_share);
  json["by_tag"] = Json::object();
  for (const auto& [tag, counts] : yield.by_tag) {
    for (const YieldCount& count : counts) {
      Json item = {{"value", count.value}};
      item.update(ToJson(count));
      json["by_tag"][tag].push_back(item);
    }
  }
  json["first"] = yield.first;
  json["last"] = yield.last;
  json["recorded_by"] = Json::object();
  for (const auto& [by, units] : yield.recorded_by) {
    json["recorded_by"][by.empty() ? "nothing" : by] = units;
  }
  json["units_per_hour"] = yield.units_per_hour;
  return json;
}

Json ToJson(const Reason& reason) {
  return {{"code", reason.code},
          {"units", reason.units},
          {"share", reason.share},
          {"cumulative", reason.cumulative}};
}

Json ToJson(const line::CapabilityIndices& indices, bool is_overall, bool has_limits) {
  Json json = {{"sigma", ToJson(indices.sigma)}, {"dof", indices.dof}};
  if (!has_limits) return json;
  json[is_overall ? "pp" : "cp"] = ToJson(indices.cp);
  json[is_overall ? "ppk" : "cpk"] = ToJson(indices.cpk);
  json["expected_outside"] = indices.expected_outside;
  return json;
}

Json ToJson(const line::Capability::Pair& pair, bool has_limits) {
  return {{"within", ToJson(pair.within, false, has_limits)},
          {"overall", ToJson(pair.overall, true, has_limits)}};
}

Json ToJson(const QuantitySummary& quantity) {
  const line::Capability& capability = quantity.capability;
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

Json ToJson(const line::GoldenHistory& history) {
  Json checks = Json::array();
  for (const line::StationCheck& check : history.checks) {
    checks.push_back({{"serial", check.serial},
                      {"created", check.created},
                      {"agrees", check.agrees},
                      {"p", check.p},
                      {"largest", check.largest},
                      {"parameter", check.parameter}});
  }
  return {{"station", history.station},
          {"state", GoldenStateName(history.state)},
          {"age_h", history.age_h},
          {"disagreed", history.disagreed},
          {"checks", checks}};
}

Json ToJson(const line::AnovaLine& line) {
  return {{"sum_of_squares", line.sum_of_squares},
          {"dof", line.dof},
          {"mean_square", line.mean_square},
          {"f", line.f},
          {"p", line.p}};
}

Json ToJson(const line::VarianceComponent& component) {
  return {{"variance", component.variance},
          {"lower", component.interval.lower},
          {"upper", component.interval.upper},
          {"study_share", component.study_share},
          {"tolerance_share", component.tolerance_share}};
}

Json ToJson(const line::GaugeStudy& study) {
  return {{"design", StudyDesignName(study.design)},
          {"parts", study.parts},
          {"appraisers", study.appraisers},
          {"repeats", study.repeats},
          {"anova",
           {{"part", ToJson(study.part)},
            {"appraiser", ToJson(study.appraiser)},
            {"interaction", ToJson(study.interaction)},
            {"error", ToJson(study.error)}}},
          {"interaction_pooled", study.is_pooled},
          {"components",
           {{"repeatability", ToJson(study.repeatability)},
            {"appraiser", ToJson(study.appraiser_alone)},
            {"interaction", ToJson(study.interaction_alone)},
            {"reproducibility", ToJson(study.reproducibility)},
            {"gauge", ToJson(study.gauge)},
            {"part", ToJson(study.part_to_part)},
            {"total", ToJson(study.total)}}},
          {"distinct_categories", study.distinct_categories}};
}

Json ToJson(const line::Type1Study& study) {
  return {{"runs", study.runs},
          {"mean", study.mean},
          {"sigma", ToJson(study.sigma)},
          {"reference", study.reference},
          {"bias", ToJson(study.bias)},
          {"bias_t", study.bias_t},
          {"bias_p", study.bias_p},
          {"cg", study.cg},
          {"cgk", study.cgk},
          {"repeatability_share", study.repeatability_share}};
}

Json ToJson(const QuantityStudy& study) {
  Json json = {{"name", study.name}, {"unit", study.unit}, {"tolerance", study.tolerance}};
  if (study.gauge) json["gauge"] = ToJson(*study.gauge);
  if (study.type1) json["type1"] = ToJson(*study.type1);
  if (!study.refused.empty()) json["refused"] = study.refused;
  return json;
}

/// A list of what ToJson makes of each.
template <typename T>
Json JsonListOf(const std::vector<T>& items) {
  Json list = Json::array();
  for (const T& item : items) list.push_back(ToJson(item));
  return list;
}

Json ToJson(const StudySummary& study) {
  return {{"where", study.where},
          {"by", study.by},
          {"runs", study.runs},
          {"quantities", JsonListOf(study.quantities)}};
}

/// Indices of the reports become names and serial numbers.
class ChartsJson {
 public:
  explicit ChartsJson(const LineSummary& summary) : summary_(summary) {}

  Json Stations() const {
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

/// A column of the CSV and where its number stands in a quantity's tree.
struct CsvColumn {
  std::string_view name;
  const char* place;
};
constexpr std::array<CsvColumn, 15> kNumbers = {{
    {"units", "/units"},
    {"mean", "/mean"},
    {"lowest", "/lowest"},
    {"highest", "/highest"},
    {"sigma_within", "/observed/within/sigma/value"},
    {"sigma_overall", "/observed/overall/sigma/value"},
    {"sigma_calibration", "/calibration_sigma"},
    {"process_sigma_within", "/process/within/sigma/value"},
    {"process_sigma_overall", "/process/overall/sigma/value"},
    {"normality_p", "/normality_p"},
    {"lower", "/lower"},
    {"target", "/target"},
    {"upper", "/upper"},
    {"missed", "/missed"},
    {"expected_outside", "/observed/overall/expected_outside"},
}};
/// The same of estimates: a column each for value, lower and upper end.
constexpr std::array<CsvColumn, 7> kEstimates = {{
    {"cp", "/observed/within/cp"},
    {"cpk", "/observed/within/cpk"},
    {"pp", "/observed/overall/pp"},
    {"ppk", "/observed/overall/ppk"},
    {"process_cpk", "/process/within/cpk"},
    {"process_pp", "/process/overall/pp"},
    {"process_ppk", "/process/overall/ppk"},
}};

/// ",1.25"; of what is not there, or not finite, ",".
std::string CsvNumber(const Json& quantity, const std::string& place) {
  const Json::json_pointer at(place);
  const double number = quantity.contains(at) ? quantity.at(at).get<double>() : line::kNotKnown;
  return "," + (std::isfinite(number) ? ShortestText(number) : std::string());
}

}  // namespace

Json ToJson(const LineSummary& summary) {
  Json json = {{"yield", ToJson(summary.yield)},
               {"reasons", JsonListOf(summary.reasons)},
               {"limits", JsonListOf(summary.limits)},
               {"parameters", JsonListOf(summary.parameters)}};
  json["charts"] = ChartsJson(summary).Stations();
  json["golden"] = JsonListOf(summary.golden);
  if (summary.study) json["study"] = ToJson(*summary.study);
  return json;
}

std::string SummaryCsv(const LineSummary& summary) {
  // Names are this program's own, without commas and quotes.
  const Json tree = ToJson(summary);
  std::string text = "name,kind,unit";
  for (const CsvColumn& column : kNumbers) text.append(",").append(column.name);
  for (const CsvColumn& column : kEstimates) {
    for (const char* const end : {"", "_lower", "_upper"}) {
      text.append(",").append(column.name).append(end);
    }
  }
  text += '\n';
  for (const auto& [kind, list] : {std::pair("limit", "limits"), {"parameter", "parameters"}}) {
    for (const Json& quantity : tree[list]) {
      text += quantity["name"].get<std::string>() + "," + kind + "," + quantity.value("unit", "");
      for (const CsvColumn& column : kNumbers) text += CsvNumber(quantity, column.place);
      for (const CsvColumn& column : kEstimates) {
        for (const char* const end : {"/value", "/lower", "/upper"}) {
          text += CsvNumber(quantity, std::string(column.place) + end);
        }
      }
      text += '\n';
    }
  }
  return text;
}

}  // namespace truetriad::fleet
