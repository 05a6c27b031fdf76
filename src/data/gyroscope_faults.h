// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include <Eigen/Core>

namespace truetriad {

// When a gyroscope's readings do not tell a turn.
//
// Chosen: one or two lost samples are the jitter of a logger, more spacings than this are a gap.
inline constexpr double kGapSpacings = 5.0;
// A shorter gap is bridged: the rate is nearly linear that long.
inline constexpr double kBridgedS = 0.05;
// Equal readings in a row that noise does not make while the unit turns.
inline constexpr std::size_t kStuckReadings = 8;
// Readings in a row at the end of the stream's range.
inline constexpr std::size_t kSaturatedReadings = 3;

/// Readings number [begin, end).
struct EqualReadings {
  std::size_t begin, end;
};
/// The runs of at least `fewest` readings that repeat the first of them on `axis`, or where it is
/// not given on all axes at once.
std::vector<EqualReadings> RunsOfEquals(const std::vector<Eigen::Vector3d>& readings,
                                        std::optional<Eigen::Index> axis,
                                        std::size_t fewest);

}  // namespace truetriad
