// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace truetriad::line {

inline constexpr double kNotKnown = std::numeric_limits<double>::quiet_NaN();

/// Where a number lies with the stated confidence, half of the doubt on either side; NaN where
/// nothing can be said, infinite where a side is open.
struct Interval {
  double lower = kNotKnown, upper = kNotKnown;
};

/// A number that was estimated.
struct Estimate {
  double value = kNotKnown;
  Interval interval;
};

/// The share `count` of `all`, with the interval of Wilson (1927); NaN of none.
Estimate ShareOf(int count, int all, double confidence = 0.95);

/// One unit as the line's statistics see it: the run that counts.
struct UnitRecord {
  std::string serial = {}, run = {};
  std::string recorded = {};  // when it was measured, ISO 8601, UTC; empty: not known
  std::string code = {};      // why it is not good, as in the store
  std::map<std::string, std::string> tags = {};  // station, slot, fixture, operator, lot, ...
  Eigen::VectorXd values = {}, sigma = {};       // by LineData::parameters; NaN: not estimated
};

/// What a line has measured of its units, wherever it is kept.
struct LineData {
  std::vector<std::string> parameters = {};  // without reference.*
  std::vector<UnitRecord> units = {};        // in the order in which they were measured
};

/// What a unit's tag says; empty where it says nothing.
const std::string& TagOf(const UnitRecord& unit, const std::string& name);

/// Seconds since 1970 of an ISO 8601 moment: "2026-01-31" (its beginning), "2026-01-31T12:00",
/// "2026-01-31 12:00:00.5", each with Z or an offset ("+01:00") behind the time, or in UTC; NaN of
/// another text, or of one before 1970.
double SecondsOf(const std::string& moment);

/// "2026-01-31T12:00:00Z".
std::string MomentOf(std::int64_t seconds);

}  // namespace truetriad::line
