// SPDX-License-Identifier: Apache-2.0
#include "model/attitude_sets.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace truetriad {
namespace attitude_sets_test {

using Quaternions = std::vector<Eigen::Quaterniond>;

double SmallestAngle(const Quaternions& attitudes) {
  double smallest = std::numbers::pi;
  for (std::size_t i = 0; i < attitudes.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      smallest = std::min(smallest, attitudes[i].angularDistance(attitudes[j]));
    }
  }
  return smallest;
}

TEST(AttitudeSets, SixFacesPutEachFaceUpOnceWithTheLeastTurn) {
  const Quaternions faces = SixFaceAttitudes();
  ASSERT_EQ(faces.size(), 6U);
  for (int k = 0; k < 6; ++k) {
    const auto& face = faces[static_cast<std::size_t>(k)];
    const Eigen::Vector3d up = (k % 2 == 0 ? 1.0 : -1.0) * Eigen::Vector3d::Unit(k / 2);
    EXPECT_LT((face * up - Eigen::Vector3d::UnitZ()).norm(), 1e-15);
    const double least = std::acos(up.z());
    EXPECT_NEAR(face.angularDistance(Eigen::Quaterniond::Identity()), least, 1e-7);
  }
}

TEST(AttitudeSets, CubeHasItsTwentyFourRotations) {
  const Quaternions cube = CubeAttitudes();
  ASSERT_EQ(cube.size(), 24U);
  EXPECT_NEAR(SmallestAngle(cube), std::numbers::pi / 2.0, 1e-7);
  for (const auto& attitude : cube) {
    const Eigen::Matrix3d m = attitude.toRotationMatrix();
    EXPECT_LT(
        (m.cwiseAbs() - m.cwiseAbs().unaryExpr([](double x) { return std::round(x); })).norm(),
        1e-15);
    EXPECT_NEAR(m.determinant(), 1.0, 1e-15);
  }
  // Four headings to a face, the faces in the order of SixFaceAttitudes.
  const Quaternions faces = SixFaceAttitudes();
  for (std::size_t k = 0; k < 24; ++k) {
    const Eigen::Vector3d up = cube[k].conjugate() * Eigen::Vector3d::UnitZ();
    EXPECT_LT((faces[k / 4] * up - Eigen::Vector3d::UnitZ()).norm(), 1e-15);
  }
}

TEST(AttitudeSets, SpreadAttitudesAreFarApartAndCoverTheSphere) {
  for (const int count : {12, 24, 100, 600}) {
    const Quaternions spread = SpreadAttitudes(count);
    ASSERT_EQ(spread.size(), static_cast<std::size_t>(count));
    // N balls of that angle's half fill SO(3) (volume 8 pi^2; a ball of radius r has about
    // 4/3 pi r^3) to no less than a twentieth.
    const double radius = SmallestAngle(spread) / 2.0;
    EXPECT_GT(count * 4.0 / 3.0 * std::pow(radius, 3) / (8.0 * std::numbers::pi), 0.05) << count;
    Eigen::Matrix3d moment = Eigen::Matrix3d::Zero();
    for (const auto& attitude : spread) {
      EXPECT_NEAR(attitude.norm(), 1.0, 1e-15);
      const Eigen::Vector3d up = attitude.conjugate() * Eigen::Vector3d::UnitZ();
      moment += up * up.transpose() / count;
    }
    EXPECT_LT((moment - Eigen::Matrix3d::Identity() / 3.0).cwiseAbs().maxCoeff(), 0.1) << count;
  }
  EXPECT_TRUE(SpreadAttitudes(0).empty());
}

Eigen::Quaterniond Turn(double degrees, const Eigen::Vector3d& axis) {
  return Eigen::Quaterniond(Eigen::AngleAxisd(degrees * std::numbers::pi / 180.0, axis));
}

TEST(AttitudeSets, WordsSayWhatIsUpAndWhereTheFirstAxisPoints) {
  using Eigen::Vector3d;
  EXPECT_EQ(AttitudeInWords(Eigen::Quaterniond::Identity()), "z up, x to the north");
  EXPECT_EQ(AttitudeInWords(Turn(90.0, Vector3d::UnitZ())), "z up, x to the west");
  EXPECT_EQ(AttitudeInWords(Turn(-135.0, Vector3d::UnitZ())), "z up, x 45 deg east of south");
  EXPECT_EQ(AttitudeInWords(SixFaceAttitudes()[0]), "x up, y to the west");
  EXPECT_EQ(AttitudeInWords(SixFaceAttitudes()[5]), "-z up, x to the north");
  // A turn about y by -20 deg raises x; a turn about x by -5 deg lowers y.
  EXPECT_EQ(AttitudeInWords(Turn(30.0, Vector3d::UnitZ()) * Turn(-20.0, Vector3d::UnitY())),
            "z up, x 20 deg above level, x 30 deg west of north");
  EXPECT_EQ(AttitudeInWords(Turn(-5.0, Vector3d::UnitX())),
            "z up, y 5 deg below level, x to the north");
}

TEST(AttitudeSets, WordsTellTheOrientationsOfACubeApart) {
  std::vector<std::string> words;
  for (const auto& attitude : CubeAttitudes()) words.push_back(AttitudeInWords(attitude));
  std::sort(words.begin(), words.end());
  EXPECT_EQ(std::unique(words.begin(), words.end()), words.end());
  EXPECT_THAT(words, testing::Each(testing::Not(testing::HasSubstr("deg"))));
}

}  // namespace attitude_sets_test
}  // namespace truetriad
