// SPDX-License-Identifier: Apache-2.0
#include "line/line_data.h"

#include <algorithm>

namespace truetriad::line {

std::optional<Eigen::Index> PlaceOf(const LineData& data, std::string_view parameter) {
  const auto at = std::find(data.parameters.begin(), data.parameters.end(), parameter);
  if (at == data.parameters.end()) return std::nullopt;
  return at - data.parameters.begin();
}

const std::string& TagOf(const UnitRecord& unit, const std::string& name) {
  static const std::string kNone;
  const auto at = unit.tags.find(name);
  return at == unit.tags.end() ? kNone : at->second;
}

}  // namespace truetriad::line
