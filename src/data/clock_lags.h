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

/// Finds delays of seconds between two triads' readings; the calibration's fit finds milliseconds.
///
/// It keeps each triad's mean over every tenth of a second. From these means it computes c, which
/// grows with the turning of the unit: the change of a field's reading, or the rate less the rate
/// at rest. If the unit is turned now and then, the logarithms of c of two triads correlate,
///
///   r(lag) = corr(log c_reference(t), log c_triad(t + lag))
///
/// and the lag of the maximum is the delay of the triad's times. The means of six hours are kept.
class ClockLagFinder {
 public:
  void Add(const SampleBlock& block);

  /// By how much the times of `triad` are later than those of `reference`, s. Unset if no lag of up
  /// to 6 s stands out, because nothing moves or moves come at even intervals.
  std::optional<double> LagOf(Triad triad, Triad reference) const;

 private:
  struct Track {
    std::vector<Eigen::Vector3f> means;  // Of each slot of 0.1 s; NaN: no reading.
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
/// remedy is one block of configuration, which corrects all these triads. `set` must have its
/// `streams`, and its `time_offset_s` must hold the offsets that were subtracted already.
Findings FindClockLags(const ClockLagFinder& finder, PoseSet* set);

}  // namespace truetriad
