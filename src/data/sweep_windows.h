// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "data/collector.h"
#include "data/window_statistics.h"
#include "thermometer/thermometer.h"
#include "truetriad/base/result.h"
#include "truetriad/data/pose_collection.h"
#include "truetriad/data/sample_source.h"
#include "truetriad/data/static_pose.h"

namespace truetriad {

/// Cuts a recording of a temperature sweep into windows while it streams by.
///
/// Samples are summed into cells of equal length, 32768 at most: when more are needed, neighbours
/// are merged and the length doubles, so that memory does not grow with the recording. At the end
/// the temperature is smoothed over the cells, outliers among the cells are left out, and the
/// others are merged into windows.
class SweepCutter : public Collector {
 public:
  /// `leading`: the triad whose rows are counted in `selection.ranges` and in window_samples.
  SweepCutter(const PoseSelection& selection, const RecordingInfo& info, Triad leading);

  /// Error: no time or temperature, ranges out of order, or rows are counted while the sensors are
  /// in separate files.
  Status Validate() const override;

  Status Add(const std::vector<SampleBlock>& blocks) override;

  /// Fills in set->poses (the windows) and set->sweep. Error: too few windows, a constant
  /// temperature, or a unit that was turned.
  Status Finish(PoseSet* set) override;

 private:
  struct Cell {
    PerTriad<TriadWindow> triads;  ///< Sums over the cell's samples in `attitude`.
    int attitude = -1;             ///< Number of the held attitude; -1: none is held.
    std::int64_t degc_count = 0;
    double degc_sum = 0.0;
    double time_sum_s = 0.0;  ///< Sum of the temperatures' times since the first sample.
    std::int64_t ambient_count = 0;
    double ambient_sum = 0.0;
    std::vector<std::string> far_off;  ///< Reasons to leave the cell out; empty: kept.

    double ambient_degc() const { return ambient_sum / static_cast<double>(ambient_count); }
    double degc() const { return degc_sum / static_cast<double>(degc_count); }
    double time_s() const { return time_sum_s / static_cast<double>(degc_count); }
    void Merge(const Cell& later);
  };

  int AttitudeOf(std::int64_t row);
  std::size_t CellOf(std::int64_t time_ns, std::int64_t row);
  void MergePairs();
  /// The smoothed ambient temperature at the times of `track`.
  TemperatureTrack SmoothAmbient(const TemperatureTrack& track) const;
  void AddRun(const SampleBlock& block, std::size_t begin, std::size_t end);
  void AddBlock(const SampleBlock& block);
  Status CheckRangesUsed() const;
  void LeaveOutWithoutTemperature(PoseSet* set);
  void LeaveOutStuckTemperature(PoseSet* set);
  void LeaveOutFarOff(const TemperatureTrack& track, const std::vector<bool>& spikes, PoseSet* set);
  void LeaveOutFarOffReadings(const TemperatureTrack& track, Triad triad, int attitude, int axis);
  void LeaveOut(std::size_t i, const std::string& what);
  void MakeWindows(PoseSet* set) const;
  void AddWindow(std::size_t first, std::size_t last, PoseSet* set) const;
  Eigen::Vector3d SampleSigma(Triad triad) const;
  void Warn(double duration_s, PoseSet* set) const;

  PoseSelection selection_;
  RecordingInfo info_;
  Triad leading_;
  std::vector<int> range_attitude_;
  std::vector<bool> range_used_;
  std::vector<std::string> attitude_names_;
  std::vector<Cell> cells_;
  std::int64_t origin_ns_ = 0;
  bool started_ = false;
  bool was_doubled_ = false;
  std::int64_t cell_ns_ = 0;       ///< Length of a cell, if cell_samples_ is 0.
  std::int64_t cell_samples_ = 0;  ///< Number of rows in a cell; 0: cells are cut by time.
  ThermometerWatch thermometer_, ambient_thermometer_;
  std::optional<Triad> watched_;  ///< The triad whose temperatures are watched.
};

/// Error: gravity jumps between two windows of one attitude, as if the unit was turned.
Status CheckHeld(const PoseSet& set);

/// Warns of small turns of the unit. A turn shows as a lasting step of the accelerometer's reading
/// at right angles to gravity. Effects of temperature are slow, and partly along gravity.
void NameTurns(PoseSet* set);

}  // namespace truetriad
