// SPDX-License-Identifier: Apache-2.0
#include "line/golden_history.h"

#include <algorithm>
#include <map>
#include <utility>

namespace truetriad::line {
namespace {

constexpr double kSecondsAnHour = 3600.0;

GoldenState StateOf(const GoldenHistory& history, double due_h) {
  if (!history.checks.back().agrees) return GoldenState::kDisagrees;
  // What cannot be dated, or is of a time to come, is no check of today.
  const bool is_due = history.age_h <= due_h && history.age_h >= -kClocksDifferS / kSecondsAnHour;
  return is_due ? GoldenState::kGood : GoldenState::kOverdue;
}

}  // namespace

std::string_view GoldenStateName(GoldenState state) {
  switch (state) {
    case GoldenState::kGood:
      return "good";
    case GoldenState::kOverdue:
      return "overdue";
    case GoldenState::kDisagrees:
      return "disagrees";
  }
  return "";
}

std::vector<GoldenHistory> FindGoldenHistories(const std::vector<StationCheck>& checks,
                                               const std::string& now,
                                               double due_h) {
  std::map<std::string, GoldenHistory> by_station;
  for (const StationCheck& check : checks) by_station[check.station].checks.push_back(check);
  std::vector<GoldenHistory> histories;
  for (auto& [station, history] : by_station) {
    history.station = station;
    history.age_h = (SecondsOf(now) - SecondsOf(history.checks.back().created)) / kSecondsAnHour;
    history.disagreed = static_cast<int>(
        std::count_if(history.checks.begin(), history.checks.end(), [](const StationCheck& check) {
          return !check.agrees;
        }));
    history.state = StateOf(history, due_h);
    histories.push_back(std::move(history));
  }
  return histories;
}

}  // namespace truetriad::line
