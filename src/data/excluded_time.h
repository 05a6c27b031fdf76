// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "truetriad/base/result.h"
#include "truetriad/data/pose_collection.h"
#include "truetriad/data/sample_source.h"

namespace truetriad {

/// Takes out of a stream of readings what was taken in times that are to be left out.
class ExcludedTime {
 public:
  explicit ExcludedTime(const std::vector<ExcludedRange>& ranges);

  /// Leaves the pieces of the blocks that count, in order.
  void Apply(std::vector<SampleBlock>* blocks);

  /// The ranges, none beyond the recording's first and last reading.
  std::vector<TimeRange> Left() const;

  /// How much was left out. Error (bad input): a range without any reading.
  Status Tell(const RecordingInfo& info, Findings* findings) const;

 private:
  std::vector<ExcludedRange> ranges_;
  std::vector<std::int64_t> readings_;  // That each has left out.
  // Of all readings, left out or not.
  std::int64_t first_ns_ = std::numeric_limits<std::int64_t>::max();
  std::int64_t last_ns_ = std::numeric_limits<std::int64_t>::min();
};

}  // namespace truetriad
