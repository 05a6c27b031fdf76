// SPDX-License-Identifier: Apache-2.0
#include "planning/pose_order.h"

#include <algorithm>
#include <vector>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "math/random.h"
#include "model/attitude_sets.h"

namespace truetriad {
namespace pose_order_test {

TEST(OrderForOperator, NeedsLessTurningThanTheOrderOfTheGrid) {
  std::vector<ProgramPose> poses;
  for (const Eigen::Quaterniond& q : CubeAttitudes()) poses.push_back({q, {}, ""});
  std::vector<ProgramPose> shuffled = poses;
  Random random(3);
  for (std::size_t k = shuffled.size() - 1; k > 0; --k) {
    std::swap(shuffled[k], shuffled[static_cast<std::size_t>(random.Below(static_cast<int>(k)))]);
  }
  const std::vector<ProgramPose> ordered = OrderForOperator(shuffled, true);
  ASSERT_EQ(ordered.size(), poses.size());
  double turn = 0.0;
  for (std::size_t k = 1; k < ordered.size(); ++k) {
    turn += ordered[k - 1].world_from_body.angularDistance(ordered[k].world_from_body);
  }
  // No two of the 24 are nearer than a quarter turn; the shortest path has nothing else, and what
  // is found is allowed a tenth more.
  EXPECT_LT(turn, 1.1 * 23.0 * 0.5 * 3.14159265358979);
}

TEST(OrderForOperator, KeepsEachChamberTemperatureTogether) {
  std::vector<ProgramPose> poses;
  for (int k = 0; k < 12; ++k) {
    poses.push_back({CubeAttitudes()[static_cast<std::size_t>(k)], 10.0 * (k % 3), ""});
  }
  const std::vector<ProgramPose> ordered = OrderForOperator(poses, true);
  EXPECT_TRUE(std::is_sorted(ordered.begin(), ordered.end(), [](const auto& a, const auto& b) {
    return a.temperature_degc < b.temperature_degc;
  }));
}

}  // namespace pose_order_test
}  // namespace truetriad
