// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>

#include "truetriad/data/sample_source.h"
#include "truetriad/data/static_pose.h"

namespace truetriad {

/// Makes the trace of one triad while its readings stream by, with constant memory: if there are
/// too many slices, pairs of slices are merged into slices twice as long.
class TraceRecorder {
 public:
  /// Merging leaves 512 to 1024 slices: about one per unit of a drawing's width, which is 670.
  static constexpr std::size_t kMostSlices = 1024;

  void Add(const SampleBlock& block);
  /// Gives the trace away; nothing may be added afterwards.
  ReadingTrace Take() { return std::move(trace_); }

 private:
  void Halve();

  ReadingTrace trace_;
  int log2_slice_ns_ = 20;  ///< At first: 2^20 ns is about a millisecond.
};

}  // namespace truetriad
