// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include <gtest/gtest.h>

#include "line/chart_plan.h"

namespace truetriad::line {
namespace run_length_test {

// Lucas and Saccucci 1990, Technometrics 32, table 3; to the digits printed there (half of the last
// one, relative where the width is rounded to three decimals: the run length changes by 1.5 a
// σ/10).
TEST(EwmaRunLength, AgreesWithLucasAndSaccucci) {
  EXPECT_NEAR(EwmaRunLength(0.1, 2.814), 500.0, 1.0);
  EXPECT_NEAR(EwmaRunLength(0.1, 2.814, 1.0), 10.3, 0.05);
  EXPECT_NEAR(EwmaRunLength(0.25, 2.998), 500.0, 1.0);
  EXPECT_NEAR(EwmaRunLength(0.25, 2.998, 1.0), 11.1, 0.05);
  EXPECT_NEAR(EwmaRunLength(0.4, 3.054), 500.0, 1.0);
  // λ = 1 is Shewhart's chart: one over the probability to be outside of 3 σ.
  EXPECT_NEAR(EwmaRunLength(1.0, 3.0), 1.0 / std::erfc(3.0 / std::sqrt(2.0)), 1e-6);
}

// By another method: a Markov chain of 801 states (Brook and Evans 1972), whose error (3e-4) falls
// with the square of their number. python3, numpy:
//   h=L*(lam/(2-lam))**.5; m=801; w=2*h/m; x=-h+w*(np.arange(m)+.5)
//   Q=norm.cdf((x[None]+w/2-(1-lam)*x[:,None])/lam)-norm.cdf((x[None]-w/2-(1-lam)*x[:,None])/lam)
//   np.linalg.solve(np.eye(m)-Q,np.ones(m))[m//2]
TEST(EwmaRunLength, AgreesWithAMarkovChain) {
  EXPECT_NEAR(EwmaRunLength(0.08, 3.88), 18604.871, 1e-3 * 18604.871);
  EXPECT_NEAR(EwmaRunLength(0.1, 2.7), 368.977, 1e-3 * 368.977);
}

TEST(EwmaRunLength, WidthUndoesIt) {
  for (const double run_length : {50.0, 370.0, 20000.0, 1e6}) {
    const double width = EwmaWidth(0.08, run_length);
    EXPECT_NEAR(EwmaRunLength(0.08, width) / run_length, 1.0, 1e-5);
  }
}

}  // namespace run_length_test
}  // namespace truetriad::line
