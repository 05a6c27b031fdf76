// SPDX-License-Identifier: Apache-2.0
#include "verdict/lost_rows.h"

#include <cmath>
#include <vector>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "math/random.h"

namespace truetriad {
namespace lost_rows_test {

constexpr double kField = 48.0, kSigma = 0.25, kSpacingS = 0.02;

struct Rows {
  std::vector<std::int64_t> time_ns;
  std::vector<Eigen::Vector3d> rate, field;
};

LostRowCounter Counted(const Rows& rows) {
  LostRowCounter counter({}, {}, kSigma / kField);
  counter.Add(rows.time_ns, rows.rate, rows.field);
  return counter;
}

// A unit that turns about an axis that wanders; the rows that are lost are missing while the times
// are regular.
template <typename IsLost>
Rows Turn(double rate_radps, const IsLost& is_lost, std::uint64_t seed) {
  Random random(seed);
  Eigen::Quaterniond attitude = Eigen::Quaterniond::Identity();
  Rows rows;
  for (int i = 0; i < 6000; ++i) {
    const double t = kSpacingS * i;
    const Eigen::Vector3d omega =
        rate_radps *
        Eigen::Vector3d(std::cos(0.3 * t), std::sin(0.3 * t), std::sin(0.17 * t)).normalized();
    attitude = attitude *
               Eigen::Quaterniond(Eigen::AngleAxisd(omega.norm() * kSpacingS, omega.normalized()));
    if (is_lost(i, &random)) continue;
    rows.time_ns.push_back(
        std::llround(1e9 * kSpacingS * static_cast<double>(rows.time_ns.size())));
    rows.rate.push_back(omega);
    rows.field.push_back(attitude.conjugate() *
                             Eigen::Vector3d(0.5 * kField, 0.0, -0.866 * kField) +
                         kSigma * random.Normal3());
  }
  return rows;
}

template <typename IsLost>
double ShareFound(double rate_radps, const IsLost& is_lost, std::uint64_t seed) {
  return Counted(Turn(rate_radps, is_lost, seed)).Share();
}

double ShareFound(double lost, std::uint64_t seed) {
  return ShareFound(
      1.5, [lost](int, Random* random) { return random->Uniform() < lost; }, seed);
}

TEST(LostRows, NoneAreFoundWhereNoneAreLost) {
  for (std::uint64_t seed = 1; seed <= 50; ++seed) EXPECT_EQ(ShareFound(0.0, seed), 0.0);
}

TEST(LostRows, TheirShareIsFound) {
  for (const double lost : {0.03, 0.1, 0.2}) {
    // Of those that are lost some lie next to each other: k is 2 there and counts eightfold.
    EXPECT_GT(ShareFound(lost, 7), 0.8 * lost);
    EXPECT_LT(ShareFound(lost, 7), 3.0 * lost);
  }
}

// A sensor that is read every few rows, its reading being repeated meanwhile, as logs of drones
// have it: no rows are missing.
TEST(LostRows, RepeatedReadingsTellOfNone) {
  for (const std::size_t every : {2, 3, 4, 5, 8, 10, 20}) {
    Rows rows = Turn(
        1.5, [](int, Random*) { return false; }, 11);
    for (std::size_t i = 0; i < rows.field.size(); ++i) {
      rows.field[i] = rows.field[i - i % every];
    }
    const LostRowCounter counter = Counted(rows);
    EXPECT_EQ(counter.Share(), 0.0) << every;
    EXPECT_EQ(counter.AtRandom().chance, 1.0) << every;
  }
}

// Turns that begin at even times, so that their ends, where a row's rate says little of the step to
// the next, come every so many rows.
TEST(LostRows, RegularMovesAreNone) {
  constexpr double kSlowSpacingS = 0.1;
  constexpr int kCycle = 45, kMoving = 15;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Random random(seed);
    Eigen::Quaterniond attitude = Eigen::Quaterniond::Identity();
    std::vector<std::int64_t> time_ns;
    std::vector<Eigen::Vector3d> rate, field;
    Eigen::Vector3d axis = random.Normal3().normalized();
    const auto rate_at = [](double row) {
      const double into = (row - (kCycle - kMoving)) / kMoving;
      return into <= 0.0 || into >= 1.0 ? 0.0 : 1.2 * (1.0 - std::cos(2.0 * M_PI * into));
    };
    for (int i = 0; i < 40 * kCycle; ++i) {
      if (i % kCycle == 0) axis = random.Normal3().normalized();
      time_ns.push_back(std::llround(1e9 * kSlowSpacingS * i));
      rate.push_back(rate_at(i % kCycle) * axis);
      field.push_back(attitude.conjugate() * Eigen::Vector3d(0.5 * kField, 0.0, -0.866 * kField) +
                      0.05 * random.Normal3());
      double turned = 0.0;
      for (int k = 0; k < 20; ++k) {
        turned += kSlowSpacingS / 20.0 * rate_at(i % kCycle + (k + 0.5) / 20.0);
      }
      attitude = attitude * Eigen::Quaterniond(Eigen::AngleAxisd(turned, axis));
    }
    LostRowCounter counter({}, {}, 0.05 / kField);
    counter.Add(time_ns, rate, field);
    EXPECT_EQ(counter.Share(), 0.0) << seed;
  }
}

// At a rate at which noise is larger than a step, too.
TEST(LostRows, EveryNthIsFoundWhereStepsAreSmallerThanNoise) {
  for (const double rate_radps : {1.5, 0.3, 0.15}) {
    EXPECT_EQ(ShareFound(
                  rate_radps, [](int, Random*) { return false; }, 3),
              0.0);
    EXPECT_EQ(ShareFound(
                  rate_radps, [](int i, Random*) { return i % 5 == 4; }, 3),
              0.2);
  }
}

}  // namespace lost_rows_test
}  // namespace truetriad
