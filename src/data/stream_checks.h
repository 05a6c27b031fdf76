// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "data/length_spread.h"
#include "data/pose_statistics.h"
#include "data/repeats.h"
#include "truetriad/base/result.h"
#include "truetriad/data/pose_collection.h"
#include "truetriad/data/sample_source.h"
#include "truetriad/data/static_pose.h"

namespace truetriad {

/// Checks one stream as it is read: order of time, gaps, range and step of the readings.
class StreamMonitor {
 public:
  /// An interval without samples that overlaps `excluded` is no gap.
  StreamMonitor(const StreamInfo& info,
                bool has_time,
                const std::vector<ExcludedRange>& excluded = {})
      : info_(info), has_time_(has_time), excluded_(excluded) {}

  /// Error: time goes backwards, or a reading is not finite.
  Status Add(const SampleBlock& block);

  /// UsualSpacing of the first thousand samples, ns (without time: rows); 0 before there are two.
  double spacing_ns() const;
  /// Smallest nonzero change between neighbouring readings, by axis; 0: there is none.
  Eigen::Vector3d resolution_raw() const;
  /// The step of readings at rest. If a gyroscope has a dead band, this is at least twice the band,
  /// which is the smallest change from the value that the gyroscope repeats.
  Eigen::Vector3d rest_step_raw() const;
  std::int64_t samples() const { return samples_; }
  std::int64_t first_ns() const { return first_ns_; }
  std::int64_t last_ns() const { return last_ns_; }
  bool has_temperature() const { return lowest_degc_ <= highest_degc_; }
  Eigen::Vector2d temperature_range_degc() const { return {lowest_degc_, highest_degc_}; }

  /// Summarises the whole stream. Error: the sensor is stuck at one reading.
  Result<StreamSummary> Summary(const StreamCounts& counts) const;

  /// Findings of the stream: no readings, gaps, equal times, an axis that never changes.
  Findings Check(const StreamSummary& summary) const;

 private:
  void WatchEquals(const SampleBlock& block);
  double UsualRepeats() const;
  void CountFirst();
  bool IsGap(std::int64_t spacing_ns) const {
    return static_cast<double>(spacing_ns) > kGapSpacings * usual_ns_;
  }
  void CountGap(std::int64_t from_ns, std::int64_t spacing_ns);
  bool IsExcludedBetween(std::int64_t from_ns, std::int64_t to_ns) const;
  Status CheckFinite(const SampleBlock& block) const;

  StreamInfo info_;
  bool has_time_;
  std::vector<ExcludedRange> excluded_;
  std::int64_t samples_ = 0, first_ns_ = 0, last_ns_ = 0;
  std::int64_t duplicate_times_ = 0, gaps_ = 0, longest_gap_ns_ = 0, longest_gap_from_ns_ = 0;
  std::int64_t interruptions_ = 0, interruptions_ns_ = 0;  // Gaps and excluded intervals.
  std::vector<std::int64_t> first_times_ns_;
  double usual_ns_ = 0.0;  // 0 until there are kSpacingSamples of first_times_ns_.
  Eigen::Vector3d minimum_raw_ = Eigen::Vector3d::Constant(1e300);
  Eigen::Vector3d maximum_raw_ = Eigen::Vector3d::Constant(-1e300);
  Eigen::Vector3d resolution_raw_ = Eigen::Vector3d::Constant(1e300);
  // Per axis: the reading that is repeated most, how often a different reading followed it, and the
  // least change to such a reading.
  struct Repeated {
    double value = 0.0;
    std::int64_t votes = 0, left = 0;
    double least_change = 1e300;
  };
  std::array<Repeated, 3> repeated_{};  // By axis.
  // Runs of equal readings that begin and end with a jump.
  struct Runs {
    std::optional<Eigen::Vector3d> last;
    std::int64_t length = 0;
    bool is_far_before = false;
    std::vector<std::int64_t> count;  // Number of runs, by length.
  };
  Runs runs_;
  LengthSpread lengths_;
  double lowest_degc_ = 1e300, highest_degc_ = -1e300;
};

/// Poses in which an axis is flat: clipped at one limit of its range, or stuck at one reading.
struct FlatPoses {
  Triad triad = Triad::kAccelerometer;
  std::string words;  ///< Sensor, axis and reading, as text.
  std::vector<std::size_t> poses;
  bool is_clipped = false;
};
/// Finds the poses in which an axis is flat while other poses have noise. A clipped axis is
/// constant at its stream's extreme, or reaches this extreme in more than half of the windows. A
/// stuck axis is constant at another reading.
std::vector<FlatPoses> FindFlatPoses(const PerTriad<Eigen::Vector3d>& resolution_raw,
                                     const std::vector<PerTriad<TriadPoseMoments>>& moments,
                                     const std::vector<StreamSummary>& streams);

/// Removes the readings of a sensor from the poses in which one of its axes is flat, with findings.
/// Returns whether there were such poses. Error: more than half of the poses are affected.
Result<bool> RemoveFlatReadings(const PerTriad<Eigen::Vector3d>& resolution_raw,
                                std::vector<PerTriad<TriadPoseMoments>>* moments,
                                PoseSet* set);

}  // namespace truetriad
