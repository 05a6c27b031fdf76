// SPDX-License-Identifier: Apache-2.0
#include "data/trace_recorder.h"

#include <cstdint>
#include <limits>
#include <vector>

#include <Eigen/Core>

namespace truetriad {
namespace {

using Slice = ReadingTrace::Slice;

// The largest finite float, as infinity marks slices without a reading.
constexpr double kLargest = std::numeric_limits<float>::max();

Slice Empty() {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  return {Eigen::Vector3f::Constant(kInfinity), Eigen::Vector3f::Constant(-kInfinity)};
}

}  // namespace

void TraceRecorder::Halve() {
  std::vector<Slice>& slices = trace_.slices;
  if (slices.size() % 2 == 1) slices.push_back(Empty());
  const std::size_t half = slices.size() / 2;
  for (std::size_t i = 0; i < half; ++i) {
    const Slice first = slices[2 * i], second = slices[2 * i + 1];
    slices[i] = {first.lowest_raw.cwiseMin(second.lowest_raw),
                 first.highest_raw.cwiseMax(second.highest_raw)};
  }
  slices.resize(half);
  trace_.slice_ns = std::int64_t{1} << ++log2_slice_ns_;
}

void TraceRecorder::Add(const SampleBlock& block) {
  if (block.x.empty()) return;
  if (trace_.slice_ns == 0) {
    trace_.start_ns = block.time_ns[0];
    trace_.slice_ns = std::int64_t{1} << log2_slice_ns_;
  }
  for (std::size_t i = 0; i < block.x.size(); ++i) {
    // Unsigned, since no time is before the first and their difference may exceed the signed range.
    const auto since =
        static_cast<std::uint64_t>(block.time_ns[i]) - static_cast<std::uint64_t>(trace_.start_ns);
    std::uint64_t at = since >> log2_slice_ns_;
    for (; at >= kMostSlices; at /= 2) Halve();
    if (at >= trace_.slices.size()) trace_.slices.resize(at + 1, Empty());
    Slice& slice = trace_.slices[at];
    const Eigen::Vector3f reading = Eigen::Vector3d(block.x[i], block.y[i], block.z[i])
                                        .cwiseMax(-kLargest)
                                        .cwiseMin(kLargest)
                                        .cast<float>();
    slice.lowest_raw = slice.lowest_raw.cwiseMin(reading);
    slice.highest_raw = slice.highest_raw.cwiseMax(reading);
  }
}

}  // namespace truetriad
