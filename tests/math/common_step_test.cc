// SPDX-License-Identifier: Apache-2.0
#include "math/common_step.h"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "math/random.h"

namespace truetriad {
namespace {

std::vector<double> Distances(double step, int count, double range, std::uint64_t seed) {
  Random random(seed);
  std::vector<double> distances;
  double last = 0.0;
  for (int i = 0; i < count; ++i) {
    double value = range * random.Uniform();
    if (step > 0.0) value = step * std::round(value / step);
    distances.push_back(std::abs(value - last));
    last = value;
  }
  return distances;
}

TEST(CommonStep, IsThatOfRoundedValues) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    EXPECT_NEAR(CommonStep(Distances(0.04, 36, 20.0, seed)), 0.04, 1e-8);
    EXPECT_NEAR(CommonStep(Distances(1.0, 36, 32768.0, seed)), 1.0, 1e-4);
  }
}

TEST(CommonStep, IsZeroWhereNoneShows) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    EXPECT_EQ(CommonStep(Distances(0.0, 36, 20.0, seed)), 0.0);
  }
  EXPECT_EQ(CommonStep({}), 0.0);
  EXPECT_EQ(CommonStep({0.0, 0.0}), 0.0);
  EXPECT_EQ(CommonStep({0.04, 0.12, 0.2}), 0.0);                    // too few
  EXPECT_EQ(CommonStep({1.0, 2.0, 1.0, 0.0, 1.0, 2.0, 1.0}), 0.0);  // ideal readings
}

}  // namespace
}  // namespace truetriad
