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

/// σ of a lag: what it is read from has ten slots a second.
inline constexpr double kClockLagSigmaS = 0.05;

/// Whether one triad's readings change long after, or before, another's: seconds, not the
/// milliseconds that a fit finds.
///
/// Of every tenth of a second it keeps each triad's mean, which tells by how much the unit turned:
/// the change of a field's readings, the reading of a rate beside the one at rest. Where the unit
/// is turned now and then, the logarithms c of two triads go up and down together,
///
///   r(lag) = corr(log c_reference(t), log c_triad(t + lag))
///
/// and the clearest lag is by how much the times of the triad are later. Six hours are kept.
class ClockLagFinder {
 public:
  void Add(const SampleBlock& block);

  /// By how much the times of `triad` are later than those of `reference`, s. Unset where no lag
  /// of up to 6 s is clear: nothing moves, or the moves come at even intervals.
  std::optional<double> LagOf(Triad triad, Triad reference) const;

 private:
  struct Track {
    std::vector<Eigen::Vector3f> means;  // of the slots; NaN where nothing was read
    std::int64_t slot = -1;              // that is open
    double count = 0.0;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  };
  static void Close(Track* track);

  bool started_ = false;
  std::int64_t origin_ns_ = 0;
  PerTriad<Track> tracks_;
};

/// Whose clock the others' are compared with: the gyroscope's, without one the accelerometer's.
Triad ClockReference(const PoseSet& set);

/// Finds the triads whose times are off by tenths of a second and more, each with one block for
/// all of them that can be pasted. `set` needs its streams and the offsets that were taken off.
Findings FindClockLags(const ClockLagFinder& finder, PoseSet* set);

}  // namespace truetriad
