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
    return Section("Effects of stations, slots, fixtures, operators and lots", std::move(table)) +
           Tilts();
  }

  std::string Trends() const {
    const line::TrendReport& report = summary_.trends;
    return Trends("Trends, a day", report.time) +
           Trends("Trends with temperature, a °C", report.temperature);
  }

  std::string Outliers() const {
    truetriad::Table table{{"unit", "distance", "parameter", "from the others", "p"}, "lrlrr", {}};
    for (const line::Outlier& outlier : summary_.outliers.outliers) {
      const bool is_known = !outlier.shares.empty();
      table.rows.push_back(
          {Serial(outlier.unit),
           Significant(outlier.distance, 3),
           is_known ? Name(outlier.shares.front().parameter) : "",
           is_known ? Significant(outlier.shares.front().conditional, 3) + " σ" : "",
           Probability(outlier.p_adjusted)});
    }
    return Section("Units unlike the others, over all parameters", std::move(table));
  }

 private:
  std::string Name(int parameter) const {
    return summary_.data.parameters[static_cast<std::size_t>(parameter)];
  }
  std::string Serial(int unit) const {
    return summary_.data.units[static_cast<std::size_t>(unit)].serial;
  }
  std::string Factor(int factor) const {
    return summary_.effects.factors[static_cast<std::size_t>(factor)].name;
  }

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

  std::string Trends(const std::string& heading, const std::vector<line::Trend>& trends) const {
    truetriad::Table table{{"parameter", "slope", "in all", "p"}, "lrrr", {}};
    for (const line::Trend& trend : trends) {
      if (!(trend.p_adjusted < kDoubt)) continue;
      table.rows.push_back({Name(trend.parameter),
                            WithSigma(trend.slope, trend.sigma),
                            Significant(trend.change, 3),
                            Probability(trend.p_adjusted)});
    }
    return Section(heading, std::move(table));
  }

  const LineSummary& summary_;
};

}  // namespace

std::string ProcessText(const LineSummary& summary) {
  const ProcessTextWriter writer(summary);
  return writer.Charts() + writer.Effects() + writer.Trends() + writer.Outliers();
}

}  // namespace truetriad::fleet
