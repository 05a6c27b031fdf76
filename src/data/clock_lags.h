// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "truetriad/base/triad.h"
#include "truetriad/data/sample_source.h"
#include "truetriad/data/static_pose.h"

namespace truetriad {

/// σ of a lag, s: half of the 0.1 s over which readings are averaged.
inline constexpr double kClockLagSigmaS = 0.05;

/// Finds delays of seconds between two triads' readings. (The fit of the calibration finds delays
/// of milliseconds.)
///
/// It keeps each triad's mean over every 0.1 s, for six hours at most. From these means it computes
/// c, a measure of how fast the unit turns: for a gyroscope the rate less the rate at rest, for
/// other sensors the change of the reading. If the unit is turned now and then, log c of two triads
/// correlates,
///
///   r(lag) = corr(log c_reference(t), log c_triad(t + lag))
///
/// and the lag with the largest correlation is the delay of the triad's times.
class ClockLagFinder {
 public:
  void Add(const SampleBlock& block);

  /// By how much the times of `triad` are later than those of `reference`, s. Unset if no lag of up
  /// to 6 s stands out, for example if nothing moves, or if moves come at even intervals.
  std::optional<double> LagOf(Triad triad, Triad reference) const;

 private:
  struct Track {
    std::vector<Eigen::Vector3f> means;  // One per slot of 0.1 s; NaN: no reading.
    std::int64_t slot = -1;              // Number of the slot being summed.
    double count = 0.0;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  };
  static void Close(Track* track);

  bool started_ = false;
  std::int64_t origin_ns_ = 0;
  PerTriad<Track> tracks_;
};

/// The triad whose clock is the reference: the gyroscope, or without one the accelerometer.
Triad ClockReference(const PoseSet& set);

/// Finds the triads whose times are wrong by 0.25 s or more and sets their set->clock_lag_s. The
/// findings give one block of configuration that corrects all these triads. `set` must have its
/// `streams`, and its `time_offset_s` must hold the offsets that were subtracted already.
Findings FindClockLags(const ClockLagFinder& finder, PoseSet* set);

}  // namespace truetriad
