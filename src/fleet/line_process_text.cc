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

/// Rank correlation of temperature and time from which on a trend of one shows as one of the other.
constexpr double kConfounded = 0.3;

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
    return text + Tilts();
  }

  std::string Trends() const {
    const line::TrendReport& report = summary_.trends;
    if (report.time.empty()) return Sentence("Trends: none looked for; it takes more units");
    const std::string text =
        Trends(report.by_time ? "over time, a day" : "along the line, a unit", report.time);
    if (report.temperature.empty()) return text;
    const double together = report.temperature_with_time;
    return text + Trends("with temperature, a °C", report.temperature) +
           (std::abs(together) < kConfounded
                ? ""
                : Wrapped(std::string("Temperatures ") + (together > 0.0 ? "rose" : "fell") +
                          " with time (rank correlation " + Significant(together, 2) +
                          "): what is a trend with one of them may be one with the other"));
  }

  std::string Outliers() const {
    truetriad::Table table{{"unit", "distance", "parameter", "from the others", "p"}, "lrlrr", {}};
    for (const line::Outlier& outlier : summary_.outliers.outliers) {
      const bool is_known = !outlier.shares.empty();
      table.rows.push_back(
          {summary_.data.units[static_cast<std::size_t>(outlier.unit)].serial,
           Significant(outlier.distance, 3),
           is_known ? Name(outlier.shares.front().parameter) : "",
           is_known ? Significant(outlier.shares.front().conditional, 3) + " σ" : "",
           Probability(outlier.p_adjusted)});
    }
    int units = 0;
    for (const line::OutlierSet& set : summary_.outliers.sets) units += set.units;
    std::string text = Section("Units unlike the others, over all parameters", std::move(table));
    if (text.empty() && units > 0) {
      text = Sentence("Outliers: none of " + std::to_string(units) + " units is unlike the others");
    }
    if (text.empty()) text = Sentence("Outliers: no unit is held against others");
    for (const std::string& note : summary_.outliers.notes) text += Wrapped(note);
    return text;
  }

 private:
  std::string Name(int parameter) const {
    return summary_.data.parameters[static_cast<std::size_t>(parameter)];
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

  std::string Tilts() const {
    truetriad::Table table{{"of", "at", "x", "y", "z", "p"}, "llrrrr", {}};
    for (const line::FactorTilt& tilt : summary_.effects.tilts) {
      for (const line::LevelTilt& level : tilt.levels) {
        if (!(level.p_adjusted < kDoubt)) continue;
        std::vector<std::string> row = {Factor(tilt.factor), level.level};
        for (int i = 0; i < 3; ++i) {
          row.push_back(WithSigma(1e3 * level.rotation_rad[i], 1e3 * level.sigma_rad[i]));
        }
        row.push_back(Probability(level.p_adjusted));
        table.rows.push_back(std::move(row));
      }
    }
    return Section("Tilts that units share, mrad", std::move(table));
  }

  std::string Trends(const std::string& where, const std::vector<line::Trend>& trends) const {
    truetriad::Table table{{"parameter", "slope", "in all", "p"}, "lrrr", {}};
    for (const line::Trend& trend : trends) {
      if (!(trend.p_adjusted < kDoubt)) continue;
      table.rows.push_back({Name(trend.parameter),
                            WithSigma(trend.slope, trend.sigma),
                            Significant(trend.change, 3),
                            Probability(trend.p_adjusted)});
    }
    return table.rows.empty() ? Sentence("Trends " + where + ": none seen (p < 0.01)")
                              : Section("Trends " + where, std::move(table));
  }

  const LineSummary& summary_;
};

}  // namespace

std::string ProcessText(const LineSummary& summary) {
  const ProcessTextWriter writer(summary);
  return writer.Charts() + writer.Effects() + writer.Trends() + writer.Outliers();
}

}  // namespace truetriad::fleet
