// SPDX-License-Identifier: Apache-2.0
#include "model/world.h"

#include <numbers>

#include <gtest/gtest.h>

namespace truetriad {
namespace world_test {

// A few roundings of numbers of this size.
constexpr double kTiny = 1e-13;

TEST(World, ForceAtRestPointsUp) { EXPECT_EQ(ForceInWorld(9.81), Eigen::Vector3d(0.0, 0.0, 9.81)); }

TEST(World, FieldOfPositiveDipPointsNorthAndDown) {
  const Eigen::Vector3d field = FieldInWorld(50.0, std::numbers::pi / 3.0);
  EXPECT_LT((field - Eigen::Vector3d(25.0, 0.0, -25.0 * std::numbers::sqrt3)).norm(), kTiny);
}

TEST(World, HeadingTurnsTheFieldAboutTheVertical) {
  const Eigen::Vector3d field = FieldInWorld(50.0, 0.0, std::numbers::pi / 2.0);
  EXPECT_LT((field - Eigen::Vector3d(0.0, 50.0, 0.0)).norm(), kTiny);
}

// Magnetic north east of true north puts true north, where the earth's axis points, to the west,
// which is +y.
TEST(World, EarthRateLeansToTrueNorth) {
  const Eigen::Vector3d rate = EarthRateInWorld(std::numbers::pi / 6.0, 0.1);
  EXPECT_NEAR(rate.norm(), kEarthRateRadps, kTiny);
  EXPECT_NEAR(rate.z(), 0.5 * kEarthRateRadps, kTiny);
  EXPECT_NEAR(std::atan2(rate.y(), rate.x()), 0.1, kTiny);
}

}  // namespace world_test
}  // namespace truetriad
