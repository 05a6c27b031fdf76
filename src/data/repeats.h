// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "truetriad/data/sample_source.h"
#include "truetriad/data/static_pose.h"

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

/// The runs of at least kSaturatedReadings, times `repeats` (StreamSummary), in which one axis
/// stays on `limit`. Where steps are coarse a rate that is at its largest does so as well, but
/// comes to it and leaves it by one `step`.
std::vector<EqualReadings> RunsAtLimit(double limit,
                                       double step,
                                       Eigen::Index axis,
                                       const std::vector<Eigen::Vector3d>& readings,
                                       double repeats);

/// The runs of at least kStuckReadings, times `repeats` (StreamSummary), that no sensor makes which
/// works: a coarse one comes to its reading and leaves it by a step of `step_raw` on each axis.
std::vector<EqualReadings> StuckRuns(const std::vector<Eigen::Vector3d>& readings,
                                     const Eigen::Vector3d& step_raw,
                                     double repeats);

// A logger that is faster than a sensor writes each of its readings again until there is a new one.
// Such repeats say nothing of the sensor's noise, and nothing of when they are stamped.

/// Takes over the readings of a block, without their rows.
void Append(const SampleBlock& block, ReadingTrack* track);

/// Leaves the first of equal readings in a row where a sensor's readings are held: of `stream`.
/// Returns how many were left out.
std::size_t LeaveOutHeld(const StreamSummary& stream, ReadingTrack* track);

/// The step that all readings of rows which each are a pose were rounded to, on all axes; 0 where
/// they show none. From one pose to the next they differ by many.
double StepOfRows(Triad triad, const std::vector<StaticPose>& poses);

/// Of rows that each are a pose: leaves out what a sensor reads as in the row before, and rows that
/// are left with nothing, with a finding.
void LeaveOutRepeats(PoseSet* set);

}  // namespace truetriad
