// SPDX-License-Identifier: Apache-2.0
#include "truetriad/estimation/calibrate.h"

#include <gtest/gtest.h>

#include "support/accel_mag_trials.h"

namespace truetriad {
namespace {

using trials::Errors;
using trials::JointOptions;
using trials::RandomUnit;
using trials::UnitSpread;

// Exact poses whose noise is stated as tiny.
PoseSet ExactPoses(const SyntheticUnit& unit, int count, Random* random) {
  PoseSet poses = SimulatePoses(unit, RandomAttitudes(count, random), SyntheticNoise{}, random);
  for (StaticPose& pose : poses.poses) {
    for (const Triad triad : kTriads) {
      if (!pose.triads[triad]) continue;
      const Eigen::Matrix3d& S = unit.models[triad]->sensitivity;
      pose.triads[triad]->mean_covariance_raw = 1e-8 * S * S.transpose();
      pose.triads[triad]->has_covariance = true;
    }
  }
  return poses;
}

TEST(CalibrateAccelMag, RecoversTruthExactlyWithoutNoise) {
  for (int seed = 0; seed < 20; ++seed) {
    Random random(static_cast<std::uint64_t>(seed));
    UnitSpread spread;
    spread.permute_magnetometer = true;
    spread.gain_low = 0.3;
    spread.gain_high = 4.0;
    spread.cross_axis = 0.15;
    spread.offset = 8.0;
    const SyntheticUnit unit = RandomUnit(spread, &random);
    const PoseSet poses = ExactPoses(unit, 24, &random);
    const auto summary = Calibrate(poses, JointOptions(unit));
    ASSERT_TRUE(summary) << summary.error().message;
    ASSERT_TRUE(summary->calibration.IsUsable()) << seed;
    const Eigen::VectorXd error = Errors(summary->calibration, unit);
    // Rounding of readings up to 4 * 8 * 50 uT (1e3 * 1e-16) times a condition number of ~1e3.
    EXPECT_LT(error.lpNorm<Eigen::Infinity>(), 1e-9) << "seed " << seed;
  }
}

}  // namespace
}  // namespace truetriad
