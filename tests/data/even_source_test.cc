// SPDX-License-Identifier: Apache-2.0
#include "data/even_source.h"

#include <cmath>
#include <random>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "data/memory_source.h"
#include "support/finding_matchers.h"
#include "truetriad/data/pose_collection.h"

namespace truetriad {
namespace even_source_test {

using ::testing::Contains;
using ::testing::IsEmpty;

constexpr std::int64_t kPeriodNs = 10'000'000;

// Turned to and fro once a second.
Eigen::Vector3d ReadingAt(std::int64_t time_ns, std::mt19937* random) {
  std::normal_distribution<double> noise(0.0, 0.01);
  const double turned = std::sin(6.283e-9 * static_cast<double>(time_ns));
  return {turned + noise(*random), 2.0 * turned + noise(*random), 10.0 + noise(*random)};
}

// Stamps that are up to 5 ms late of readings that were taken evenly, or when stamped.
MemoryStream Late(Triad triad, std::size_t samples, bool are_true = false) {
  MemoryStream stream(triad);
  std::mt19937 random(1);
  std::uniform_int_distribution<std::int64_t> late(0, 5'000'000);
  for (std::size_t i = 0; i < samples; ++i) {
    const std::int64_t time_ns = static_cast<std::int64_t>(i) * kPeriodNs;
    const std::int64_t stamp_ns = time_ns + late(random);
    stream.Add(stamp_ns, ReadingAt(are_true ? stamp_ns : time_ns, &random));
  }
  return stream;
}

MemoryStream Regular(Triad triad, std::size_t samples) {
  MemoryStream stream(triad);
  std::mt19937 random(1);
  for (std::size_t i = 0; i < samples; ++i) {
    const std::int64_t time_ns = static_cast<std::int64_t>(i) * kPeriodNs;
    stream.Add(time_ns, ReadingAt(time_ns, &random));
  }
  return stream;
}

// All that comes out, and what is said.
struct Passed {
  PerTriad<std::vector<std::int64_t>> time_ns, row;
  PerTriad<std::vector<double>> x;
  PerTriad<StreamSummary> summaries;
  Findings findings;
};

Passed Pass(const std::vector<MemoryStream>& streams, TimeStamps how = TimeStamps::kAuto) {
  MemorySource source(streams);
  ExcludedTime excluded({});
  EvenSource even(&source, &excluded, how);
  Passed passed;
  for (std::vector<SampleBlock> blocks; *even.Next(&blocks);) {
    for (const SampleBlock& block : blocks) {
      const auto append = [](auto* values, const auto& more) {
        values->insert(values->end(), more.begin(), more.end());
      };
      append(&passed.time_ns[block.triad], block.time_ns);
      append(&passed.row[block.triad], block.row);
      append(&passed.x[block.triad], block.x);
    }
  }
  for (const MemoryStream& stream : streams) {
    StreamSummary& summary = passed.summaries[stream.info.triad];
    summary.triad = stream.info.triad;
    even.Describe(&summary, &passed.findings);
  }
  return passed;
}

double LargestStep(const std::vector<std::int64_t>& times, double from_period) {
  double largest = 0.0;
  for (std::size_t i = 1; i < times.size(); ++i) {
    const auto step = static_cast<double>(times[i] - times[i - 1]);
    largest = std::max(largest, std::abs(step - from_period));
  }
  return largest;
}

TEST(EvenSource, PassesRegularStampsOn) {
  const MemoryStream stream = Regular(Triad::kAccelerometer, 20'000);
  const Passed passed = Pass({stream});
  EXPECT_EQ(passed.time_ns[Triad::kAccelerometer], stream.time_ns);
  EXPECT_EQ(passed.x[Triad::kAccelerometer], stream.x);
  EXPECT_EQ(passed.summaries[Triad::kAccelerometer].stamps, StampKind::kRegular);
  EXPECT_THAT(passed.findings, IsEmpty());
}

// More than is held at once: half a million samples of two sensors.
TEST(EvenSource, EvensLateStampsThroughALongRecording) {
  const std::vector<MemoryStream> streams = {Late(Triad::kAccelerometer, 250'000),
                                             Regular(Triad::kGyroscope, 250'000)};
  const Passed passed = Pass(streams);
  for (const MemoryStream& stream : streams) {
    const Triad triad = stream.info.triad;
    EXPECT_EQ(passed.row[triad], stream.row);
    EXPECT_EQ(passed.x[triad], stream.x);
  }
  EXPECT_EQ(passed.time_ns[Triad::kGyroscope], streams[1].time_ns);
  // Lines about neighbouring samples are nearly the same, also where one batch ends and the next
  // begins.
  EXPECT_LT(LargestStep(passed.time_ns[Triad::kAccelerometer], kPeriodNs), 0.02 * kPeriodNs);
  const StreamSummary& summary = passed.summaries[Triad::kAccelerometer];
  EXPECT_EQ(summary.stamps, StampKind::kJittered);
  EXPECT_TRUE(summary.are_stamps_even);
  // Evenly between 0 and 5 ms.
  EXPECT_NEAR(summary.jitter_s, 5e-3 / std::sqrt(12.0), 1e-4);
  EXPECT_THAT(passed.findings, Contains(HasCode(FindingCode::kEvenTimes)));
}

TEST(EvenSource, LeavesStampsThatTheReadingsConfirm) {
  const MemoryStream stream = Late(Triad::kAccelerometer, 20'000, /*are_true=*/true);
  const Passed passed = Pass({stream});
  EXPECT_EQ(passed.time_ns[Triad::kAccelerometer], stream.time_ns);
  EXPECT_EQ(passed.summaries[Triad::kAccelerometer].stamps, StampKind::kJittered);
  EXPECT_THAT(passed.findings, IsEmpty());
}

TEST(EvenSource, DoesAsItIsTold) {
  const MemoryStream stream = Late(Triad::kAccelerometer, 20'000);
  const Passed stamped = Pass({stream}, TimeStamps::kAsStamped);
  EXPECT_EQ(stamped.time_ns[Triad::kAccelerometer], stream.time_ns);
  EXPECT_THAT(stamped.findings, Contains(HasCode(FindingCode::kUnevenTimes)));

  const MemoryStream as_taken = Late(Triad::kAccelerometer, 20'000, /*are_true=*/true);
  const Passed regular = Pass({as_taken}, TimeStamps::kRegular);
  EXPECT_LT(LargestStep(regular.time_ns[Triad::kAccelerometer], kPeriodNs), 0.02 * kPeriodNs);
}

// Where a clock jumps back it is not sorted by what makes stamps even.
TEST(EvenSource, LeavesTimeThatGoesBack) {
  MemoryStream stream = Late(Triad::kAccelerometer, 2000);
  stream.time_ns[1500] = 0;
  EXPECT_EQ(Pass({stream}).time_ns[Triad::kAccelerometer], stream.time_ns);
}

// A sensor of 20 ms read by a clock of 15.6 ms looks as if one sample in five were lost.
TEST(EvenSource, TellsASlowClockFromLostSamplesByTheReadings) {
  MemoryStream evenly(Triad::kAccelerometer), lost(Triad::kAccelerometer);
  std::mt19937 random(1);
  for (std::int64_t i = 0; i < 6000; ++i) {
    const std::int64_t time_ns = 20'000'000 * i, stamp_ns = time_ns / 15'625'000 * 15'625'000;
    evenly.Add(stamp_ns, ReadingAt(time_ns, &random));
    lost.Add(stamp_ns, ReadingAt(stamp_ns, &random));
  }
  EXPECT_EQ(Pass({evenly}).summaries[Triad::kAccelerometer].stamps, StampKind::kOnTicks);
  EXPECT_EQ(Pass({lost}).time_ns[Triad::kAccelerometer], lost.time_ns);
}

}  // namespace even_source_test
}  // namespace truetriad
