// SPDX-License-Identifier: Apache-2.0
#include "line/golden_history.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>
#include <utility>

#include <Eigen/Core>

#include "math/distributions.h"

namespace truetriad::line {
namespace {

constexpr double kSecondsAnHour = 3600.0;

/// The change of a straight line through the sizes of the largest differences, and its p.
void FillDrift(double confidence, GoldenHistory* history) {
  std::vector<std::pair<double, double>> points;
  for (const StationCheck& check : history->checks) {
    const double hour = SecondsOf(check.created) / kSecondsAnHour;
    // Another golden unit has differences of its own.
    if (check.serial != history->checks.back().serial) continue;
    if (std::isfinite(hour) && std::isfinite(check.largest)) {
      points.emplace_back(hour, std::abs(check.largest));
    }
  }
  constexpr std::size_t kFewest = 4;
  if (points.size() < kFewest) return;
  Eigen::VectorXd hours(std::ssize(points)), sizes(std::ssize(points));
  for (std::size_t i = 0; i < points.size(); ++i) {
    std::tie(hours[static_cast<Eigen::Index>(i)], sizes[static_cast<Eigen::Index>(i)]) = points[i];
  }
  const double span = hours.maxCoeff() - hours.minCoeff();
  hours.array() -= hours.mean();
  sizes.array() -= sizes.mean();
  const double squares = hours.squaredNorm();
  if (!(squares > 0.0)) return;
  const double slope = hours.dot(sizes) / squares;
  const double dof = static_cast<double>(points.size()) - 2.0;
  const double sigma = std::sqrt((sizes - slope * hours).squaredNorm() / dof / squares);
  const double doubt = StudentQuantile(0.5 * (1.0 + confidence), dof) * sigma;
  history->drift = {span * slope, {span * (slope - doubt), span * (slope + doubt)}};
  history->drift_span_h = span;
  const double t = slope / sigma;
  if (!std::isnan(t)) history->drift_p = FisherUpper(t * t, 1.0, dof);
}

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
                                               double due_h,
                                               double confidence) {
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
    FillDrift(confidence, &history);
    histories.push_back(std::move(history));
  }
  return histories;
}

}  // namespace truetriad::line
