// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <numbers>

namespace truetriad {

inline constexpr double kDegPerRad = 180.0 / std::numbers::pi;
inline constexpr double kRadPerDeg = std::numbers::pi / 180.0;

}  // namespace truetriad
