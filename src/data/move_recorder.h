// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "truetriad/data/sample_source.h"
#include "truetriad/data/static_pose.h"

namespace truetriad {

/// Keeps the readings of all sensors between the poses and in stated spans of rows or times.
///
/// Readings inside a pose are dropped as soon as the pose is known, and those of a move as soon as
/// the move is known to last longer than kLongestMoveS. So memory holds only moves and what static
/// detection has not judged yet, however long a rest, or motion without a rest, lasts.
class MoveRecorder {
 public:
  /// Chosen: a turn that takes longer is not used, since a drift of the bias by 0.01 deg/s changes
  /// its angle by 3 deg.
  static constexpr double kLongestMoveS = 300.0;

  /// `spans`: rows of the leading stream's file, or times, whose readings are kept even in poses.
  MoveRecorder(Triad leading, const std::vector<MotionPlace>& spans);

  void Add(const SampleBlock& block);

  /// Drops the readings inside `pose`, which is the next complete pose.
  void DropRest(const StaticPose& pose);

  /// Drops the readings before this time that are more than kLongestMoveS after the last complete
  /// pose. All poses that end before this time must be known.
  void DropLongMove(std::int64_t judged_before_ns);

  /// The moves between consecutive poses of `set`, in order. A move that cannot be used has a
  /// fault.
  std::vector<RecordedMove> Moves(const PoseSet& set) const;

  /// The readings in each span, in the order in which spans were stated. A span that cannot be used
  /// has a fault.
  std::vector<RecordedMove> Spans(const PoseSet& set) const;

  /// The last row read of the leading stream's file; -1 before the first one.
  std::int64_t last_row() const { return last_row_; }

  /// The first and the last time read of the leading stream.
  std::int64_t first_ns() const { return first_ns_; }
  std::int64_t last_ns() const { return last_ns_; }

  /// The largest number of gyroscope readings held so far, which bounds the memory.
  std::size_t peak_readings() const { return peak_readings_; }

 private:
  struct Stretch {
    std::int64_t after_ns = 0, before_ns = 0;
  };
  struct Span {
    RowSpan rows;
    std::int64_t start_ns = 0, end_ns = -1;  // Times of the rows read so far, or as stated.
    bool is_by_row = true;
  };

  // Removes the readings inside the stretches of to_drop_. Keeps the first and last reading of each
  // stretch, as the turns beside it end there, and the readings in a span with one more on each
  // side.
  void Compact(ReadingTrack* track) const;

  // The move with the gyroscope's readings in [first, last).
  using Time = std::vector<std::int64_t>::const_iterator;
  RecordedMove Cut(Time first, Time last, const StreamSummary& gyroscope) const;

  Triad leading_;
  std::vector<Span> spans_;
  PerTriad<ReadingTrack> tracks_;
  std::vector<Stretch> to_drop_;
  std::optional<std::int64_t> last_end_ns_;  // Of the last complete pose.
  std::int64_t last_row_ = -1;
  std::int64_t first_ns_ = 0, last_ns_ = 0;
  std::size_t peak_readings_ = 0;
};

}  // namespace truetriad
