// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>

#include "truetriad/data/sample_source.h"
#include "truetriad/data/static_pose.h"

namespace truetriad {

/// Makes the trace of one triad while its readings stream by, with a memory that does not grow:
/// whenever the slices are too many, each two become one twice as long.
class TraceRecorder {
 public:
  /// Halving leaves 512 to 1024 slices, about one per unit of a drawing's width of 670.
  static constexpr std::size_t kMostSlices = 1024;

  void Add(const SampleBlock& block);
  /// All of it; nothing is to be added then.
  ReadingTrace Take() { return std::move(trace_); }

 private:
  void Halve();

  ReadingTrace trace_;
  int log2_slice_ns_ = 20;  ///< About a millisecond.
};

}  // namespace truetriad
