// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

namespace truetriad::line {

/// One unit as the line's statistics see it: the run that counts.
struct UnitRecord {
  std::string serial = {}, run = {};
  std::string recorded = {};            // when it was measured, ISO 8601, UTC; empty: not known
  std::string verdict = {}, code = {};  // as in the store
  std::map<std::string, std::string> tags = {};  // station, slot, fixture, operator, lot, ...
  Eigen::VectorXd values = {}, sigma = {};       // by LineData::parameters; NaN: not estimated
};

/// What a line has measured of its units, wherever it is kept.
struct LineData {
  std::vector<std::string> parameters = {};  // without reference.*
  std::vector<UnitRecord> units = {};        // in the order in which they were measured
};

/// Where `parameter` stands in `parameters`.
std::optional<Eigen::Index> PlaceOf(const LineData& data, std::string_view parameter);

/// What a unit's tag says; empty where it says nothing.
const std::string& TagOf(const UnitRecord& unit, const std::string& name);

}  // namespace truetriad::line
