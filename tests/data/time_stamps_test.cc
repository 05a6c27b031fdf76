// SPDX-License-Identifier: Apache-2.0
#include "data/time_stamps.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace truetriad {
namespace time_stamps_test {

constexpr std::int64_t kPeriodNs = 10'000'000;
constexpr std::size_t kSamples = 6000;  // A minute at 100 Hz.

std::vector<std::int64_t> Even(std::size_t count = kSamples) {
  std::vector<std::int64_t> times;
  for (std::size_t i = 0; i < count; ++i) {
    times.push_back(1'000'000'000 + static_cast<std::int64_t>(i) * kPeriodNs);
  }
  return times;
}

// A scheduler that is 5 ms early, in time or 5 ms late.
std::vector<std::int64_t> Jittered(const std::vector<std::int64_t>& times) {
  std::mt19937 random(1);
  std::uniform_int_distribution<std::int64_t> late(-1, 1);
  std::vector<std::int64_t> stamps;
  for (const std::int64_t time_ns : times) {
    const std::int64_t stamp = time_ns + late(random) * 5'000'000;
    stamps.push_back(stamps.empty() ? stamp : std::max(stamp, stamps.back()));
  }
  return stamps;
}
const double kJitterNs = 5e6 * std::sqrt(2.0 / 3.0);

// A host that asks for samples each time that `burst` of them wait.
std::vector<std::int64_t> InBursts(const std::vector<std::int64_t>& times, std::size_t burst) {
  std::vector<std::int64_t> stamps;
  for (std::size_t i = 0; i < times.size(); ++i) {
    const std::size_t last = std::min(i - i % burst + burst, times.size()) - 1;
    stamps.push_back(times[last] + 20'000 * static_cast<std::int64_t>(i % burst));
  }
  return stamps;
}

std::vector<double> ErrorsNs(const EvenTimes& even, const std::vector<std::int64_t>& times) {
  std::vector<double> errors;
  for (std::size_t i = 0; i < times.size(); ++i) {
    errors.push_back(static_cast<double>(even.time_ns[i] - times[i]));
  }
  return errors;
}

double Rms(const std::vector<double>& errors) {
  double squares = 0.0;
  for (const double error : errors) squares += error * error;
  return std::sqrt(squares / static_cast<double>(errors.size()));
}

double Spread(const std::vector<double>& errors) {
  const auto [low, high] = std::minmax_element(errors.begin(), errors.end());
  return *high - *low;
}

// What a turn of 128 samples is too long or too short by, as a share.
double WorstRateOverATurn(const std::vector<double>& errors) {
  constexpr std::size_t kTurn = 128;
  double worst = 0.0;
  for (std::size_t i = kTurn; i < errors.size(); i += kTurn) {
    worst = std::max(worst, std::abs(errors[i] - errors[i - kTurn]));
  }
  return worst / static_cast<double>(kTurn * kPeriodNs);
}

TEST(EvenTimes, AreTheStampsOfARegularClock) {
  const EvenTimes even = FitEvenTimes({Even()});
  EXPECT_EQ(even.kind, StampKind::kRegular);
  EXPECT_FALSE(even.AreEvident());
  EXPECT_NEAR(even.period_ns, kPeriodNs, 1e-6);
  EXPECT_EQ(even.time_ns, Even());
}

// Lines through some 700 samples (biweight) leave a twenty-fifth of the jitter, four times as much
// at the ends.
TEST(EvenTimes, AreFreeOfAJitteringScheduler) {
  const EvenTimes even = FitEvenTimes({Jittered(Even())});
  EXPECT_EQ(even.kind, StampKind::kJittered);
  EXPECT_TRUE(even.AreEvident());
  EXPECT_NEAR(even.jitter_ns, kJitterNs, 0.1 * kJitterNs);
  EXPECT_LT(Rms(ErrorsNs(even, Even())), kJitterNs / 10.0);
}

// Late by half an interval (half-normal): no step tells the period, and a wrong one would make up
// for itself by samples that seem lost, 0.5 % off while the unit moves.
TEST(EvenTimes, TakeNoSampleForLostThatJitterHides) {
  for (std::uint32_t seed = 1; seed <= 20; ++seed) {
    std::mt19937 random(seed);
    std::normal_distribution<double> late(0.0, 0.575 * kPeriodNs);
    std::vector<std::int64_t> stamps;
    for (const std::int64_t time_ns : Even()) {
      const std::int64_t stamp = time_ns + std::llround(std::abs(late(random)));
      stamps.push_back(stamps.empty() ? stamp : std::max(stamp, stamps.back() + 1));
    }
    const EvenTimes even = FitEvenTimes({stamps});
    EXPECT_LT(Spread(ErrorsNs(even, Even())), 0.5 * kPeriodNs) << seed;
  }
}

// The last sample of a burst is in time but for the 20 us that each takes.
TEST(EvenTimes, OfBurstsAreThoseOfTheSamplesThatDidNotWait) {
  for (const std::size_t burst : {2, 8, 32, 64}) {
    const EvenTimes even = FitEvenTimes({InBursts(Even(), burst)});
    EXPECT_EQ(even.kind, StampKind::kInBursts) << burst;
    EXPECT_LT(Rms(ErrorsNs(even, Even())), 20'000.0 * static_cast<double>(burst)) << burst;
  }
}

// Each burst waits for its host, by 12 ms RMS about the mean; a line through all of two minutes
// leaves of the rate 25 ppm (12 ms / sqrt(188 bursts) / (120 s / sqrt(12))), 1e-4 at 4 σ. Lines
// through 1024 samples left 0.1 %.
TEST(EvenTimes, OfBurstsThatComeLateAreAsLongLinesTellThem) {
  for (std::uint32_t seed = 1; seed <= 20; ++seed) {
    constexpr std::size_t kBurst = 64;
    const std::vector<std::int64_t> times = Even(2 * kSamples);
    std::vector<std::int64_t> stamps = InBursts(times, kBurst);
    std::mt19937 random(seed);
    std::normal_distribution<double> late(0.0, 20e6);
    std::int64_t delay = 0;
    for (std::size_t i = 0; i < stamps.size(); ++i) {
      if (i % kBurst == 0) delay = std::llround(std::abs(late(random)));
      stamps[i] += delay;
    }
    const EvenTimes even = FitEvenTimes({stamps});
    EXPECT_EQ(even.kind, StampKind::kInBursts) << seed;
    const std::vector<double> errors = ErrorsNs(even, times);
    EXPECT_LT(WorstRateOverATurn(errors), 1e-4) << seed;
  }
}

// The same read as windows of a FIFO, whose samples are stamped evenly up to the last; two are
// lost, and the last is cut and stamped at its end.
TEST(EvenTimes, OfWindowsAreThoseOfTheirLastSamples) {
  constexpr std::int64_t kWindow = 64;
  for (std::uint32_t seed = 1; seed <= 20; ++seed) {
    std::mt19937 random(seed);
    std::normal_distribution<double> late(0.0, 20e6);
    std::vector<std::int64_t> times, rows, stamps;
    std::int64_t before_ns = 0, number = 0;
    for (std::int64_t window = 0; window < 188; ++window) {
      number += window == 20 || window == 21 ? kWindow : 0;
      const std::int64_t size = window == 187 ? 10 : kWindow;
      const std::int64_t end_ns =
          (number + size) * kPeriodNs + std::llround(std::abs(late(random)));
      const bool is_lost = end_ns - before_ns > 960'000'000;
      const std::int64_t span_ns = is_lost ? 640'000'000 : end_ns - before_ns;
      for (std::int64_t i = 0; i < size; ++i) {
        rows.push_back(static_cast<std::int64_t>(rows.size()));
        times.push_back((number + i + 1) * kPeriodNs);
        stamps.push_back(end_ns - span_ns + span_ns * (i + 1) / size);
      }
      number += size;
      before_ns = end_ns;
    }
    const EvenTimes even = FitEvenTimes({stamps, rows, kWindow});
    EXPECT_EQ(even.kind, StampKind::kInBursts) << seed;
    EXPECT_EQ(even.lost, 2.0 * kWindow) << seed;
    const std::vector<double> errors = ErrorsNs(even, times);
    EXPECT_LT(WorstRateOverATurn(errors), 1e-4) << seed;
  }
}

// A clock that is rounded is off by a constant, which nothing shows.
TEST(EvenTimes, OfTicksAreEvenWithinThem) {
  for (const std::int64_t tick : {3, 7, 14, 50, 100}) {
    std::vector<std::int64_t> stamps = Even();
    for (std::int64_t& stamp : stamps) stamp = stamp / (tick * 1'000'000) * (tick * 1'000'000);
    const EvenTimes even = FitEvenTimes({stamps});
    EXPECT_EQ(even.kind, StampKind::kOnTicks) << tick;
    EXPECT_LT(Spread(ErrorsNs(even, Even())), 0.5 * kPeriodNs) << tick;
  }
}

TEST(EvenTimes, KeepASampleThatWasLostAmongJitter) {
  std::vector<std::int64_t> times = Even();
  for (const std::size_t lost : {4200, 3001, 3000, 900}) {
    times.erase(times.begin() + static_cast<std::ptrdiff_t>(lost));
  }
  const EvenTimes even = FitEvenTimes({Jittered(times)});
  EXPECT_EQ(even.kind, StampKind::kJittered);
  EXPECT_LT(Rms(ErrorsNs(even, times)), kJitterNs / 10.0);
}

// Of bursts it is not known which of a burst's samples it was.
TEST(EvenTimes, KeepASampleThatWasLostInABurst) {
  std::vector<std::int64_t> times = Even();
  std::vector<std::int64_t> stamps = InBursts(times, 4);
  for (std::size_t lost = 5900; lost > 100; lost -= 67) {
    times.erase(times.begin() + static_cast<std::ptrdiff_t>(lost));
    stamps.erase(stamps.begin() + static_cast<std::ptrdiff_t>(lost));
  }
  const EvenTimes even = FitEvenTimes({stamps});
  EXPECT_EQ(even.kind, StampKind::kInBursts);
  EXPECT_NEAR(even.period_ns, kPeriodNs, 1e-3 * kPeriodNs);
  EXPECT_LT(Rms(ErrorsNs(even, times)), 0.25 * kPeriodNs);
}

TEST(EvenTimes, BeginAnewAfterAGap) {
  std::vector<std::int64_t> times = Even();
  for (std::size_t i = 2000; i < times.size(); ++i) times[i] += 12'345'678'901;
  const EvenTimes even = FitEvenTimes({Jittered(times)});
  EXPECT_EQ(even.kind, StampKind::kJittered);
  EXPECT_LT(Rms(ErrorsNs(even, times)), kJitterNs / 10.0);
}

// A sensor that warms up: its rate changes by a thousandth in a minute, 30 ms in all.
TEST(EvenTimes, FollowClocksThatDrift) {
  std::vector<std::int64_t> times = Even();
  for (std::size_t i = 0; i < times.size(); ++i) {
    const double share = static_cast<double>(i) / static_cast<double>(times.size());
    times[i] += std::llround(0.5 * 1e-3 * share * share * 60e9);
  }
  const EvenTimes even = FitEvenTimes({Jittered(times)});
  EXPECT_EQ(even.kind, StampKind::kJittered);
  EXPECT_LT(Rms(ErrorsNs(even, times)), kJitterNs / 10.0);
}

// Each sample waits for the one before.
TEST(EvenTimes, AreNotEvidentWhereDelaysAddUp) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> late(0.0, 0.5);
  std::vector<std::int64_t> stamps = {0};
  for (std::size_t i = 1; i < kSamples; ++i) {
    stamps.push_back(stamps.back() + std::llround(kPeriodNs * (1.0 + late(random))));
  }
  const EvenTimes even = FitEvenTimes({stamps});
  EXPECT_EQ(even.kind, StampKind::kIrregular);
  EXPECT_FALSE(even.AreEvident());
}

TEST(EvenTimes, AreNotMadeOfAFewStamps) { EXPECT_TRUE(FitEvenTimes({Even(20)}).time_ns.empty()); }

TEST(StampWatch, PassesRegularStampsAndLostSamplesAndNoOthers) {
  const auto passes = [](const std::vector<std::int64_t>& stamps) {
    return StampWatch().AreEven(stamps);
  };
  EXPECT_TRUE(passes(Even()));
  std::vector<std::int64_t> times = Even();
  std::mt19937 random(1);
  std::erase_if(times, [&](std::int64_t) { return random() % 50 == 0; });
  EXPECT_TRUE(passes(times));
  EXPECT_FALSE(passes(Jittered(Even())));
  for (const std::size_t burst : {2, 32, 64}) EXPECT_FALSE(passes(InBursts(Even(), burst)));
  EXPECT_FALSE(passes(std::vector<std::int64_t>(100, 7)));
}

// Readings of a turn to and fro, once a second.
StampShare ShareOf(const std::vector<std::int64_t>& stamps,
                   const std::vector<std::int64_t>& times,
                   double amplitude) {
  std::mt19937 random(2);
  std::normal_distribution<double> noise;
  std::array<std::vector<double>, 3> axes;
  for (const std::int64_t time_ns : times) {
    const double turned =
        amplitude * std::sin(2e-9 * std::numbers::pi * static_cast<double>(time_ns));
    for (std::size_t axis = 0; axis < 3; ++axis) {
      axes[axis].push_back(turned * static_cast<double>(axis) + noise(random));
    }
  }
  return ShareOfStamps(stamps, axes[0], axes[1], axes[2], kPeriodNs);
}

TEST(StampShare, IsOneWhereReadingsWereTakenWhenStamped) {
  const StampShare share = ShareOf(Jittered(Even()), Jittered(Even()), 100.0);
  EXPECT_NEAR(share.beta, 1.0, 4.0 * share.sigma);
  EXPECT_TRUE(share.StampsAreTrue());
}

TEST(StampShare, IsZeroWhereReadingsWereTakenEvenly) {
  const StampShare share = ShareOf(Jittered(Even()), Even(), 100.0);
  EXPECT_NEAR(share.beta, 0.0, 4.0 * share.sigma);
  EXPECT_LT(share.sigma, 0.1);
  EXPECT_FALSE(share.StampsAreTrue());
}

TEST(StampShare, IsNotKnownAtRest) {
  EXPECT_FALSE(ShareOf(Jittered(Even()), Jittered(Even()), 0.0).StampsAreTrue());
}

// The gaps between bursts are left out, and the few steps that remain show nothing.
TEST(StampShare, IsNotKnownOfLongBursts) {
  for (const std::size_t burst : {26, 64}) {
    EXPECT_FALSE(ShareOf(InBursts(Even(), burst), Even(), 100.0).StampsAreTrue()) << burst;
  }
}

// A sensor at half the rate of the log, which is read in bursts: its readings change where stamps
// do.
TEST(StampShare, IsNotKnownOfReadingsThatRepeat) {
  std::vector<std::int64_t> read = Even();
  for (std::size_t i = 1; i < read.size(); i += 2) read[i] = read[i - 1];
  std::vector<double> readings;
  for (const std::int64_t time_ns : read) {
    readings.push_back(std::sin(2e-9 * std::numbers::pi * static_cast<double>(time_ns)));
  }
  const StampShare share =
      ShareOfStamps(InBursts(Even(), 6), readings, readings, readings, kPeriodNs);
  EXPECT_EQ(share.sigma, 0.0);
}

}  // namespace time_stamps_test
}  // namespace truetriad
