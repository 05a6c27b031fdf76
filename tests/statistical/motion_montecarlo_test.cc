// SPDX-License-Identifier: Apache-2.0
//
// A unit that is tumbled without rests, against known truth: errors against their bound, and
// whether the printed covariance holds.

#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "math/distributions.h"
#include "support/nightly.h"
#include "support/six_turns.h"

namespace truetriad {
namespace motion_montecarlo_test {

using trials::DrawSixTurns;
using trials::RecordSixTurns;
using trials::SixTurns;
using trials::SixTurnsOptions;

Eigen::Vector3d NoPush(double /*time_s*/) { return Eigen::Vector3d::Zero(); }

// One triad's errors and their bound, squared and summed over the runs.
struct Squares {
  double bias = 0.0, bias_bound = 0.0;
  double matrix = 0.0, matrix_bound = 0.0;
};

// Errors over their bound, from the same motion without noise at the true parameters: of all
// parameters together, and the RMS over units of each triad's norms.
void ExpectEfficient(const char* row, bool held, double spacing_s, std::uint64_t seed) {
  const int runs = IsNightly() ? 20 : 6;
  PerTriad<Squares> squares;
  double chi2 = 0.0, chi2_of_bound = 0.0, dof = 0.0;
  for (int run = 0; run < runs; ++run) {
    Random random(seed + static_cast<std::uint64_t>(run));
    SixTurns unit = DrawSixTurns(&random);
    if (!IsNightly()) unit.samples = 4000;
    const auto options = SixTurnsOptions(unit, held, spacing_s);
    const auto exact = Calibrate(RecordSixTurns(unit, 0.0, NoPush, &random), options);
    const auto noisy = Calibrate(RecordSixTurns(unit, 1.0, NoPush, &random), options);
    ASSERT_TRUE(exact && exact->calibration.IsUsable()) << "run " << run;
    ASSERT_TRUE(noisy && noisy->calibration.IsUsable()) << "run " << run;
    const Eigen::VectorXd error = trials::SixTurnsErrors(unit, noisy->calibration);
    const Eigen::MatrixXd& bound = exact->calibration.covariance.matrix;
    for (const Triad triad : kTriads) {
      const auto at = 12 * static_cast<Eigen::Index>(triad);
      Squares& sum = squares[triad];
      sum.bias += error.segment<3>(at).squaredNorm();
      sum.bias_bound += bound.diagonal().segment<3>(at).sum();
      sum.matrix += error.segment<9>(at + 3).squaredNorm();
      sum.matrix_bound += bound.diagonal().segment<9>(at + 3).sum();
    }
    const trials::JointError joint =
        trials::JointErrorOf(error, noisy->calibration.covariance.matrix);
    chi2 += joint.chi2;
    chi2_of_bound += trials::JointErrorOf(error, bound).chi2;
    dof += joint.dof;
  }
  // Of all parameters in units of their bound. Its square has a standard error of sqrt(2 / dof),
  // of 20 runs with 18 parameters 7 %: 3.3 of them.
  const double efficiency = std::sqrt(chi2_of_bound / dof);
  EXPECT_LT(efficiency, 1.03 * std::sqrt(1.0 + 3.3 * std::sqrt(2.0 / dof)));
  const auto rms = [runs](double sum) { return std::sqrt(sum / runs); };
  std::string text;
  for (const Triad triad : kTriads) {
    const Squares& sum = squares[triad];
    // A norm of three to nine errors, over the runs: its RMS has a standard error of at most
    // 1 / sqrt(2 runs). 3.3 of them, and what curvature may add.
    const double most = 1.05 + 3.3 / std::sqrt(2.0 * runs);
    EXPECT_LT(rms(sum.bias) / rms(sum.bias_bound), most) << TriadName(triad);
    char cell[160];
    std::snprintf(
        cell, sizeof cell, " %.3g (%.3f) |", rms(sum.bias), rms(sum.bias) / rms(sum.bias_bound));
    text += cell;
    if (!(sum.matrix_bound > 0.0)) {
      text += " held |";
      continue;
    }
    EXPECT_LT(rms(sum.matrix) / rms(sum.matrix_bound), most) << TriadName(triad);
    std::snprintf(cell,
                  sizeof cell,
                  " %.3g (%.3f) |",
                  rms(sum.matrix),
                  rms(sum.matrix) / rms(sum.matrix_bound));
    text += cell;
  }
  const double p = ChiSquareCdf(chi2, dof);
  EXPECT_GT(p, 0.0005) << chi2 / dof;
  EXPECT_LT(p, 0.9995) << chi2 / dof;
  std::printf("@motion | %s |%s %.3f | %.3f |\n", row, text.c_str(), efficiency, chi2 / dof);
}

TEST(Motion, ReachesTheBoundWithHeldMatrices) {
  ExpectEfficient(
      "accelerometer and gyroscope matrices held, one attitude a sample", true, 0.0, 1000);
}

TEST(Motion, ReachesTheBoundWithEverythingFree) {
  ExpectEfficient("everything free, one attitude a sample", false, 0.0, 2000);
}

TEST(Motion, LosesNothingByFewerAttitudes) {
  ExpectEfficient("everything free, an attitude every 0.1 s", false, 0.1, 2000);
}

}  // namespace motion_montecarlo_test
}  // namespace truetriad
