// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "data/collector.h"
#include "data/held_samples.h"
#include "data/pose_statistics.h"
#include "data/stream_checks.h"
#include "truetriad/base/result.h"
#include "truetriad/data/pose_collection.h"
#include "truetriad/data/sample_source.h"

namespace truetriad {

/// Where a range is stated, and its times if it is given by time instead of rows.
struct RangeOrigin {
  TimeRange times;
  std::string stated_in;  ///< File and line, such as "rates.yaml:3".
};

/// Collects poses that are given: every row, every N rows, by a column, or by row ranges.
///
/// Rows are counted in the leading stream's file. A pose takes the samples of a stream in this file
/// by row, and the samples of a stream in another file by time, from half a sampling interval of
/// the leading stream before the pose until half an interval after it.
class GivenPoses : public RestFinder {
 public:
  /// `monitor` is that of the leading stream and belongs to the caller. `key`: the ranges' name in
  /// messages. `origins`: empty, or one for each range. Either all origins have times, or none has
  /// and the ranges are by rows.
  GivenPoses(const PoseSelection& selection,
             const RecordingInfo& info,
             Triad leading,
             const StreamMonitor& monitor,
             std::string key = "poses",
             std::vector<RangeOrigin> origins = {});

  /// Error: a missing pose column, ranges out of file order, or fewer than one row per pose.
  Status Validate() const override;
  /// Error: over kMostRowsAsRests single rows are selected as rests, but a gyroscope needs turns
  /// between rests.
  Status Add(const std::vector<SampleBlock>& blocks) override;
  const std::vector<CollectedPose>& poses() const override { return poses_; }
  /// Unset before the first sample.
  std::optional<std::int64_t> judged_before_ns() const override;
  /// Error: a range without readings.
  Result<std::vector<CollectedPose>> Finish(Findings* findings) override;
  Error NoPose(const PoseSet& set) const override;

 private:
  struct OpenPose {
    PoseAccumulator accumulator;
    PerTriad<TriadWindow> window;  // The last samples, which do not fill a window yet.
    std::int64_t label = 0;
    std::int64_t first_row = 0, last_row = 0, first_ns = 0, last_ns = 0;
    bool closed = false;
  };
  /// Samples of another stream that wait until the leading one has passed them.
  struct Waiting {
    HeldSamples samples;
    std::int64_t latest_key = -1;  // Row or time of the last sample that came in.
    std::int64_t current = 0;      // Number of the first pose that later samples can belong to.
  };

  bool IsByTime() const { return !origins_.empty() && !origins_.front().times.empty(); }
  // First and last row (or time) of a range, and the name of the range in messages.
  std::int64_t Begin(std::size_t range) const;
  std::int64_t End(std::size_t range) const;
  std::string Spoken(std::size_t range) const;
  Status CheckRowsAreRests() const;
  std::optional<std::int64_t> Label(const SampleBlock& block, std::size_t i);
  void AddLeading(const SampleBlock& block);
  void AddWaiting(Triad triad, bool at_end);
  bool IsOver(const OpenPose& pose) const;
  bool IsByRow(Triad triad) const;
  std::int64_t Reach(bool by_row) const;
  static void AddSamples(const SampleBlock& block,
                         std::size_t begin,
                         std::size_t end,
                         OpenPose* pose);
  void FinishFirst();

  PoseSelection selection_;
  RecordingInfo info_;
  Triad leading_;
  std::string key_;
  std::vector<RangeOrigin> origins_;
  const StreamMonitor& monitor_;
  std::size_t range_ = 0;
  std::int64_t last_row_ = -1, last_ns_ = 0;  // Of the leading stream.
  std::deque<OpenPose> open_;
  std::int64_t finished_ = 0;
  PerTriad<Waiting> waiting_;
  std::vector<CollectedPose> poses_;
  std::vector<bool> range_used_;
  std::int64_t last_block_rows_ = 0;
};

}  // namespace truetriad
