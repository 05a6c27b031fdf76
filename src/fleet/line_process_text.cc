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

 private:
  std::string Name(int parameter) const {
    return summary_.measured.parameters[static_cast<std::size_t>(parameter)];
  }
  std::string Serial(int unit) const {
    return summary_.measured.units[static_cast<std::size_t>(unit)].serial;
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
    std::vector<std::string> sparse;
    if (station.charts.empty()) return text;
    for (const int parameter : station.sparse) sparse.push_back(Name(parameter));
    if (!sparse.empty()) {
      text += Wrapped(name + ": no charts of " + ListOf(sparse) + ": fewer than " +
                      std::to_string(line::kLeastBaselineUnits) + " units have a value");
    }
    return station.note.empty() ? text : text + Wrapped(name + ": " + station.note);
  }

  const LineSummary& summary_;
};

}  // namespace

std::string ProcessText(const LineSummary& summary) { return ProcessTextWriter(summary).Charts(); }

}  // namespace truetriad::fleet
