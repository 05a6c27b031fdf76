// SPDX-License-Identifier: Apache-2.0
#include "data/length_spread.h"

#include <cmath>

#include <gtest/gtest.h>

#include "math/random.h"

namespace truetriad {
namespace length_spread_test {

// Directions all over the sphere, lengths of `sigma` about 3; every n-th a spike.
LengthSpread::Half HalfOf(double sigma, int every, int count = 20000) {
  Random random(5);
  LengthSpread spread;
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d direction = random.Rotation() * Eigen::Vector3d::UnitX();
    spread.Add((every > 0 && i % every == 0 ? 10.0 : 3.0 * (1.0 + sigma * random.Normal())) *
               direction);
  }
  return spread.ShortestHalf();
}

// Of 512 to 1024 readings the shorth's σ is known to 5 %, and half of it is some 10 % short.
TEST(LengthSpread, IsThatOfMostReadings) {
  const LengthSpread::Half half = HalfOf(1e-3, 0);
  EXPECT_NEAR(half.length, 3.0, 3e-3);
  EXPECT_NEAR(half.scatter, 1e-3, 0.25e-3);
  EXPECT_GT(half.extent.minCoeff(), 1.8);
}

TEST(LengthSpread, IsNotThatOfSpikes) {
  EXPECT_LT(HalfOf(0.0, 7).scatter, 1e-12);
  EXPECT_NEAR(HalfOf(1e-3, 7).length, 3.0, 3e-3);
}

TEST(LengthSpread, NeedsTwoReadings) {
  LengthSpread spread;
  EXPECT_EQ(spread.ShortestHalf().length, 0.0);
  spread.Add(Eigen::Vector3d::UnitX());
  EXPECT_EQ(spread.ShortestHalf().length, 0.0);
  spread.Add(2.0 * Eigen::Vector3d::UnitY());
  EXPECT_EQ(spread.ShortestHalf().length, 1.5);
}

}  // namespace length_spread_test
}  // namespace truetriad
