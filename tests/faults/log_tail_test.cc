// SPDX-License-Identifier: Apache-2.0
#include "faults/log_tail.h"

#include <cmath>

#include <gtest/gtest.h>

#include "math/distributions.h"

namespace truetriad {
namespace log_tail_test {

TEST(LogTail, IsThatOfFisherWhereADoubleHoldsIt) {
  for (const double dof1 : {1.0, 3.0, 9.0, 12.0}) {
    for (const double dof2 : {1.0, 4.5, 20.0, 300.0}) {
      for (const double value : {0.01, 0.5, 1.0, 3.0, 40.0}) {
        const double upper = FisherUpper(value, dof1, dof2);
        EXPECT_NEAR(LogFisherUpper(value, dof1, dof2), std::log(upper), 1e-9)
            << dof1 << " " << dof2 << " " << value;
      }
    }
  }
}

TEST(LogTail, IsThatOfChiSquareWithTwoDegreesOfFreedom) {
  for (const double value : {1e-3, 1.0, 5.0, 700.0, 2e5}) {
    EXPECT_NEAR(LogChiSquareUpper(value, 2.0), -0.5 * value, 1e-11 * (1.0 + value));
  }
}

// P(F(2, ν) > f) = (1 + 2 f / ν)^(-ν/2).
TEST(LogTail, KeepsItsDigitsWhereTheTailUnderflows) {
  for (const double dof : {3.0, 60.0, 5000.0}) {
    for (const double value : {1.0, 1e3, 1e7}) {
      const double expected = -0.5 * dof * std::log1p(2.0 * value / dof);
      EXPECT_NEAR(LogFisherUpper(value, 2.0, dof), expected, 1e-8 * std::abs(expected));
    }
  }
}

TEST(LogTail, OfFisherGoesToThatOfChiSquare) {
  EXPECT_NEAR(LogFisherUpper(10.0, 3.0, 9.9e4), LogFisherUpper(10.0, 3.0, 1.1e5), 0.01);
}

}  // namespace log_tail_test
}  // namespace truetriad
