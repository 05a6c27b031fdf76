// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "truetriad/base/result.h"
#include "truetriad/base/triad.h"
#include "truetriad/data/sample_source.h"

namespace truetriad {

/// Length of a window, 0.1 s: ten samples at 100 Hz, a tenth of the shortest rest.
inline constexpr std::int64_t kWindowNs = 100'000'000;

/// Number of windows that are searched at once: 27 minutes of 0.1 s. If a stream lags the others by
/// this number, it has ended, as sources keep streams within one block (4096 samples) of each
/// other.
inline constexpr std::size_t kMostWindows = 16384;

/// Statistics of one triad in one short window; all later statistics follow from them, so that no
/// sample is kept. Readings are in the stream's raw unit.
struct TriadWindow {
  std::int64_t count = 0;
  Eigen::Vector3d mean_raw = Eigen::Vector3d::Zero();
  Eigen::Matrix3d scatter_raw = Eigen::Matrix3d::Zero();  ///< sum (y - mean)(y - mean)^T
  Eigen::Vector3d minimum_raw = Eigen::Vector3d::Zero();
  Eigen::Vector3d maximum_raw = Eigen::Vector3d::Zero();
  std::int64_t temperature_count = 0;
  double temperature_sum_degc = 0.0;
  std::int64_t first_ns = 0, last_ns = 0;
  std::int64_t first_row = 0, last_row = 0;

  /// Adds the samples of `later`, which follow those of this window.
  void Merge(const TriadWindow& later);
};

/// Statistics of samples [begin, end) of a block; end > begin. Sums are taken about the first
/// sample, so the large offset of raw counts cancels before anything is squared.
TriadWindow Summarize(const SampleBlock& block, std::size_t begin, std::size_t end);

/// The windows of all streams on one time grid; windows without any sample are not stored.
class WindowBuffer {
 public:
  /// Window i covers origin_ns + [i, i + 1) * width_ns. Needs width_ns > 0.
  WindowBuffer(std::int64_t origin_ns, std::int64_t width_ns, std::vector<Triad> streams);

  /// Adds the samples of a block of one of the streams, in time order. Error: the block is so far
  /// behind the other streams that its windows have been used already.
  Status Add(const SampleBlock& block);

  /// Number of windows at the front to which no stream will add any more. A stream that is
  /// thousands of windows behind has ended (sources keep streams within one block of each other).
  std::size_t CompleteCount() const;

  void DropFront(std::size_t windows);

  /// Samples before this time are in no window any more.
  std::int64_t begin_ns() const { return origin_ns_ + dropped_before_ * width_ns_; }

  std::size_t size() const { return index_.size(); }
  std::int64_t index(std::size_t i) const { return index_[i]; }
  const std::vector<Triad>& streams() const { return streams_; }
  /// One window for each index if the triad is a stream; otherwise empty.
  const std::vector<TriadWindow>& windows(Triad triad) const { return windows_[triad]; }

 private:
  std::size_t Slot(std::int64_t window_index, std::size_t hint);

  std::int64_t origin_ns_;
  std::int64_t width_ns_;
  std::vector<Triad> streams_;
  std::vector<std::int64_t> index_;
  PerTriad<std::vector<TriadWindow>> windows_;
  PerTriad<std::size_t> cursor_;         // Index of the window to which the stream added last.
  PerTriad<std::int64_t> latest_index_;  // Number of this window in the grid; -1 before.
  std::int64_t dropped_before_ = 0;      // Windows below this index are gone.
};

}  // namespace truetriad
