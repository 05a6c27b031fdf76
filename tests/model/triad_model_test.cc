// SPDX-License-Identifier: Apache-2.0
#include "truetriad/model/triad_model.h"

#include <cmath>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

namespace truetriad {
namespace triad_model_test {

TEST(TriadModel, CorrectionUndoesSensitivity) {
  TriadModel<double> model;
  model.sensitivity << 414.0, 3.0, -7.0, 1.0, -412.0, 2.0, 9.0, -4.0, 415.0;  // mirrored, in counts
  model.bias << 33124.0, -33275.0, 1e-3;
  const Eigen::Vector3d truth(9.8, -0.01, 3.0);
  const Eigen::Vector3d round_trip = model.TruthFromRaw(model.RawFromTruth(truth));
  // Rounding of raw (3e4 * 2^-52) divided by the gain, times the condition number (~1).
  EXPECT_LT((round_trip - truth).norm(), 1e-13);
}

// In counts, mirrored and misaligned, with terms of some per cent of the signal.
TriadModel<double> BentModel() {
  TriadModel<double> model;
  model.sensitivity << 414.0, 3.0, -7.0, 1.0, -412.0, 2.0, 9.0, -4.0, 415.0;
  model.bias << 33124.0, -33275.0, 1e-3;
  model.axis_terms[AxisTerm::kQuadratic] << 5e-6, -8e-6, 0.0;
  model.axis_terms[AxisTerm::kAsymmetry] << 0.02, -0.03, 0.05;
  return model;
}

TEST(TriadModel, HigherTermsAreUndoneOnBothSidesOfZero) {
  const TriadModel<double> model = BentModel();
  for (const Eigen::Vector3d& truth : {Eigen::Vector3d(9.8, 0.01, 3.0),
                                       Eigen::Vector3d(-9.8, -0.01, -3.0),
                                       Eigen::Vector3d(0.0, 9.8, 0.0),
                                       Eigen::Vector3d(0.0, 0.0, 0.0)}) {
    const Eigen::Vector3d round_trip = model.TruthFromRaw(model.RawFromTruth(truth));
    // As without them.
    EXPECT_LT((round_trip - truth).norm(), 1e-13);
  }
}

TEST(TriadModel, ItsSlopeIsTheDerivativeByWhatTheAxesFeel) {
  TriadModel<double> model = BentModel();
  model.sensitivity.setIdentity();  // the axes feel the truth itself
  const double step = 1.0;
  for (const double at : {-4000.0, 3000.0}) {
    const Eigen::Vector3d felt = Eigen::Vector3d::Constant(at);
    const Eigen::Vector3d up = felt + Eigen::Vector3d::Constant(step);
    const Eigen::Vector3d down = felt - Eigen::Vector3d::Constant(step);
    const Eigen::Vector3d derivative =
        (model.RawFromTruth(up) - model.RawFromTruth(down)) / (2.0 * step);
    // Exact for a parabola: rounding of 4e4 is left.
    EXPECT_LT((model.Slope(felt) - derivative).norm(), 1e-10);
  }
}

TEST(TriadModel, HigherTermsStayAsTheyAreInAnotherBodyFrame) {
  const TriadModel<double> model = BentModel();
  const Eigen::Vector3d truth(3.0, -8.0, 5.0);
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(0.7, Eigen::Vector3d(1.0, 2.0, -2.0) / 3.0).toRotationMatrix();
  TriadModel<double> turned = model;
  turned.sensitivity = model.sensitivity * turn;
  // Rounding of readings of 3e4.
  EXPECT_LT((turned.RawFromTruth(turn.transpose() * truth) - model.RawFromTruth(truth)).norm(),
            1e-10);
}

TEST(TriadModel, AReadingThatNothingGivesHasNoTruth) {
  TriadModel<double> model;
  model.axis_terms[AxisTerm::kQuadratic][0] = -0.01;  // turns round at u = 50, where it reads 25
  EXPECT_NEAR(model.TruthFromRaw({25.0, 0.0, 0.0})[0], 50.0, 1e-6);
  EXPECT_TRUE(std::isnan(model.TruthFromRaw({25.1, 0.0, 0.0})[0]));
}

// Without a closed form: from the root of the other terms by Newton's method.
TEST(TriadModel, CubicTermsAreUndoneBesideOthers) {
  TriadModel<double> model = BentModel();
  model.axis_terms[AxisTerm::kCubic] << 2e-9, -2e-9, 1e-9;  // 3 % of 4000
  for (const double size : {1e-9, 0.1, 3.0, 9.8}) {
    const Eigen::Vector3d truth(size, -0.7 * size, 0.4 * size);
    for (const Eigen::Vector3d& felt : {Eigen::Vector3d(truth), Eigen::Vector3d(-truth)}) {
      EXPECT_LT((model.TruthFromRaw(model.RawFromTruth(felt)) - felt).norm(), 1e-12);
    }
  }
}

TEST(TriadModel, TheSlopeOfACubicTermIsItsDerivative) {
  TriadModel<double> model;
  model.axis_terms[AxisTerm::kCubic] << 1e-3, -2e-3, 3e-3;
  const double step = 1e-3;
  const Eigen::Vector3d felt(5.0, -7.0, 3.0);
  const Eigen::Vector3d change = Eigen::Vector3d::Constant(step);
  const Eigen::Vector3d derivative =
      (model.RawFromTruth(felt + change) - model.RawFromTruth(felt - change)) / (2.0 * step);
  // The third derivative of 6 a times step^2 / 6.
  EXPECT_LT((model.Slope(felt) - derivative).norm(), 1e-8);
}

TEST(TriadModel, ACubicTermThatTurnsRoundHasNoTruthBeyond) {
  TriadModel<double> model;
  model.axis_terms[AxisTerm::kCubic][0] =
      -1.0 / 300.0;  // turns round at u = 10, where it reads 6.67
  for (const double sign : {1.0, -1.0}) {
    EXPECT_NEAR(model.TruthFromRaw({sign * 5.28, 0.0, 0.0})[0], sign * 6.0, 1e-12);
    EXPECT_TRUE(std::isnan(model.TruthFromRaw({sign * 6.7, 0.0, 0.0})[0]));
  }
}

TEST(TriadModel, TakesAnyScalar) {
  TriadModel<float> model;
  model.bias << 1.0F, 2.0F, 3.0F;
  EXPECT_EQ(model.RawFromTruth(Eigen::Vector3f::Zero()), model.bias);
}

}  // namespace triad_model_test
}  // namespace truetriad
