// SPDX-License-Identifier: Apache-2.0
#include "data/repeated_rows.h"

#include <cmath>
#include <cstdint>
#include <random>
#include <set>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "data/memory_source.h"
#include "support/finding_matchers.h"

namespace truetriad {
namespace repeated_rows_test {

using Eigen::Vector3d;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr std::int64_t kSpacingNs = 10'000'000;

// Rests of 3 s in directions that change, with noise, in steps; `held`: read so many times each.
std::vector<Vector3d> Readings(double sigma, double step, int held = 1, int rows = 6000) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  const auto draw = [&]() -> Vector3d {
    const double x = normal(random), y = normal(random), z = normal(random);
    return {x, y, z};
  };
  std::vector<Vector3d> readings;
  Vector3d rest = Vector3d::Zero();
  for (int i = 0; i < rows; ++i) {
    if (i % 300 == 0) rest = 10.0 * draw().normalized();
    if (i % held == 0)
      readings.emplace_back(((rest + sigma * draw()) / step).array().round() * step);
    if (i % held != 0) readings.push_back(readings.back());
  }
  return readings;
}

// With rows [begin, end) once more before row `at`.
std::vector<Vector3d> WithCopy(std::vector<Vector3d> readings, int begin, int end, int at) {
  const std::vector<Vector3d> copy(readings.begin() + begin, readings.begin() + end);
  readings.insert(readings.begin() + at, copy.begin(), copy.end());
  return readings;
}

struct Outcome {
  std::set<std::int64_t> left;  // Rows.
  std::vector<RepeatedStretch> stretches;
};

Outcome LeftOf(const std::vector<Vector3d>& readings, std::size_t block_size = 4096) {
  MemoryStream stream(Triad::kAccelerometer);
  for (const Vector3d& reading : readings) {
    stream.Add(kSpacingNs * static_cast<std::int64_t>(stream.row.size()), reading);
  }
  MemorySource source({stream}, block_size);
  RepeatedRows repeated;
  Outcome outcome;
  for (std::size_t i = 0; i < readings.size(); ++i) {
    outcome.left.insert(static_cast<std::int64_t>(i));
  }
  std::vector<SampleBlock> blocks;
  while (*source.Next(&blocks)) {
    repeated.Apply(&blocks);
    for (const SampleBlock& block : blocks) {
      EXPECT_EQ(block.x.size(), block.row.size());
      EXPECT_EQ(block.x.size(), block.time_ns.size());
      for (const std::int64_t row : block.row) outcome.left.erase(row);
    }
  }
  outcome.stretches = repeated.Stretches();
  return outcome;
}

std::set<std::int64_t> Rows(std::int64_t begin, std::int64_t end) {
  std::set<std::int64_t> rows;
  for (std::int64_t row = begin; row < end; ++row) rows.insert(row);
  return rows;
}

TEST(RepeatedRows, LeaveNoiseAsItIs) {
  for (const double step : {1e-7, 0.05, 0.1, 0.5, 5.0}) {
    EXPECT_THAT(LeftOf(Readings(0.1, step)).left, IsEmpty()) << step;
    EXPECT_THAT(LeftOf(Readings(0.1, step, 5)).left, IsEmpty()) << step;
  }
}

TEST(RepeatedRows, AreFoundBesideTheirOriginalAndFarFromIt) {
  const std::vector<Vector3d> readings = Readings(0.1, 0.01);
  for (const int at : {1200, 3000}) {
    const Outcome outcome = LeftOf(WithCopy(readings, 1000, 1200, at));
    EXPECT_EQ(outcome.left, Rows(at, at + 200));
    ASSERT_THAT(outcome.stretches, SizeIs(1));
    EXPECT_EQ(outcome.stretches[0].first_row, at);
    EXPECT_EQ(outcome.stretches[0].last_row, at + 199);
    EXPECT_EQ(outcome.stretches[0].of_row, 1000);
    EXPECT_EQ(outcome.stretches[0].first_ns, kSpacingNs * at);
    EXPECT_EQ(outcome.stretches[0].last_ns, kSpacingNs * (at + 199));
  }
}

TEST(RepeatedRows, AreFoundAsOftenAsTheyCome) {
  std::vector<Vector3d> readings = Readings(0.1, 0.01);
  readings = WithCopy(WithCopy(readings, 500, 800, 800), 500, 800, 2500);
  std::set<std::int64_t> expected = Rows(800, 1100);
  expected.merge(Rows(2500, 2800));
  EXPECT_EQ(LeftOf(readings).left, expected);
}

// What came before the repeat showed itself has been handed on: the run that shows it, and up to
// the next one that is remembered.
TEST(RepeatedRows, AreFoundAcrossBlocksButForTheirBeginning) {
  const std::set<std::int64_t> left =
      LeftOf(WithCopy(Readings(0.1, 0.01), 1000, 1400, 3000), 10).left;
  ASSERT_THAT(left, ::testing::Not(IsEmpty()));
  EXPECT_LT(*left.begin(), 3100);
  EXPECT_EQ(left, Rows(*left.begin(), 3400));
}

TEST(RepeatedRows, OfASensorThatIsReadFasterThanItMeasuresAreFound) {
  EXPECT_EQ(LeftOf(WithCopy(Readings(0.1, 0.01, 5), 1000, 2000, 3000)).left, Rows(3000, 4000));
}

TEST(RepeatedRows, AreNotSeenWhereNothingIsRandom) {
  // Whole turns without noise, in steps or not; a stuck sensor; two values that alternate between
  // ramps, as an axis near the edge of a step has them.
  std::vector<Vector3d> turning, stuck, flickering;
  for (int i = 0; i < 6000; ++i) {
    const double angle = 2.0 * M_PI * (i % 500) / 500.0;
    turning.emplace_back(10.0 * std::cos(angle), 10.0 * std::sin(angle), 1.0);
    stuck.emplace_back(1.0, 2.0, 3.0);
    const int part = i % 500;
    flickering.emplace_back(part < 30 ? part : 30 + part % 2, 0.0, 0.0);
  }
  EXPECT_THAT(LeftOf(turning).left, IsEmpty());
  EXPECT_THAT(LeftOf(stuck).left, IsEmpty());
  EXPECT_THAT(LeftOf(flickering).left, IsEmpty());
}

TEST(RepeatedRows, AreToldWithTheirPlace) {
  const Findings findings =
      FindingsOf(LeftOf(WithCopy(Readings(0.1, 0.01), 1000, 1200, 3000)).stretches, 0);
  ASSERT_THAT(findings, ElementsAre(HasCode(FindingCode::kRepeatedRows)));
  EXPECT_EQ(findings[0].Value("first_row"), 3000.0);
  EXPECT_EQ(findings[0].Value("of_row"), 1000.0);
  EXPECT_NEAR(*findings[0].Value("from"), 30.0, 1e-9);
}

}  // namespace repeated_rows_test
}  // namespace truetriad
