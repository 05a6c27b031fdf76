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

/// σ of a lag, s: half of a slot of 0.1 s.
inline constexpr double kClockLagSigmaS = 0.05;

/// Finds delays of seconds between the readings of two triads; a fit finds those of milliseconds.
///
/// It keeps each triad's mean over every tenth of a second, which shows how far the unit turned, c:
/// by the change of a field's readings, or by a rate less that at rest. Where the unit is turned
/// now and then, the logarithms of the c of two triads are correlated,
///
///   r(lag) = corr(log c_reference(t), log c_triad(t + lag))
///
/// and the lag of the maximum is the delay of the triad's times. Six hours are kept.
class ClockLagFinder {
 public:
  void Add(const SampleBlock& block);

  /// By how much the times of `triad` are later than those of `reference`, s. Unset where no lag
  /// of up to 6 s is clear: nothing moves, or the moves come at even intervals.
  std::optional<double> LagOf(Triad triad, Triad reference) const;

 private:
  struct Track {
    std::vector<Eigen::Vector3f> means;  // Of the slots; NaN: no reading.
    std::int64_t slot = -1;              // The open slot.
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

/// Finds the triads whose times are wrong by 0.25 s or more. The remedy is one block of
/// configuration, which corrects all of them. `set` must have `streams`, and in `time_offset_s`
/// what was subtracted already.
Findings FindClockLags(const ClockLagFinder& finder, PoseSet* set);

}  // namespace truetriad
