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

/// A confidence interval with equal probability on both sides. If the interval is unknown, both
/// bounds are NaN; if a side is open, its bound is infinite.
struct Interval {
  double lower = kNotKnown, upper = kNotKnown;
};

/// An estimated number with its interval.
struct Estimate {
  double value = kNotKnown;
  Interval interval;
};

/// The share count / all, with the interval of Wilson (1927); NaN if `all` is 0.
Estimate ShareOf(int count, int all, double confidence = 0.95);

/// One unit in the line's statistics: its current run.
struct UnitRecord {
  std::string serial = {}, run = {};
  std::string recorded = {};  // time of measurement, ISO 8601, UTC; empty: unknown
  std::string code = {};      // why the unit is not good, as in the store
  std::map<std::string, std::string> tags = {};  // station, slot, fixture, operator, lot, ...
  Eigen::VectorXd values = {}, sigma = {};       // one per LineData::parameters; NaN: none
};

/// The measurements of a line's units, wherever they are stored.
struct LineData {
  std::vector<std::string> parameters = {};  // names; reference.* are left out
  std::vector<UnitRecord> units = {};        // in the order in which they were measured
};

/// The value of a unit's tag; empty if the unit lacks it.
const std::string& TagOf(const UnitRecord& unit, const std::string& name);

/// Seconds since 1970 of a time in ISO 8601: "2026-01-31" (the beginning of the day),
/// "2026-01-31T12:00", "2026-01-31 12:00:00.5". Z or an offset ("+01:00") may follow the time;
/// without an offset the time is in UTC. NaN for other texts and for times before 1970.
double SecondsOf(const std::string& moment);

/// The time `seconds` after the beginning of 1970, as "2026-01-31T12:00:00Z".
std::string MomentOf(std::int64_t seconds);

}  // namespace truetriad::line
