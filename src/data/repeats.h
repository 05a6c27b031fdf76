// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "truetriad/data/sample_source.h"
#include "truetriad/data/static_pose.h"

namespace truetriad {

// Chosen: a gap is more than five usual intervals; one or two lost samples are a logger's jitter.
inline constexpr double kGapSpacings = 5.0;
// Chosen: a gap of up to 50 ms is bridged, in which the rate of a turn by hand is nearly linear.
inline constexpr double kBridgedS = 0.05;
// Chosen: eight equal readings in a row are not due to noise while the unit turns.
inline constexpr std::size_t kStuckReadings = 8;
// Chosen: three equal readings in a row at the end of the range are saturation.
inline constexpr std::size_t kSaturatedReadings = 3;
// A difference of neighbouring readings is a jump from 1.5 steps on, half-way from one to two.
inline constexpr double kFarSteps = 1.5;

/// Readings number [begin, end).
struct EqualReadings {
  std::size_t begin, end;
};

/// The runs of at least kSaturatedReadings, times `repeats` (StreamSummary), in which one axis
/// stays on `limit`. With coarse steps the peak of a rate stays on it as well, but reaches and
/// leaves it by one `step`; such runs are left out.
std::vector<EqualReadings> RunsAtLimit(double limit,
                                       double step,
                                       Eigen::Index axis,
                                       const std::vector<Eigen::Vector3d>& readings,
                                       double repeats);

/// The runs of at least kStuckReadings, times `repeats` (StreamSummary), that no working sensor
/// makes: a coarse sensor has runs, too, but comes and goes by one `step_raw` on each axis.
std::vector<EqualReadings> StuckRuns(const std::vector<Eigen::Vector3d>& readings,
                                     const Eigen::Vector3d& step_raw,
                                     double repeats);

// A logger that is faster than a sensor repeats each reading until there is a new one. Such repeats
// are no evidence of the sensor's noise, nor readings at the times of their stamps.

/// Appends the readings of a block, without their rows.
void Append(const SampleBlock& block, ReadingTrack* track);

/// Keeps the first of equal consecutive readings if `stream` usually repeats its readings. Returns
/// how many readings were left out.
std::size_t LeaveOutHeld(const StreamSummary& stream, ReadingTrack* track);

/// The step of a triad's readings, the same for all axes, if each row is a pose, so that readings
/// differ by many steps from one to the next; 0: no common step.
double StepOfRows(Triad triad, const std::vector<StaticPose>& poses);

/// If each row is a pose: leaves out readings equal to those of the row before, and rows that
/// become empty by this, with a finding.
void LeaveOutRepeats(PoseSet* set);

}  // namespace truetriad
