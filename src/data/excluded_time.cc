// SPDX-License-Identifier: Apache-2.0
#include "data/excluded_time.h"

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <string>
#include <utility>

#include "base/messages.h"
#include "data/block_piece.h"

namespace truetriad {
ExcludedTime::ExcludedTime(const std::vector<ExcludedRange>& ranges)
    : ranges_(ranges), readings_(ranges.size(), 0) {}

void ExcludedTime::Apply(std::vector<SampleBlock>* blocks) {
  if (ranges_.empty()) return;
  std::vector<SampleBlock> pieces;
  for (const SampleBlock& block : *blocks) {
    const std::size_t size = block.time_ns.size();
    if (size > 0) {
      first_ns_ = std::min(first_ns_, block.time_ns.front());
      last_ns_ = std::max(last_ns_, block.time_ns.back());
    }
    std::size_t begin = 0;
    for (std::size_t i = 0; i < size; ++i) {
      const std::int64_t time_ns = block.time_ns[i];
      const auto range =
          std::find_if(ranges_.begin(), ranges_.end(), [time_ns](const ExcludedRange& each) {
            return each.times.start_ns <= time_ns && time_ns <= each.times.end_ns;
          });
      if (range == ranges_.end()) continue;
      if (begin < i) pieces.push_back(PieceOf(block, begin, i));
      begin = i + 1;
      ++readings_[static_cast<std::size_t>(std::distance(ranges_.begin(), range))];
    }
    if (begin < size) pieces.push_back(PieceOf(block, begin, size));
  }
  *blocks = std::move(pieces);
}

std::vector<TimeRange> ExcludedTime::Left() const {
  std::vector<TimeRange> left;
  for (const ExcludedRange& range : ranges_) {
    left.push_back(
        {std::max(range.times.start_ns, first_ns_), std::min(range.times.end_ns, last_ns_)});
  }
  return left;
}

Status ExcludedTime::Tell(const RecordingInfo& info, Findings* findings) const {
  if (ranges_.empty()) return {};
  double readings = 0.0, seconds = 0.0;
  const std::vector<TimeRange> left = Left();
  for (std::size_t i = 0; i < ranges_.size(); ++i) {
    const TimeRange& times = left[i];
    readings += static_cast<double>(readings_[i]);
    seconds += 1e-9 * static_cast<double>(times.end_ns - times.start_ns);
    if (readings_[i] > 0) continue;
    return ErrorIn(ErrorCode::kNotInRecording,
                   ranges_[i].stated_in,
                   "no reading of " + info.path +
                       " lies in it, or another range has them already; expected seconds from "
                       "the recording's first sample");
  }
  findings->push_back(Finding(FindingCode::kExcluded,
                              Format("%.0f readings", readings) + Format(" in %.6g s", seconds) +
                                  " are left out, as `exclude:` asks")
                          .With("readings", readings)
                          .With("duration", seconds, "s"));
  return {};
}

}  // namespace truetriad
