// SPDX-License-Identifier: Apache-2.0
#include "init/six_position.h"

#include <array>
#include <vector>

#include <Eigen/Geometry>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace truetriad {
namespace six_position_test {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using testing::HasSubstr;

constexpr double kGravity = 9.8;

const std::vector<int> kFaces = {0, 5, 2, 1, 4, 3};  // +x -z +y -x +z -y

// Counts, offset 8 times the signal, gains 25 times apart, cross-axis 15 % of the row's gain.
TriadModel<double> NastyModel() {
  TriadModel<double> model;
  model.sensitivity << 500.0, -75.0, 75.0, 3.0, 20.0, -3.0, 15.0, 15.0, 100.0;
  model.bias << 40e3, -1.6e3, 8e3;
  return model;
}

std::vector<Vector3d> FaceReadings(const TriadModel<double>& model, const std::vector<int>& faces) {
  std::vector<Vector3d> readings;
  for (const int face : faces) {
    const double up = face % 2 == 0 ? kGravity : -kGravity;
    readings.push_back(model.RawFromTruth(up * Vector3d::Unit(face / 2)));
  }
  return readings;
}

TEST(SixPositionKnownForce, SolvesThePublishedCase) {
  const std::array<Vector3d, 6> forces = {Vector3d(8.90824804e-05, -6.20375208e-05, -9.79496514),
                                          Vector3d(1.48275457e-04, -1.10436760e-01, 9.79419008),
                                          Vector3d(3.06869928e-04, -9.79499159, -4.09315067e-02),
                                          Vector3d(-1.73602602e-04, 9.79438219, 6.92753399e-02),
                                          Vector3d(9.79475112, 2.27139296e-04, -1.53404379e-02),
                                          Vector3d(-9.79437605, 2.96217751e-04, 2.76735700e-02)};
  Matrix3d error;
  error << 0.0024, -0.0333, 0.064222, 0.0343, 0.25, 0.0089, 0.0080, 0.00231, 0.26;
  std::array<Vector3d, 6> readings;
  for (std::size_t k = 0; k < readings.size(); ++k) {
    readings[k] = forces[k] + error * forces[k] + Vector3d(0.1, 0.2, 0.3);
  }
  const TriadModel<double> model = SixPositionKnownForce(readings, forces, kGravity);
  Matrix3d expected;
  expected << 0.0021122, -0.0328296, 0.0643740,  //
      0.0356829, 0.2484990, 0.0074873,           //
      0.0076120, 0.0033713, 0.2598432;
  // The reference values have seven decimals.
  EXPECT_LT((model.bias - Vector3d(0.1018152, 0.1861883, 0.2997726)).cwiseAbs().maxCoeff(), 5.1e-8);
  EXPECT_LT((model.sensitivity - Matrix3d::Identity() - expected).cwiseAbs().maxCoeff(), 5.1e-8);
}

TEST(SixPosition, IsExactWithoutNoise) {
  const TriadModel<double> truth = NastyModel();
  const auto model = SixPosition(FaceReadings(truth, kFaces), kFaces, kGravity);
  ASSERT_TRUE(model);
  // A few roundings of numbers of the size of the bias.
  EXPECT_LT((model->sensitivity - truth.sensitivity).norm(), 1e-11);
  EXPECT_LT((model->bias - truth.bias).norm(), 1e-10);
}

TEST(SixPosition, WeighsEveryFaceAlikeHoweverManyRestsItHas) {
  const TriadModel<double> truth = NastyModel();
  std::vector<int> faces = kFaces;
  faces.insert(faces.end(), {kFaces[0], kFaces[0]});
  std::vector<Vector3d> readings = FaceReadings(truth, faces);
  readings[6] += Vector3d(3.0, -1.0, 2.0);
  readings[7] -= Vector3d(3.0, -1.0, 2.0);
  const auto model = SixPosition(readings, faces, kGravity);
  ASSERT_TRUE(model);
  EXPECT_LT((model->sensitivity - truth.sensitivity).norm(), 1e-11);
  EXPECT_LT((model->bias - truth.bias).norm(), 1e-10);
}

TEST(SixPosition, NamesTheMissingFaces) {
  const std::vector<int> faces = {0, 1, 2, 3, 2};
  const auto model = SixPosition(FaceReadings(NastyModel(), faces), faces, kGravity);
  ASSERT_FALSE(model);
  EXPECT_EQ(model.error().kind(), ErrorKind::kNotEnough);
  EXPECT_THAT(model.error().message, HasSubstr("+z, -z"));
}

TEST(SixFaceExtremes, IsExactWithoutMisalignment) {
  TriadModel<double> truth = NastyModel();
  truth.sensitivity = truth.sensitivity.diagonal().asDiagonal().toDenseMatrix();
  const auto model = SixFaceExtremes(FaceReadings(truth, kFaces), kGravity);
  ASSERT_TRUE(model);
  EXPECT_LT((model->sensitivity - truth.sensitivity).norm(), 1e-11);
  EXPECT_LT((model->bias - truth.bias).norm(), 1e-10);
}

TEST(SixFaceExtremes, TakesCrossAxisInItsStride) {
  const auto model = SixFaceExtremes(FaceReadings(NastyModel(), kFaces), kGravity);
  ASSERT_TRUE(model) << model.error().message;
  EXPECT_TRUE(model->sensitivity.diagonal().isApprox(Vector3d(500.0, 20.0, 100.0), 1e-12));
}

TEST(SixFaceExtremes, RefusesAnAxisThatWasNeverUp) {
  const std::vector<int> faces = {0, 1, 2, 3, 5, 0};
  const auto model = SixFaceExtremes(FaceReadings(NastyModel(), faces), kGravity);
  ASSERT_FALSE(model);
  EXPECT_EQ(model.error().kind(), ErrorKind::kNotEnough);
  EXPECT_THAT(model.error().message, HasSubstr("+z"));
  EXPECT_FALSE(SixFaceExtremes({}, kGravity));
  EXPECT_FALSE(SixFaceExtremes({Vector3d(0, 0, 9.8)}, kGravity));
}

TEST(AssignFaces, FindsEveryFaceUnderOffsetGainsAndCrossAxis) {
  std::vector<int> faces = kFaces;
  faces.insert(faces.end(), kFaces.begin(), kFaces.begin() + 4);
  const auto assigned = AssignFaces(FaceReadings(NastyModel(), faces));
  ASSERT_TRUE(assigned) << assigned.error().message;
  EXPECT_EQ(*assigned, faces);
}

TEST(AssignFaces, RefusesAReadingBetweenTwoFacesByItsNumber) {
  const TriadModel<double> truth = NastyModel();
  std::vector<Vector3d> readings = FaceReadings(truth, kFaces);
  readings.push_back(truth.RawFromTruth(kGravity * Vector3d(0.0, -0.6, 0.8)));
  const auto assigned = AssignFaces(readings);
  ASSERT_FALSE(assigned);
  EXPECT_EQ(assigned.error().kind(), ErrorKind::kBadInput);
  EXPECT_THAT(assigned.error().message, HasSubstr("reading 7 of 7 lies between"));
}

TEST(AssignFaces, RefusesMissingFaces) {
  // Seven rests, y never down: enough readings for an ellipsoid, tilted a little so that it exists.
  TriadModel<double> truth;
  std::vector<Vector3d> readings;
  for (const Vector3d& direction : {Vector3d(1, 0.1, 0),
                                    Vector3d(1, 0, -0.2),
                                    Vector3d(-1, 0.2, 0.1),
                                    Vector3d(-0.1, 1, 0.2),
                                    Vector3d(0.2, 1, 0.1),
                                    Vector3d(0, -0.2, 1),
                                    Vector3d(0.2, -0.1, -1)}) {
    readings.push_back(truth.RawFromTruth(kGravity * direction.normalized()));
  }
  const auto assigned = AssignFaces(readings);
  ASSERT_FALSE(assigned);
  EXPECT_EQ(assigned.error().kind(), ErrorKind::kNotEnough);
  EXPECT_THAT(assigned.error().message, HasSubstr("-y"));
  // Exact faces, one missing: five points however often repeated.
  const std::vector<int> faces = {0, 1, 2, 4, 5, 5};
  EXPECT_EQ(AssignFaces(FaceReadings(NastyModel(), faces)).error().kind(), ErrorKind::kNotEnough);
}

}  // namespace six_position_test
}  // namespace truetriad
