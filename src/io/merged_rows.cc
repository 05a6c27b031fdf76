// SPDX-License-Identifier: Apache-2.0
#include "io/merged_rows.h"

#include <algorithm>
#include <utility>

namespace truetriad {

void MergedRows::Add(const SampleBlock& block) {
  for (Stream& stream : streams_) {
    if (stream.triad != block.triad) continue;
    stream.samples.EraseFront(std::exchange(stream.next, 0));
    stream.samples.Append(block);
  }
}

bool MergedRows::Next(bool at_end) {
  bool is_any = false, is_one_missing = false, is_one_full = false;
  std::int64_t earliest_ns = std::numeric_limits<std::int64_t>::max();
  for (Stream& stream : streams_) {
    if (std::exchange(stream.is_in_row, false)) ++stream.next;
    const std::size_t waiting = stream.waiting();
    is_one_full = is_one_full || waiting > kMostHeldSamples;
    if (waiting == 0) {
      is_one_missing = true;
      continue;
    }
    is_any = true;
    earliest_ns = std::min(earliest_ns, stream.samples.time_ns[stream.next]);
  }
  if (!is_any || (is_one_missing && !is_one_full && !at_end)) return false;
  went_back_ = went_back_ || earliest_ns < time_ns_;
  time_ns_ = earliest_ns;
  for (Stream& stream : streams_) {
    stream.is_in_row = stream.waiting() > 0 && stream.samples.time_ns[stream.next] == time_ns_;
  }
  return true;
}

Status MergedRows::status() const {
  if (!went_back_) return {};
  return Error(ErrorCode::kTimeGoesBack,
               "samples are too far out of order to sort the rows by time; sort the log, or put "
               "each sensor into its own file");
}

}  // namespace truetriad
