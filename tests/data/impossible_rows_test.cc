// SPDX-License-Identifier: Apache-2.0
#include "data/impossible_rows.h"

#include <cmath>
#include <functional>
#include <random>
#include <set>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "data/memory_source.h"
#include "support/finding_matchers.h"

namespace truetriad {
namespace impossible_rows_test {

using Eigen::Vector3d;
using ::testing::ContainerEq;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

// A field that turns by a degree a row, in steps of `step`.
MemoryStream TurningField(double size, double sigma, double step, int rows = 3000) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal(0.0, sigma);
  MemoryStream stream(Triad::kMagnetometer);
  for (int i = 0; i < rows; ++i) {
    const double a = 0.0175 * i + 1.0, b = 0.0031 * i;
    const Vector3d noise(normal(random), normal(random), normal(random));
    const Vector3d truth(std::cos(a) * std::cos(b), std::sin(a) * std::cos(b), std::sin(b));
    stream.Add(10'000'000LL * i, ((size * truth + noise) / step).array().round() * step);
  }
  return stream;
}

void Put(std::int64_t row, const Vector3d& reading, MemoryStream* stream) {
  const auto i = static_cast<std::size_t>(row);
  stream->x[i] = reading.x(), stream->y[i] = reading.y(), stream->z[i] = reading.z();
}

struct Screened {
  std::set<std::int64_t> left;  // Rows.
  Findings findings;
};

Screened Screen(const MemoryStream& stream, std::size_t block_size = 4096) {
  Screened screened;
  MemorySource source({stream}, block_size);
  ImpossibleRows impossible;
  std::vector<SampleBlock> blocks;
  std::int64_t next = 0;
  for (bool more = true; more;) {
    more = *source.Next(&blocks);
    if (more) {
      impossible.Apply(&blocks);
    } else {
      impossible.Flush(&blocks);
    }
    for (const SampleBlock& block : blocks) {
      EXPECT_EQ(block.time_ns.size(), block.x.size());
      for (std::size_t i = 0; i < block.row.size(); ++i) {
        for (; next < block.row[i]; ++next) screened.left.insert(next);
        EXPECT_EQ(next++, block.row[i]);
        EXPECT_EQ(block.x[i], stream.x[static_cast<std::size_t>(block.row[i])]);
      }
    }
  }
  for (; next < static_cast<std::int64_t>(stream.x.size()); ++next) screened.left.insert(next);
  screened.findings = impossible.Left();
  return screened;
}

TEST(ImpossibleRows, LeavesAGoodStreamAsItIs) {
  // Axes cross zero and the extremes of 16 bits are no news.
  for (const MemoryStream& stream :
       {TurningField(50.0, 0.3, 0.15), TurningField(32767.0, 0.0, 1.0)}) {
    const Screened screened = Screen(stream);
    EXPECT_THAT(screened.left, IsEmpty());
    EXPECT_THAT(screened.findings, IsEmpty());
  }
}

TEST(ImpossibleRows, AreFoundWhateverTheBlocks) {
  for (const Vector3d& word : {Vector3d(0.0, 0.0, 0.0),
                               Vector3d(-32768.0, -32768.0, -32768.0),
                               Vector3d(9999.0, 9999.0, 9999.0),
                               Vector3d(1e30, 1.0, 2.0)}) {
    MemoryStream stream = TurningField(50.0, 0.3, 0.15);
    const std::set<std::int64_t> bad = {0, 100, 101, 102, 103, 104, 1500, 1502, 2999};
    for (const std::int64_t row : bad) Put(row, word, &stream);
    for (const std::size_t block_size : {std::size_t{3}, std::size_t{7}, std::size_t{4096}}) {
      const Screened screened = Screen(stream, block_size);
      EXPECT_EQ(screened.left, bad) << word.transpose() << " in blocks of " << block_size;
      ASSERT_THAT(screened.findings, ElementsAre(HasCode(FindingCode::kImpossibleRows)));
      EXPECT_EQ(screened.findings[0].Value("rows"), static_cast<double>(bad.size()));
      EXPECT_EQ(screened.findings[0].sensor, Triad::kMagnetometer);
    }
  }
}

TEST(ImpossibleRows, AreZerosAlsoWhereEachRowHasAnAttitudeOfItsOwn) {
  MemoryStream stream = TurningField(50.0, 0.3, 0.01);
  std::mt19937_64 random(2);
  std::normal_distribution<double> normal;
  for (std::size_t i = 0; i < stream.x.size(); ++i) {
    const Vector3d direction(normal(random), normal(random), normal(random));
    Put(static_cast<std::int64_t>(i), 50.0 * direction.normalized(), &stream);
  }
  const std::set<std::int64_t> bad = {10, 11, 700, 2000};
  for (const std::int64_t row : bad) Put(row, Vector3d::Zero(), &stream);
  EXPECT_EQ(Screen(stream).left, bad);
}

TEST(ImpossibleRows, AreNotTheZerosOfACoarseGyroscopeAtRest) {
  std::mt19937_64 random(3);
  for (const double bias : {0.0, 0.4, 2.0}) {
    for (const double sigma : {0.2, 0.7, 3.0}) {
      std::normal_distribution<double> normal(bias, sigma);
      MemoryStream stream(Triad::kGyroscope);
      for (int i = 0; i < 5000; ++i) {
        // Rests of two seconds and turns of one.
        const double rate = i % 300 < 200 ? 0.0 : 900.0 * std::sin(0.0314 * (i % 300 - 200));
        stream.Add(10'000'000LL * i,
                   {std::round(rate + normal(random)),
                    std::round(0.3 * rate + normal(random)),
                    std::round(normal(random))});
      }
      EXPECT_THAT(Screen(stream).left, IsEmpty()) << bias << " " << sigma;
    }
  }
}

TEST(ImpossibleRows, AreNotTheZerosOfARestWithoutNoise) {
  MemoryStream stream(Triad::kGyroscope);
  for (int i = 0; i < 3000; ++i) {
    const double rate = i % 300 < 200 ? 0.0 : 1.7 * std::sin(0.031415926 * (i % 300 - 200));
    stream.Add(10'000'000LL * i, {rate, 0.3 * rate, -0.2 * rate});
  }
  EXPECT_THAT(Screen(stream).left, IsEmpty());
}

TEST(ImpossibleRows, AreNotRestsThatWereJoined) {
  std::mt19937_64 random(6);
  std::normal_distribution<double> normal(0.0, 0.02);
  MemoryStream stream(Triad::kAccelerometer);
  for (int i = 0; i < 20000; ++i) {
    const double side = i / 100 % 2 == 0 ? 1.0 : -1.0;
    stream.Add(10'000'000LL * i, {normal(random), normal(random), 9.8 * side + normal(random)});
  }
  EXPECT_THAT(Screen(stream).left, IsEmpty());
}

}  // namespace impossible_rows_test
}  // namespace truetriad
