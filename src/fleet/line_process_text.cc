// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "fleet/line_summary_parts.h"
#include "report/format.h"

namespace truetriad::fleet {
namespace {

/// Indices of the reports become names and serial numbers.
class ProcessTextWriter {
 public:
  explicit ProcessTextWriter(const LineSummary& summary) : summary_(summary) {}

  /// The last alarms first: they are what is to be done now.
  std::string Charts() const {
    truetriad::Table table{
        {"station", "chart", "parameter", "from unit", "to unit", "value", "limit"}, "llllrrr", {}};
    std::vector<std::pair<int, std::vector<std::string>>> rows;
    std::string quiet;
    for (const line::StationCharts& station : summary_.charts.stations) {
      const std::string name = station.station.empty() ? "(no station)" : station.station;
      if (station.charts.empty()) {
        quiet += Wrapped(name + ": " + (station.note.empty() ? "no charts" : station.note));
      } else if (station.alarms.empty()) {
        quiet += Wrapped(name + ": in control, " + std::to_string(station.units) + " units, " +
                         std::to_string(station.charts.size()) + " charts");
      }
      quiet += AboutCharts(name, station);
      for (const line::ChartAlarm& alarm : station.alarms) {
        const bool is_joint = alarm.parameter < 0;
        rows.emplace_back(
            alarm.unit,
            std::vector<std::string>{
                name,
                line::NameOf(alarm.kind),
                is_joint ? "all" + (alarm.most < 0 ? "" : ", most " + Name(alarm.most))
                         : Name(alarm.parameter),
                Serial(alarm.unit),
                Serial(alarm.last_unit),
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

  std::string Effects() const {
    truetriad::Table table{{"of", "upon", "largest at", "effect", "p"}, "lllrr", {}};
    for (const line::ParameterEffect& effect : summary_.effects.effects) {
      if (!(effect.p_adjusted < kDoubt)) continue;
      const auto largest =
          std::max_element(effect.levels.begin(),
                           effect.levels.end(),
                           [](const line::LevelEffect& one, const line::LevelEffect& other) {
                             return !(std::abs(one.effect) >= std::abs(other.effect));
                           });
      if (largest == effect.levels.end()) continue;
      table.rows.push_back({Factor(effect.factor),
                            Name(effect.parameter),
                            largest->level,
                            WithSigma(largest->effect, largest->sigma),
                            Probability(effect.p_adjusted)});
    }
    const std::vector<std::string>& notes = summary_.effects.notes;
    std::string text =
        Section("Effects of " + Factors() + " (in the log's units)", std::move(table));
    if (text.empty()) {
      text = Sentence(summary_.effects.effects.empty()
                          ? "Effects: none looked for; it takes a tag (station, slot, fixture, "
                            "operator, lot) with two values at least, and more units than these"
                          : "Effects of " + Factors() + ": none seen (p < 0.01)");
    }
    for (const std::string& note : notes) text += Wrapped(note);
    return text;
  }

  /// A change from the first unit to the last: what an hour showed says nothing of a day.
  std::string Trends() const {
    const line::TrendReport& report = summary_.trends;
    const std::string note = report.note.empty() ? "" : Wrapped(report.note);
    if (report.trends.empty()) {
      return Sentence("Trends: none looked for; it takes more units with a time") + note;
    }
    truetriad::Table table{{"parameter", "change", "p"}, "lrr", {}};
    for (const line::Trend& trend : report.trends) {
      if (!(trend.p_adjusted < kDoubt)) continue;
      table.rows.push_back({Name(trend.parameter),
                            WithSigma(trend.change, trend.sigma),
                            Probability(trend.p_adjusted)});
    }
    const std::string when = report.first + " to " + report.last;
    return (table.rows.empty() ? Sentence("Trends, " + when + ": none seen (p < 0.01)")
                               : Section("Trends, " + when, std::move(table))) +
           note;
  }

 private:
  std::string Name(int parameter) const {
    return summary_.measured.parameters[static_cast<std::size_t>(parameter)];
  }
  std::string Serial(int unit) const {
    return summary_.measured.units[static_cast<std::size_t>(unit)].serial;
  }
  std::string Factor(int factor) const {
    return summary_.effects.factors[static_cast<std::size_t>(factor)].name;
  }
  /// "station, lot".
  std::string Factors() const {
    std::string names;
    for (const line::FactorLevels& factor : summary_.effects.factors) {
      names += (names.empty() ? "" : ", ") + factor.name;
    }
    return names;
  }
  /// "a, b, c, d and 3 more (--json)".
  static std::string ListOf(const std::vector<std::string>& items) {
    constexpr std::size_t kMostItems = 4;
    std::string list;
    for (std::size_t k = 0; k < std::min(items.size(), kMostItems); ++k) {
      list += (k == 0 ? "" : ", ") + items[k];
    }
    if (items.size() <= kMostItems) return list;
    return list + " and " + std::to_string(items.size() - kMostItems) + " more (--json)";
  }
  /// What a station's charts do not show, and what they are held against.
  std::string AboutCharts(const std::string& name, const line::StationCharts& station) const {
    std::string text;
    std::vector<std::string> shifts, sparse;
    for (const line::ChartAlarm& alarm : station.alarms) {
      if (alarm.kind != line::ChartKind::kBaseline) continue;
      shifts.push_back((alarm.parameter < 0 ? "all together" : Name(alarm.parameter)) + " by " +
                       Significant(alarm.value, 2) + " σ at unit " + Serial(alarm.unit));
    }
    if (!shifts.empty()) {
      text += Wrapped(name + ": the first " + std::to_string(station.baseline_units) +
                      " units, which should say what is normal, are not in control themselves (" +
                      ListOf(shifts) +
                      "), so the units judge each other there; begin after the shift (--since), or "
                      "end the baseline before it (--baseline). This takes units as independent: "
                      "lots that differ, or units like their neighbours, show as a shift, too");
    }
    if (station.charts.empty()) return text;
    for (const int parameter : station.sparse) sparse.push_back(Name(parameter));
    if (!sparse.empty()) {
      text += Wrapped(name + ": no charts of " + ListOf(sparse) + ": fewer than " +
                      std::to_string(line::kLeastBaselineUnits) + " units have a value");
    }
    return station.note.empty() ? text : text + Wrapped(name + ": " + station.note);
  }
  /// In place of a table.
  static std::string Sentence(const std::string& text) { return '\n' + text + '\n'; }

  const LineSummary& summary_;
};

}  // namespace

std::string ProcessText(const LineSummary& summary) {
  const ProcessTextWriter writer(summary);
  return writer.Charts() + writer.Effects() + writer.Trends();
}

}  // namespace truetriad::fleet
