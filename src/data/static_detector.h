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

/// A rest as runs of windows in order; what lies between two runs is a knock, which belongs to
/// the rest in time but not to its statistics.
struct Rest {
  std::vector<WindowRun> runs;
  std::size_t begin() const { return runs.front().first; }
  std::size_t end() const { return runs.back().second; }
};

/// What the detector knows of a triad beforehand.
struct DetectorTriad {
  Triad triad = Triad::kAccelerometer;
  /// Step of the readings a axis; 0 when too fine to matter.
  Eigen::Vector3d resolution_raw = Eigen::Vector3d::Zero();
  /// Change of reading that turning the unit over makes at least; 0 when the unit is unknown.
  double expected_range_raw = 0.0;
  /// SI per reading; 0 when unknown (counts).
  double si_per_raw = 0.0;
};

/// Finds the rests of a recording from its windows, without tuning and in any unit.
///
/// The measure of a window is its activity: log2 of the total variance (noise, tremor and change
/// of the mean) over five windows around it, averaged over the triads in use. A rest is a run of
/// windows below a level. Every level between the quietest and the liveliest window is tried;
/// a run counts when it lasts long enough and its mean hardly moves compared with the range of
/// the signal. Levels in the sensor's noise cut rests into pieces too short to count, levels in
/// the motion swallow handling and fail the test of the mean; in between the number of rests
/// stays the same over a wide span. The level chosen has the most rests among those whose number
/// persists. A sensor that turns all the time has no level with rests.
class StaticDetector {
 public:
  /// `triads`: those that tell rest from motion; the first one's mean must be steady. `witnesses`:
  /// others, that only tell whether the unit is back where it was after a knock.
  StaticDetector(const StaticDetectorOptions& options,
                 std::vector<DetectorTriad> triads,
                 const std::vector<DetectorTriad>& witnesses,
                 double window_s);

  /// Rests among windows [0, count) of the buffer; windows with `usable` false are in none. The
  /// range of the signal that earlier calls saw is remembered, so that a long recording can be
  /// read in parts.
  std::vector<Rest> Find(const WindowBuffer& buffer,
                         std::size_t count,
                         const std::vector<bool>& usable);

  /// True when `later` goes on where `earlier`, both of `buffer`, was interrupted by a knock: a
  /// short disturbance with the same attitude, heading included where a sensor sees it, before,
  /// after and, by and large, during it.
  bool IsKnock(const WindowBuffer& buffer, const WindowRun& earlier, const WindowRun& later) const;

 private:
  void UpdateRange(const WindowBuffer& buffer, std::size_t count);
  void MeasureActivity(const WindowBuffer& buffer,
                       std::size_t count,
                       const std::vector<bool>& usable);
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
  void DropTurning(const WindowBuffer& buffer, std::vector<Rest>* rests) const;
  bool StayedWhere(const WindowBuffer& buffer,
                   const WindowRun& run,
                   const Eigen::Vector3d& rate_rad_s) const;

  StaticDetectorOptions options_;
  std::vector<DetectorTriad> triads_;
  std::vector<DetectorTriad> all_;  // With the witnesses.
  double window_s_;
  PerTriad<double> range_raw_;  // Spread of the window means: what turning the unit changes.
  Eigen::Vector3d centre_raw_ = Eigen::Vector3d::Zero();  // Of the leading triad's window means.
  std::vector<float> activity_;                           // Infinity where not usable.
};

}  // namespace truetriad
