// SPDX-License-Identifier: Apache-2.0
#include "init/fixture_fit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "math/random.h"
#include "model/attitude_sets.h"

namespace truetriad {
namespace fixture_fit_test {

using ::testing::HasSubstr;

// Counts far from zero, axes swapped: nothing to guess from.
TriadModel<double> Counts() {
  TriadModel<double> model;
  model.sensitivity << 12.0, -410.0, 5.0, 405.0, 20.0, -9.0, 3.0, 8.0, 398.0;
  model.bias << 32768.0, 33100.0, 32000.0;
  return model;
}

TEST(FixtureFit, IsExactForAFixtureThatStandsInAnyWay) {
  Random random(5);
  for (const int poses : {6, 12, 24}) {
    for (int repeat = 0; repeat < 20; ++repeat) {
      const Eigen::Vector3d up = random.Normal3().normalized();
      std::vector<Eigen::Quaterniond> attitudes;
      std::vector<Eigen::Vector3d> readings;
      for (int k = 0; k < poses; ++k) {
        attitudes.push_back(random.Rotation());
        readings.push_back(
            Counts().RawFromTruth(Eigen::Vector3d(9.8 * (attitudes.back().conjugate() * up))));
      }
      const auto fit = FitInFixture(readings, attitudes, 9.8);
      ASSERT_TRUE(fit) << fit.error().message;
      // The search stops where its steps no longer lower a residual of rounding, 1e-11 of 3e4.
      EXPECT_LT((fit->direction - up).norm(), 1e-6) << poses << ' ' << repeat;
      EXPECT_LT((fit->model.sensitivity - Counts().sensitivity).norm(), 1e-3);
      EXPECT_LT((fit->model.bias - Counts().bias).norm(), 1e-2);
    }
  }
}

TEST(FixtureFit, NeedsAttitudesAboutSeveralAxes) {
  std::vector<Eigen::Quaterniond> attitudes;
  std::vector<Eigen::Vector3d> readings;
  for (int k = 0; k < 8; ++k) {
    attitudes.emplace_back(Eigen::AngleAxisd(0.7 * k, Eigen::Vector3d::UnitY()));
    readings.push_back(Counts().RawFromTruth(
        Eigen::Vector3d(attitudes.back().conjugate() * Eigen::Vector3d(0.0, 0.0, 9.8))));
  }
  const auto fit = FitInFixture(readings, attitudes, 9.8);
  ASSERT_FALSE(fit);
  EXPECT_THAT(fit.error().message, HasSubstr("several axes"));
}

}  // namespace fixture_fit_test
}  // namespace truetriad
