// SPDX-License-Identifier: Apache-2.0
#include "truetriad/math/rotation.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

namespace truetriad {
namespace rotation_test {

const Eigen::Vector3d kAxis = Eigen::Vector3d(1.0, -2.0, 0.5).normalized();

// From where series are used to beyond half a turn.
class Rotations : public ::testing::TestWithParam<double> {
 protected:
  Eigen::Vector3d vector() const { return GetParam() * kAxis; }
};

TEST_P(Rotations, LogUndoesExp) {
  const Eigen::Quaterniond rotation = RotationExp(vector());
  EXPECT_NEAR(rotation.norm(), 1.0, 4e-16);
  const Eigen::AngleAxisd expected(GetParam(), kAxis);
  EXPECT_LT((rotation.toRotationMatrix() - expected.toRotationMatrix()).norm(), 4e-15);
  if (GetParam() < std::numbers::pi) {
    EXPECT_LT((RotationLog(rotation) - vector()).norm(), 1e-15 * (1.0 + GetParam()));
    const Eigen::Quaterniond same(-rotation.coeffs());
    EXPECT_EQ(RotationLog(same), RotationLog(rotation));
  }
}

// Central differences with step h: truncation h^2 / 6 times the third derivative (about 1),
// rounding 1e-16 / h.
TEST_P(Rotations, JacobiansAreTheDerivatives) {
  constexpr double kStep = 1e-5;
  Eigen::Matrix3d right, inverse;
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d step = kStep * Eigen::Vector3d::Unit(i);
    const Eigen::Quaterniond at = RotationExp(vector());
    right.col(i) =
        RotationLog(RotationExp(vector() - step).conjugate() * RotationExp(vector() + step)) /
        (2.0 * kStep);
    inverse.col(i) = (RotationLog(at * RotationExp(step)) - RotationLog(at * RotationExp(-step))) /
                     (2.0 * kStep);
  }
  EXPECT_LT((RightJacobian(vector()) - right).norm(), 1e-9);
  if (GetParam() < 3.0) {
    EXPECT_LT((InverseRightJacobian(vector()) - inverse).norm(), 1e-9);
  }
  EXPECT_LT((InverseRightJacobian(vector()) * RightJacobian(vector()) - Eigen::Matrix3d::Identity())
                .norm(),
            1e-12);
}

INSTANTIATE_TEST_SUITE_P(OfAnyAngle,
                         Rotations,
                         ::testing::Values(0.0, 1e-12, 1e-5, 9.9e-3, 1.01e-2, 0.7, 3.1, 4.0));

}  // namespace rotation_test
}  // namespace truetriad
