// SPDX-License-Identifier: Apache-2.0
//
// What disturbed and very few poses do to the joint estimate.

#include <cstdio>

#include <gtest/gtest.h>

#include "support/accel_mag_trials.h"
#include "support/nightly.h"

namespace truetriad {
namespace robustness_test {

using trials::JointOptions;
using trials::ModelNoise;
using trials::RandomUnit;
using trials::UnitSpread;

constexpr int kPoses = 24;

int Runs() { return IsNightly() ? 1000 : 300; }

// One pose in twenty-four carries a magnet passing by or a unit that was not yet still.
TEST(CalibrateAccelMag, DisturbedPosesHardlyMoveTheBias) {
  PerTriad<double> clean_squares{};
  PerTriad<double> disturbed_squares{};
  int named = 0;
  for (int run = 0; run < Runs(); ++run) {
    Random random(6000 + static_cast<std::uint64_t>(run));
    const SyntheticUnit unit = RandomUnit({}, &random);
    const auto attitudes = RandomAttitudes(kPoses, &random);
    PoseSet poses = SimulatePoses(unit, attitudes, ModelNoise(), &random);
    const CalibrateOptions options = JointOptions(unit);
    const auto clean = Calibrate(poses, options);
    // 5 % of the poses, in turn of either sensor.
    const auto victim = static_cast<std::size_t>(random.Below(kPoses));
    const Triad triad = run % 2 == 0 ? Triad::kAccelerometer : Triad::kMagnetometer;
    const double size = triad == Triad::kAccelerometer ? 0.3 : 5.0;
    poses.poses[victim].triads[triad]->mean_raw += size * random.Normal3();
    const auto disturbed = Calibrate(poses, options);
    ASSERT_TRUE(clean && clean->calibration.IsUsable());
    ASSERT_TRUE(disturbed && disturbed->calibration.IsUsable()) << "run " << run;
    for (const Triad sensor : {Triad::kAccelerometer, Triad::kMagnetometer}) {
      const Eigen::Vector3d truth = unit.models[sensor]->bias;
      clean_squares[sensor] +=
          (clean->calibration.sensors[sensor]->model.bias - truth).squaredNorm();
      disturbed_squares[sensor] +=
          (disturbed->calibration.sensors[sensor]->model.bias - truth).squaredNorm();
    }
    for (const RejectedPose& rejected : disturbed->calibration.quality.rests.rejected_poses) {
      if (rejected.pose == static_cast<int>(victim) + 1 && rejected.triad == triad) ++named;
    }
  }
  for (const Triad sensor : {Triad::kAccelerometer, Triad::kMagnetometer}) {
    const double ratio = std::sqrt(disturbed_squares[sensor] / clean_squares[sensor]);
    std::printf("@disturbed | %s bias error over that of the undisturbed | %d | %.3f |\n",
                TriadName(sensor).data(),
                Runs(),
                ratio);
    EXPECT_LE(ratio, 1.5);
  }
  std::printf(
      "@disturbed | pose and sensor named | %d | %.1f %% |\n", Runs(), 100.0 * named / Runs());
  EXPECT_GT(named, Runs() * 8 / 10);
}

// Three of twenty-four poses beside a magnet, rotation unknown: the wrong rotation must not win
// because the outliers like it better.
TEST(CalibrateAccelMag, ThreePosesBesideAMagnetDoNotTurnTheMagnetometerAround) {
  for (int run = 0; run < Runs(); ++run) {
    Random random(8000 + static_cast<std::uint64_t>(run));
    UnitSpread spread;
    spread.permute_magnetometer = true;
    const SyntheticUnit unit = RandomUnit(spread, &random);
    PoseSet poses = SimulatePoses(unit, RandomAttitudes(kPoses, &random), ModelNoise(), &random);
    for (const std::size_t victim : {4U, 11U, 17U}) {
      poses.poses[victim].triads[Triad::kMagnetometer]->mean_raw +=
          5.0 * random.Normal3().normalized();
    }
    const auto summary = Calibrate(poses, JointOptions(unit));
    ASSERT_TRUE(summary && summary->calibration.IsUsable()) << "run " << run;
    // A wrong rotation is off by the size of the gains; a right one, even disturbed, by a percent.
    EXPECT_LT((summary->calibration.sensors[Triad::kMagnetometer]->model.sensitivity -
               unit.models[Triad::kMagnetometer]->sensitivity)
                  .norm(),
              0.1)
        << "run " << run;
  }
}

// Very few poses: whatever the expansions for small samples do, a variance is not negative.
TEST(CalibrateAccelMag, NineToTwelvePosesGiveNoNegativeVariance) {
  for (int run = 0; run < Runs(); ++run) {
    Random random(9000 + static_cast<std::uint64_t>(run));
    const SyntheticUnit unit = RandomUnit({}, &random);
    SyntheticNoise noise = ModelNoise();
    noise.excess_sigma[Triad::kAccelerometer] = 0.01;
    const auto summary =
        Calibrate(SimulatePoses(unit, RandomAttitudes(9 + run % 4, &random), noise, &random),
                  JointOptions(unit));
    ASSERT_TRUE(summary);
    const Calibration& calibration = summary->calibration;
    if (!calibration.IsUsable()) continue;
    EXPECT_GE(calibration.covariance.matrix.diagonal().minCoeff(), 0.0) << "run " << run;
    EXPECT_GE(calibration.quality.effective_dof, 1.0) << "run " << run;
  }
}

}  // namespace robustness_test
}  // namespace truetriad
