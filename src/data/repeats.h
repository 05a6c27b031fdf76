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
// Chosen: gaps of up to 50 ms are bridged; within 50 ms the rate of a turn by hand is nearly
// linear.
inline constexpr double kBridgedS = 0.05;
// Chosen: three equal readings in a row at the end of the range are saturation.
inline constexpr std::size_t kSaturatedReadings = 3;
// If neighbouring readings differ by over 1.5 steps, half-way from one to two, this is a jump.
inline constexpr double kFarSteps = 1.5;

/// Readings begin, …, end - 1 of a list, which are equal.
struct EqualReadings {
  std::size_t begin, end;
};

/// Finds runs of readings in which `axis` stays on `limit`. A run has at least kSaturatedReadings
/// times `repeats` (StreamSummary) readings. If steps are coarse, the peak of a rate stays on one
/// reading, too, but it comes and goes by one `step`; such runs are left out.
std::vector<EqualReadings> RunsAtLimit(double limit,
                                       double step,
                                       Eigen::Index axis,
                                       const std::vector<Eigen::Vector3d>& readings,
                                       double repeats);

// A logger that is faster than a sensor repeats each reading until there is a new one. Such repeats
// are no evidence of the sensor's noise, and were not taken at the times of their stamps.

/// Appends the times and readings of a block, but not its row numbers.
void Append(const SampleBlock& block, ReadingTrack* track);

/// Keeps the first of equal consecutive readings if `stream` usually repeats its readings. Returns
/// how many readings were left out.
std::size_t LeaveOutHeld(const StreamSummary& stream, ReadingTrack* track);

/// The step of a triad's readings, one for all axes, if each row is a pose. Neighbouring readings
/// then differ by many steps, so the step that all differences have in common is sought; 0: there
/// is none.
double StepOfRows(Triad triad, const std::vector<StaticPose>& poses);

/// If each row is a pose: leaves out readings equal to those of the row before, and then rows
/// without any reading. Adds a finding.
void LeaveOutRepeats(PoseSet* set);

}  // namespace truetriad
