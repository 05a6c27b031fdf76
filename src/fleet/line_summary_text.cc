// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "fleet/line_summary.h"
#include "report/format.h"
#include "report/table.h"

namespace truetriad::fleet {
namespace {

/// Rows of a table that a terminal shows; the rest is in JSON and CSV.
constexpr std::size_t kMostRows = 12;
/// Below this p, what was assumed is doubted.
constexpr double kDoubt = 0.01;

/// A heading and the first rows below it; nothing of none.
std::string Section(const std::string& heading, truetriad::Table table) {
  if (table.rows.empty()) return "";
  const std::size_t count = table.rows.size();
  table.rows.resize(std::min(count, kMostRows));
  std::string text = '\n' + heading + '\n' + TextOf(table);
  if (count > kMostRows) text += "  and " + std::to_string(count - kMostRows) + " more (--json)\n";
  return text;
}

std::string Counted(int count, const std::string& thing) {
  return std::to_string(count) + ' ' + thing + (count == 1 ? "" : "s");
}

/// "97.3 % (96.5 to 97.9 %)".
std::string ShareText(const line::Estimate& share) {
  if (std::isnan(share.value)) return "n/a";
  return Percent(share.value) + " (" + Significant(100.0 * share.interval.lower, 3) + " to " +
         Percent(share.interval.upper) + ")";
}

std::string IndexText(double index) {
  return std::isnan(index) ? "" : index > 99.0 ? "> 99" : Fixed(index, 2);
}

/// "1.21…1.45".
std::string RangeText(const line::Interval& interval) {
  return std::isnan(interval.lower) ? ""
                                    : IndexText(interval.lower) + "…" + IndexText(interval.upper);
}

/// "9819 ppm", of more than one in a hundred "35.9 %".
std::string ExpectedText(double share) {
  if (std::isnan(share)) return "";
  if (share >= 0.01) return Percent(share);
  return share < 1e-6 ? "< 1 ppm" : Significant(std::round(1e6 * share), 4) + " ppm";
}

/// A number of a limit: nothing where that side is open.
std::string SideText(double side) { return std::isfinite(side) ? Significant(side, 4) : ""; }

/// "measured 2026-11-24T06:00:00Z to …, 12 units an hour; 30 units by the time of the file".
std::string MeasuredText(const LineYield& yield) {
  std::string text = yield.first.empty() ? "" : "measured " + yield.first + " to " + yield.last;
  const double rate = yield.units_per_hour;
  if (!std::isnan(rate)) {
    text += ", " + (rate < 1000.0 ? Significant(rate, 3) : Fixed(rate, 0)) + " units an hour";
  }
  for (const auto& [by, what] : {std::pair("list", " by the list"),
                                 {"recording", " by the recording's own time"},
                                 {"file", " by the time of the file"},
                                 {"", ": nothing says when it was measured"}}) {
    const auto units = yield.recorded_by.find(by);
    if (units == yield.recorded_by.end()) continue;
    text += (text.empty() ? "" : "; ") + Counted(units->second, "unit") + what;
  }
  return text;
}

std::string YieldText(const LineYield& yield) {
  if (yield.all.units == 0) return "NO UNITS\n";
  std::string text = std::to_string(yield.all.good) + " OF " + std::to_string(yield.all.units) +
                     " GOOD: " + ShareText(yield.good_share) + "\n";
  text += Wrapped("at first: " + ShareText(yield.good_at_first_share) + "; " +
                  Counted(yield.retested, "unit") + " measured again, " +
                  Counted(yield.all.runs, "recording") + " in all");
  text += Wrapped(MeasuredText(yield));
  for (const auto& [tag, counts] : yield.by_tag) {
    truetriad::Table table{{tag, "units", "at first", "good", "recordings"}, "lrrrr", {}};
    for (const YieldCount& count : counts) {
      table.rows.push_back({count.value.empty() ? "(none)" : count.value,
                            std::to_string(count.units),
                            Percent(count.good_at_first / static_cast<double>(count.units)),
                            Percent(count.good / static_cast<double>(count.units)),
                            std::to_string(count.runs)});
    }
    text += Section("Yield by " + tag, std::move(table));
  }
  return text;
}

std::string ReasonsText(const std::vector<Reason>& reasons) {
  truetriad::Table table{{"units", "share", "so far", "reason"}, "rrrl", {}};
  for (const Reason& reason : reasons) {
    table.rows.push_back({std::to_string(reason.units),
                          Percent(reason.share),
                          Percent(reason.cumulative),
                          reason.code});
  }
  return Section("Why units are not good", std::move(table));
}

/// Those with limits, that with the least Ppk first.
std::vector<const QuantitySummary*> WorstFirst(const std::vector<QuantitySummary>& limits) {
  std::vector<const QuantitySummary*> list;
  for (const QuantitySummary& quantity : limits) list.push_back(&quantity);
  const auto rank = [](const QuantitySummary* quantity) {
    const double ppk = quantity->capability.observed.overall.cpk.value;
    return std::isnan(ppk) ? std::numeric_limits<double>::infinity() : ppk;
  };
  std::stable_sort(
      list.begin(), list.end(), [&rank](const QuantitySummary* one, const QuantitySummary* other) {
        return rank(one) < rank(other);
      });
  return list;
}

std::string LimitsText(const std::vector<QuantitySummary>& limits) {
  truetriad::Table spread{
      {"quantity", "lower", "mean", "σ", "of calibration", "upper", "unit"}, "lrrrrrl", {}};
  truetriad::Table capability{
      {"quantity", "missed", "Cpk", "Ppk", "95 %", "process", "95 %", "outside"}, "lrrrrrrr", {}};
  std::string doubted, changed;
  for (const QuantitySummary* quantity : WorstFirst(limits)) {
    const line::Capability& found = quantity->capability;
    spread.rows.push_back({quantity->name,
                           SideText(quantity->lower),
                           Significant(found.mean, 4),
                           Significant(found.observed.overall.sigma.value, 3),
                           Significant(found.calibration_sigma, 2),
                           SideText(quantity->upper),
                           DisplayUnit(quantity->unit)});
    if (std::isnan(found.observed.overall.cpk.value)) continue;  // Of one unit there is none.
    capability.rows.push_back({quantity->name,
                               std::to_string(quantity->missed),
                               IndexText(found.observed.within.cpk.value),
                               IndexText(found.observed.overall.cpk.value),
                               RangeText(found.observed.overall.cpk.interval),
                               IndexText(found.process.overall.cpk.value),
                               RangeText(found.process.overall.cpk.interval),
                               ExpectedText(found.observed.overall.expected_outside)});
    if (found.normality_p < kDoubt) doubted += (doubted.empty() ? "" : ", ") + quantity->name;
    if (quantity->other_limits > 0) changed += (changed.empty() ? "" : ", ") + quantity->name;
  }
  std::string text = Section("Distributions against limits", std::move(spread));
  text +=
      Section("Capability (process: without the variance of calibration)", std::move(capability));
  if (!doubted.empty()) {
    text +=
        Wrapped("Not normal (p < 0.01), which the share outside and intervals assume: " + doubted);
  }
  if (!changed.empty()) {
    text += Wrapped("Limits have changed; judged here by those of the last unit: " + changed);
  }
  return text;
}

/// "a, b, c, d and 3 more (--json)".
std::string ListOf(const std::vector<std::string>& items) {
  constexpr std::size_t kMostItems = 4;
  std::string list;
  for (std::size_t k = 0; k < std::min(items.size(), kMostItems); ++k) {
    list += (k == 0 ? "" : ", ") + items[k];
  }
  if (items.size() <= kMostItems) return list;
  return list + " and " + std::to_string(items.size() - kMostItems) + " more (--json)";
}
/// The last alarms first: they are what is to be done now.
std::string ChartsText(const LineSummary& summary) {
  const auto name_of = [&summary](int parameter) {
    return summary.measured.parameters[static_cast<std::size_t>(parameter)];
  };
  const auto serial_of = [&summary](int unit) {
    return summary.measured.units[static_cast<std::size_t>(unit)].serial;
  };
  truetriad::Table table{
      {"station", "chart", "parameter", "from unit", "to unit", "value", "limit"}, "llllrrr", {}};
  std::vector<std::pair<int, std::vector<std::string>>> rows;
  std::string quiet;
  for (const line::StationCharts& station : summary.charts.stations) {
    const std::string name = station.station.empty() ? "(no station)" : station.station;
    if (station.charts.empty()) {
      quiet += Wrapped(name + ": " + (station.note.empty() ? "no charts" : station.note));
    } else {
      std::vector<std::string> sparse;
      for (const int parameter : station.sparse) sparse.push_back(name_of(parameter));
      if (station.alarms.empty()) {
        quiet += Wrapped(name + ": in control, " + std::to_string(station.units) + " units, " +
                         std::to_string(station.charts.size()) + " charts");
      }
      if (!sparse.empty()) {
        quiet += Wrapped(name + ": no charts of " + ListOf(sparse) + ": fewer than " +
                         std::to_string(line::kLeastBaselineUnits) + " units have a value");
      }
      if (!station.note.empty()) quiet += Wrapped(name + ": " + station.note);
    }
    for (const line::ChartAlarm& alarm : station.alarms) {
      const std::string most = alarm.most < 0 ? "" : ", most " + name_of(alarm.most);
      rows.emplace_back(
          alarm.unit,
          std::vector<std::string>{name,
                                   line::NameOf(alarm.kind),
                                   alarm.parameter < 0 ? "all" + most : name_of(alarm.parameter),
                                   serial_of(alarm.unit),
                                   serial_of(alarm.last_unit),
                                   Significant(alarm.value, 3),
                                   Significant(alarm.limit, 3)});
    }
  }
  std::stable_sort(rows.begin(), rows.end(), [](const auto& one, const auto& other) {
    return one.first > other.first;
  });
  for (auto& [unit, row] : rows) table.rows.push_back(std::move(row));
  const std::string heading = "Control charts";
  return quiet.empty() || !table.rows.empty() ? Section(heading, std::move(table)) + quiet
                                              : '\n' + heading + '\n' + quiet;
}

/// "12 min", "5.3 h", "9.1 days".
std::string AgeText(double hours) {
  if (hours < 0.0) return "to come";  // A clock is wrong.
  if (hours < 1.0) return Fixed(60.0 * hours, 0) + " min";
  return hours < 72.0 ? Significant(hours, 2) + " h" : Significant(hours / 24.0, 3) + " days";
}

std::string GoldenText(const std::vector<line::GoldenHistory>& histories) {
  truetriad::Table table{
      {"station", "golden unit", "state", "last check", "age", "p", "largest"}, "lllrrrr", {}};
  for (const line::GoldenHistory& history : histories) {
    const line::StationCheck& last = history.checks.back();
    table.rows.push_back({history.station,
                          last.serial,
                          std::string(GoldenStateName(history.state)),
                          last.created,
                          AgeText(history.age_h),
                          Probability(last.p),
                          Significant(last.largest, 3) + " σ"});
  }
  return Section("Golden units", std::move(table));
}

/// Those with limits where there are any: what a parameter says is nearly the same again.
std::vector<const QuantityStudy*> ShownOf(const StudySummary& study) {
  std::vector<const QuantityStudy*> all, with_limits;
  for (const QuantityStudy& quantity : study.quantities) {
    all.push_back(&quantity);
    if (quantity.has_limits) with_limits.push_back(&quantity);
  }
  return with_limits.empty() ? all : with_limits;
}

std::string GaugeText(const StudySummary& study) {
  truetriad::Table table{{"quantity",
                          "of study",
                          "of tolerance",
                          "repeat",
                          "reproduce",
                          "categories",
                          "parts p",
                          study.by + " p"},
                         "lrrrrrrr",
                         {}};
  const QuantityStudy* first = nullptr;
  for (const QuantityStudy* quantity : ShownOf(study)) {
    if (!quantity->gauge) continue;
    if (first == nullptr) first = quantity;
    const line::GaugeStudy& gauge = *quantity->gauge;
    const auto share = [](double value) {
      return std::isnan(value) ? "" : value < 5e-5 ? "< 0.01 %" : Percent(value);
    };
    table.rows.push_back({quantity->name,
                          share(gauge.gauge.study_share),
                          share(gauge.gauge.tolerance_share),
                          share(gauge.repeatability.study_share),
                          share(gauge.reproducibility.study_share),
                          std::to_string(gauge.distinct_categories),
                          Probability(gauge.part.p),
                          std::isnan(gauge.appraiser.p) ? "" : Probability(gauge.appraiser.p)});
  }
  if (first == nullptr) return "";
  const line::GaugeStudy& gauge = *first->gauge;
  std::string heading = "Gauge study, " + std::string(StudyDesignName(gauge.design)) + ": " +
                        std::to_string(gauge.parts) + " parts, ";
  if (gauge.appraisers > 1) {
    heading += Counted(gauge.appraisers, study.by) + ", ";
  }
  return Section(heading + std::to_string(gauge.repeats) + " runs each", std::move(table));
}

std::string Type1Text(const StudySummary& study) {
  truetriad::Table table{
      {"quantity", "mean", "σ", "reference", "bias", "p", "Cg", "Cgk", "unit"}, "lrrrrrrrl", {}};
  for (const QuantityStudy* quantity : ShownOf(study)) {
    if (!quantity->type1) continue;
    const line::Type1Study& type1 = *quantity->type1;
    table.rows.push_back({quantity->name,
                          Significant(type1.mean, 5),
                          Significant(type1.sigma.value, 3),
                          std::isnan(type1.reference) ? "" : Significant(type1.reference, 5),
                          std::isnan(type1.bias.value) ? "" : Significant(type1.bias.value, 3),
                          std::isnan(type1.bias_p) ? "" : Probability(type1.bias_p),
                          IndexText(type1.cg),
                          IndexText(type1.cgk),
                          quantity->has_limits ? DisplayUnit(quantity->unit) : "of the log"});
  }
  return Section("Type-1 study: " + Counted(study.runs, "run") + " of one unit", std::move(table));
}

std::string StudyText(const StudySummary& study) {
  std::string text = GaugeText(study) + Type1Text(study);
  for (const QuantityStudy& quantity : study.quantities) {
    if (!quantity.refused.empty()) text += Wrapped(quantity.name + ": " + quantity.refused);
  }
  return text;
}

}  // namespace

std::string SummaryText(const LineSummary& summary) {
  std::string text = YieldText(summary.yield) + ReasonsText(summary.reasons) +
                     LimitsText(summary.limits) + ChartsText(summary) + GoldenText(summary.golden);
  if (summary.study) text += StudyText(*summary.study);
  return text;
}

}  // namespace truetriad::fleet
