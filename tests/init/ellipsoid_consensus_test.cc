// SPDX-License-Identifier: Apache-2.0
#include "init/ellipsoid_consensus.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "init/ellipsoid_fit.h"

namespace truetriad {
namespace ellipsoid_consensus_test {

using Eigen::Matrix3d;
using Eigen::Vector3d;

class EllipsoidConsensus : public testing::Test {
 protected:
  Vector3d Draw() { return {normal_(random_), normal_(random_), normal_(random_)}; }

  // Of an ellipsoid off the origin, in any direction, with 1 % noise.
  std::vector<Vector3d> Good(std::size_t count) {
    std::vector<Vector3d> readings;
    for (std::size_t k = 0; k < count; ++k) {
      readings.push_back(shape_ * (Draw().normalized() + 0.01 * Draw()) + centre_);
    }
    return readings;
  }

  // The error of a centre has σ = 1 % of a radius over sqrt(n / 3); shapes scatter likewise.
  void ExpectFound(std::vector<Vector3d> readings, std::size_t good) {
    std::shuffle(readings.begin(), readings.end(), random_);
    const std::vector<Vector3d> own = ReadingsOfOneEllipsoid(readings, false);
    EXPECT_GT(own.size(), 0.98 * static_cast<double>(good));
    const Result<Ellipsoid> ellipsoid = FitEllipsoid(own);
    ASSERT_TRUE(ellipsoid) << ellipsoid.error().message;
    const double sigma = 0.01 / std::sqrt(static_cast<double>(good) / 3.0);
    EXPECT_LT((shape_.inverse() * (ellipsoid->centre - centre_)).norm(), 10.0 * sigma);
  }

  std::mt19937_64 random_{4};
  std::normal_distribution<double> normal_;
  Matrix3d shape_ = (Matrix3d() << 40.0, 3.0, -2.0, 0.0, 55.0, 4.0, 0.0, 0.0, 47.0).finished();
  Vector3d centre_{30.0, -70.0, 10.0};
};

TEST_F(EllipsoidConsensus, SurvivesOneReadingAtFiveRadii) {
  std::vector<Vector3d> readings = Good(300);
  readings.emplace_back(250.0, 0.0, 0.0);
  ExpectFound(readings, 300);
}

TEST_F(EllipsoidConsensus, SurvivesAFifthOfAnything) {
  for (const double spread : {30.0, 100.0, 1e4, 1e9}) {
    for (const std::size_t count : {std::size_t{40}, std::size_t{300}, std::size_t{30000}}) {
      std::vector<Vector3d> readings = Good(count * 4 / 5);
      for (std::size_t k = 0; k < count / 5; ++k) readings.push_back(spread * Draw());
      ExpectFound(readings, count * 4 / 5);
    }
  }
}

TEST_F(EllipsoidConsensus, CountsAReadingThatRepeatsOnce) {
  std::vector<Vector3d> readings = Good(200);
  readings.insert(readings.end(), 300, Vector3d(10.0, 20.0, 30.0));
  ExpectFound(readings, 200);
}

TEST_F(EllipsoidConsensus, HasNothingToSayOfTooFewOrFlatReadings) {
  EXPECT_TRUE(ReadingsOfOneEllipsoid(Good(9), false).empty());
  std::vector<Vector3d> flat = Good(50);
  for (Vector3d& reading : flat) reading.z() = 3.0;
  EXPECT_TRUE(ReadingsOfOneEllipsoid(flat, false).empty());
}

}  // namespace ellipsoid_consensus_test
}  // namespace truetriad
