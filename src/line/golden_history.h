// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "line/line_data.h"

namespace truetriad::line {

/// By how many seconds the clocks of two machines may differ: a check that is later than now by
/// more is of a time to come.
inline constexpr double kClocksDifferS = 60.0;

/// A station measured its golden unit (`check-station`).
struct StationCheck {
  std::string station = {}, serial = {};  ///< serial: of the golden unit.
  std::string created = {};               ///< ISO 8601, UTC.
  bool agrees = false;
  double p = kNotKnown;        ///< Of all differences together.
  double largest = kNotKnown;  ///< Difference, in sigma.
  std::string parameter = {};  ///< Which that is.
};

enum class GoldenState { kGood, kOverdue, kDisagrees };
std::string_view GoldenStateName(GoldenState state);  ///< "good", "overdue", "disagrees".

/// A station by its checks.
struct GoldenHistory {
  std::string station;
  std::vector<StationCheck> checks;  ///< As they were given; at least one.
  GoldenState state = GoldenState::kGood;
  double age_h = kNotKnown;  ///< Since the last.
  int disagreed = 0;         ///< Checks that did not agree.
};

/// Each station's history at the time `now` (ISO 8601, UTC), by name, of checks in the order in
/// which they were made. A station whose last check did not agree disagrees; one that is older than
/// `due_h` hours, or of a time to come, is overdue.
std::vector<GoldenHistory> FindGoldenHistories(const std::vector<StationCheck>& checks,
                                               const std::string& now,
                                               double due_h);

}  // namespace truetriad::line
