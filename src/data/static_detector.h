// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "data/window_statistics.h"
#include "truetriad/base/triad.h"
#include "truetriad/data/pose_collection.h"

namespace truetriad {

/// Windows [first, second) of a buffer.
using WindowRun = std::pair<std::size_t, std::size_t>;

/// A rest as runs of windows in order. Between two runs is a knock, which belongs to the rest in
/// time but not to its statistics.
struct Rest {
  std::vector<WindowRun> runs;
  std::size_t begin() const { return runs.front().first; }
  std::size_t end() const { return runs.back().second; }
};

/// What the detector knows of a triad beforehand.
struct DetectorTriad {
  Triad triad = Triad::kAccelerometer;
  /// Step of the readings of each axis; 0 when too fine to matter.
  Eigen::Vector3d resolution_raw = Eigen::Vector3d::Zero();
  /// The least change of the reading when the unit is turned over; 0: the scale is unknown.
  double expected_range_raw = 0.0;
  /// SI units per raw unit; 0: unknown, as of counts.
  double si_per_raw = 0.0;
};

/// Finds the rests of a recording from its windows, without tuning and in any unit.
///
/// The measure of a window is its activity: log2 of the total variance (noise, tremor and change of
/// the mean) over five windows around it, averaged over the triads in use. A rest is a run of
/// windows below a level. Every level between the quietest and the most active window is tried; a
/// run counts if it lasts long enough and its mean changes by at most 1 % of the range of the
/// signal (kSteadyShare). Levels within the sensor's noise cut rests into pieces that are too
/// short. Levels within the motion include handling, so that the mean changes too much. In between,
/// the number of rests is constant over a wide range of levels. Of the levels whose number of rests
/// persists, the one with the most rests is chosen. A sensor that always turns has no level with
/// rests.
class StaticDetector {
 public:
  /// `triads` distinguish rest from motion; the mean of the first one must be steady in a rest.
  /// `witnesses` only show whether the attitude is the same before and after a knock.
  StaticDetector(const StaticDetectorOptions& options,
                 std::vector<DetectorTriad> triads,
                 const std::vector<DetectorTriad>& witnesses,
                 double window_s);

  /// The rests among windows [0, count) of the buffer. The range of the signal is kept from earlier
  /// calls, so that a long recording can be read in parts.
  std::vector<Rest> Find(const WindowBuffer& buffer, std::size_t count);

  /// True if `earlier` and `later`, both in `buffer`, are one rest that a knock interrupts: a short
  /// disturbance with at most a small tilt. The attitude must be the same before and after it, and
  /// so must the heading if a sensor shows the heading.
  bool IsKnock(const WindowBuffer& buffer, const WindowRun& earlier, const WindowRun& later) const;

 private:
  void UpdateRange(const WindowBuffer& buffer, std::size_t count);
  void MeasureActivity(const WindowBuffer& buffer, std::size_t count);
  void WidenRangeIfQuietThroughout(const WindowBuffer& buffer);
  double ChooseLevel(const WindowBuffer& buffer) const;
  std::vector<Rest> RestsBelow(const WindowBuffer& buffer, double level) const;
  bool CutUnsteadyEnds(const WindowBuffer& buffer, WindowRun* run) const;
  static void CutSettling(const std::vector<TriadWindow>& windows,
                          std::size_t fewest,
                          WindowRun* run);
  bool IsAsBefore(const WindowBuffer& buffer,
                  const DetectorTriad& known,
                  const WindowRun& before,
                  const WindowRun& after) const;
  bool WasHandled(const WindowBuffer& buffer,
                  const WindowRun& before,
                  const WindowRun& after) const;
  bool IsLongEnough(const Rest& rest) const;

  StaticDetectorOptions options_;
  std::vector<DetectorTriad> triads_;
  std::vector<DetectorTriad> all_;  // Both triads_ and the witnesses.
  double window_s_;
  PerTriad<double> range_raw_;   // Range of the means of windows as the unit turns.
  std::vector<float> activity_;  // Infinity: a triad has no readings near the window.
};

}  // namespace truetriad
