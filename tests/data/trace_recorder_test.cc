// SPDX-License-Identifier: Apache-2.0
#include "data/trace_recorder.h"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "data/memory_source.h"

namespace truetriad {
namespace trace_recorder_test {

using Eigen::Vector3d;

ReadingTrace TraceOf(const MemoryStream& stream, std::size_t block_size = 4096) {
  TraceRecorder recorder;
  MemorySource source({stream}, block_size);
  std::vector<SampleBlock> blocks;
  for (bool more = true; more;) {
    more = *source.Next(&blocks);
    for (const SampleBlock& block : blocks) recorder.Add(block);
  }
  return recorder.Take();
}

bool IsEmpty(const ReadingTrace::Slice& slice) {
  return !(slice.lowest_raw[0] <= slice.highest_raw[0]);
}

TEST(TraceRecorder, KeepsTheOneBadReadingOfAMillion) {
  constexpr std::int64_t kReadings = 1'000'000, kSpacingNs = 10'000'000, kBad = 765'432;
  MemoryStream stream(Triad::kAccelerometer);
  for (std::int64_t i = 0; i < kReadings; ++i) {
    stream.Add(i * kSpacingNs, i == kBad ? Vector3d(0.0, -50.0, 0.0) : Vector3d(0.0, 1.0, 9.8));
  }
  const ReadingTrace trace = TraceOf(stream);
  EXPECT_LE(trace.slices.size(), TraceRecorder::kMostSlices);
  EXPECT_GT(trace.slices.size(), TraceRecorder::kMostSlices / 2);
  for (std::size_t i = 0; i < trace.slices.size(); ++i) {
    const auto begin = static_cast<std::int64_t>(i) * trace.slice_ns;
    const bool is_bad = begin <= kBad * kSpacingNs && kBad * kSpacingNs < begin + trace.slice_ns;
    EXPECT_EQ(trace.slices[i].lowest_raw[1], is_bad ? -50.0F : 1.0F) << i;
    EXPECT_EQ(trace.slices[i].highest_raw[2], 9.8F) << i;
  }
}

TEST(TraceRecorder, IsTheSameHoweverTheReadingsCome) {
  MemoryStream stream(Triad::kGyroscope);
  for (std::int64_t i = 0; i < 5000; ++i) {
    stream.Add(1'000'000'000 + i * 7'000'000 + (i > 3000 ? 9'000'000'000 : 0),
               Vector3d(static_cast<double>(i % 17), -static_cast<double>(i), 0.5));
  }
  const ReadingTrace whole = TraceOf(stream), pieces = TraceOf(stream, 7);
  ASSERT_EQ(whole.slices.size(), pieces.slices.size());
  EXPECT_EQ(whole.slice_ns, pieces.slice_ns);
  EXPECT_EQ(whole.start_ns, 1'000'000'000);
  bool has_gap = false;
  for (std::size_t i = 0; i < whole.slices.size(); ++i) {
    EXPECT_EQ(whole.slices[i].lowest_raw, pieces.slices[i].lowest_raw);
    EXPECT_EQ(whole.slices[i].highest_raw, pieces.slices[i].highest_raw);
    has_gap = has_gap || IsEmpty(whole.slices[i]);
  }
  EXPECT_TRUE(has_gap);
  EXPECT_EQ(whole.slices.back().lowest_raw[1], -4999.0F);
}

TEST(TraceRecorder, HoldsReadingsBeyondWhatAFloatDoes) {
  MemoryStream stream(Triad::kAccelerometer);
  stream.Add(0, Vector3d(1e300, -1e300, 0.0));
  const ReadingTrace trace = TraceOf(stream);
  EXPECT_EQ(trace.slices[0].highest_raw[0], std::numeric_limits<float>::max());
  EXPECT_EQ(trace.slices[0].lowest_raw[1], std::numeric_limits<float>::lowest());
}

TEST(TraceRecorder, HoldsTimesThatAreFurtherApartThanTheirTypeCanSay) {
  constexpr std::int64_t kFirst = std::numeric_limits<std::int64_t>::min();
  constexpr std::int64_t kLast = std::numeric_limits<std::int64_t>::max();
  MemoryStream stream(Triad::kAccelerometer);
  stream.Add(kFirst, Vector3d::Zero());
  stream.Add(kLast, Vector3d::Ones());
  const ReadingTrace trace = TraceOf(stream);
  ASSERT_LE(trace.slices.size(), TraceRecorder::kMostSlices);
  EXPECT_EQ(trace.slices.front().lowest_raw[0], 0.0F);
  EXPECT_EQ(trace.slices.back().highest_raw[0], 1.0F);
}

}  // namespace trace_recorder_test
}  // namespace truetriad
