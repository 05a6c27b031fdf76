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

/// Keeps the gyroscope's readings between the poses and in stated spans of rows, and what the other
/// sensors read then.
///
/// Readings inside a pose are dropped as soon as the pose is known, and those of a move as soon as
/// it is known to last longer than kLongestMoveS, so that memory holds the moves and what static
/// detection has not judged yet, however long nothing rests or one rest lasts.
class MoveRecorder {
 public:
  /// A turn that takes longer is not used. Its angle would be known worse than hands that turn the
  /// unit once more would know it: a bias that wanders by 0.01 deg/s makes 3 deg of it.
  static constexpr double kLongestMoveS = 300.0;

  /// `spans`: rows of the leading stream's file, or times, whose readings stay, whatever poses they
  /// lie in.
  MoveRecorder(Triad leading, const std::vector<MotionPlace>& spans);

  void Add(const SampleBlock& block);

  /// `pose` is the next one that is complete.
  void DropRest(const StaticPose& pose);

  /// Every pose that ends before this time has been dropped: what lies further behind the last of
  /// them than a turn may take belongs to none.
  void DropLongMove(std::int64_t judged_before_ns);

  /// The moves between consecutive poses of `set`, in order; those that cannot be integrated say
  /// why.
  std::vector<RecordedMove> Moves(const PoseSet& set) const;

  /// The readings of each span, in the order they were stated, likewise.
  std::vector<RecordedMove> Spans(const PoseSet& set) const;

  /// The last row of the leading stream's file that has come; -1 before.
  std::int64_t last_row() const { return last_row_; }

  /// The first and the last time of the leading stream that have come.
  std::int64_t first_ns() const { return first_ns_; }
  std::int64_t last_ns() const { return last_ns_; }

  /// Readings of the gyroscope held at most so far: what bounds the memory.
  std::size_t peak_readings() const { return peak_readings_; }

 private:
  struct Stretch {
    std::int64_t after_ns = 0, before_ns = 0;
  };
  struct Span {
    RowSpan rows;
    std::int64_t start_ns = 0, end_ns = -1;  // Of those of its rows that have come, or as stated.
    bool is_by_row = true;
  };

  // Removes all inside of a stretch but its first and its last reading, which close the turns
  // beside it at rest, and but what lies in a span, with a reading on each side.
  void Compact(ReadingTrack* track) const;

  // The gyroscope's readings from one of its times to before another.
  using Time = std::vector<std::int64_t>::const_iterator;
  RecordedMove Cut(Time first, Time last, const StreamSummary& gyroscope) const;

  Triad leading_;
  std::vector<Span> spans_;
  PerTriad<ReadingTrack> tracks_;
  std::vector<Stretch> to_drop_;
  std::optional<std::int64_t> last_end_ns_;  // Of the last pose that is complete.
  std::int64_t last_row_ = -1;
  std::int64_t first_ns_ = 0, last_ns_ = 0;
  std::size_t peak_readings_ = 0;
};

}  // namespace truetriad
