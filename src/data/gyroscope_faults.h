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
// Steps of its resolution from which on a reading beside a run of equal ones is not next to them.
inline constexpr double kFarSteps = 1.5;

/// Readings number [begin, end).
struct EqualReadings {
  std::size_t begin, end;
};
/// Where readings stay on `limit` on one axis. Where steps are coarse a rate that is at its largest
/// does so as well, but comes to it and leaves it by one `step`.
std::vector<EqualReadings> RunsAtLimit(double limit,
                                       double step,
                                       Eigen::Index axis,
                                       const std::vector<Eigen::Vector3d>& readings);

/// The runs of at least kStuckReadings, times `repeats` (StreamSummary), that no sensor makes which
/// works: a coarse one comes to its reading and leaves it by a step of `step_raw` on each axis.
std::vector<EqualReadings> StuckRuns(const std::vector<Eigen::Vector3d>& readings,
                                     const Eigen::Vector3d& step_raw,
                                     double repeats);

}  // namespace truetriad
