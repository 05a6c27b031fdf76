// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace truetriad {

// When a gyroscope's readings do not tell a turn.
//
// A gap of fewer spacings, or shorter, is bridged: the rate is nearly linear that long.
inline constexpr double kBridgedSpacings = 5.0;
inline constexpr double kBridgedS = 0.05;
// Equal readings in a row that noise does not make while the unit turns.
inline constexpr int kStuckReadings = 8;
// Readings in a row at the end of the stream's range.
inline constexpr int kSaturatedReadings = 3;

}  // namespace truetriad
