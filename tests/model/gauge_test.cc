// SPDX-License-Identifier: Apache-2.0
#include <vector>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <gtest/gtest.h>

#include "truetriad/model/calibration.h"

namespace truetriad {
namespace gauge_test {

// Well and badly conditioned, permuted, mirrored, in counts.
std::vector<Eigen::Matrix3d> NastySensitivities() {
  std::vector<Eigen::Matrix3d> list(5);
  list[0] << 1.0, 0.01, -0.02, 0.03, 0.99, 0.0, 0.0, -0.01, 1.02;
  list[1] << 0.0, 414.0, 2.0, -3.0, 1.0, 412.0, 415.0, 0.0, 5.0;
  list[2] << 0.2, 0.03, 0.0, 0.0, -5.0, 0.7, 0.1, 0.0, 1.0;
  list[3] = -list[0];
  list[4] << 5.0, 0.7, -0.7, 0.02, 0.2, 0.03, 0.1, -0.1, 1.0;
  return list;
}

const std::vector<Gauge> kGauges = {Gauge::kAccelX, Gauge::kAccelZ, Gauge::kSymmetric};

TEST(Gauge, NamesRoundTrip) {
  for (const Gauge gauge : {Gauge::kAccelX, Gauge::kAccelZ, Gauge::kSymmetric, Gauge::kFixture}) {
    EXPECT_EQ(GaugeFromName(GaugeName(gauge)), gauge);
  }
  EXPECT_FALSE(GaugeFromName("accel-y"));
}

TEST(GaugeRotation, IsARotationThatGivesTheLeadingTriadItsForm) {
  for (const Eigen::Matrix3d& S : NastySensitivities()) {
    for (const Gauge gauge : kGauges) {
      for (const double sign : {1.0, -1.0}) {
        const Eigen::Matrix3d Q = GaugeRotation(gauge, S, sign);
        const double rounding = 1e-13 * S.norm();
        EXPECT_LT((Q.transpose() * Q - Eigen::Matrix3d::Identity()).norm(), 1e-13);
        EXPECT_NEAR(Q.determinant(), 1.0, 1e-13);
        const Eigen::Matrix3d stated = S * Q;
        if (gauge == Gauge::kAccelX) {
          EXPECT_LT(std::abs(stated(0, 1)) + std::abs(stated(0, 2)) + std::abs(stated(1, 2)),
                    rounding);
          EXPECT_GT(sign * stated(0, 0), 0.0);
          EXPECT_GT(sign * stated(1, 1), 0.0);
        } else if (gauge == Gauge::kAccelZ) {
          EXPECT_LT(std::abs(stated(1, 0)) + std::abs(stated(2, 0)) + std::abs(stated(2, 1)),
                    rounding);
          EXPECT_GT(sign * stated(2, 2), 0.0);
          EXPECT_GT(sign * stated(1, 1), 0.0);
        } else {
          EXPECT_LT((stated - stated.transpose()).norm(), rounding);
        }
      }
    }
  }
}

TEST(GaugeRotation, FixtureLeavesTheFrameAlone) {
  EXPECT_EQ(GaugeRotation(Gauge::kFixture, NastySensitivities()[1]), Eigen::Matrix3d::Identity());
}

TEST(GaugeRotationJacobian, MatchesFiniteDifferences) {
  for (const Eigen::Matrix3d& S : NastySensitivities()) {
    for (const Gauge gauge : kGauges) {
      const Eigen::Matrix3d Q = GaugeRotation(gauge, S);
      const auto jacobian = GaugeRotationJacobian(gauge, S, Q);
      const double step = 1e-6 * S.norm();
      for (int entry = 0; entry < 9; ++entry) {
        Eigen::Matrix3d up = S;
        Eigen::Matrix3d down = S;
        up(entry % 3, entry / 3) += step;
        down(entry % 3, entry / 3) -= step;
        // Q^T dQ = [omega]_x.
        const Eigen::Matrix3d skew =
            Q.transpose() * (GaugeRotation(gauge, up) - GaugeRotation(gauge, down)) / (2.0 * step);
        const Eigen::Vector3d omega(skew(2, 1), skew(0, 2), skew(1, 0));
        // Central differences: truncation (step/size)^2 ~ 1e-10 of the third derivative, which
        // grows with the cube of the condition number (25 here).
        EXPECT_LT((jacobian.col(entry) - omega).norm(), 1e-5 * (1.0 + omega.norm()))
            << GaugeName(gauge) << " entry " << entry << "\n"
            << S;
      }
    }
  }
}

}  // namespace gauge_test
}  // namespace truetriad
