// SPDX-License-Identifier: Apache-2.0
#include "truetriad/calibrate/calibrate.h"

#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "support/accel_mag_trials.h"
#include "support/accelerometer_tables.h"
#include "truetriad/calibrate/evaluate.h"

namespace truetriad {
namespace calibrate_test {

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

// Poses that scatter by fifty times the noise that is stated: nearly all are outliers by that, and
// the few that are left fit each other by being few.
TEST(CalibrateAccelMag, SaysThatTooManyPosesWereLeftOutInsteadOfAskingForMore) {
  Random random(31);
  const SyntheticUnit unit = trials::RandomUnit({}, &random);
  SyntheticNoise noise = trials::ModelNoise();
  noise.excess_sigma[Triad::kAccelerometer] = 0.15;
  noise.excess_sigma[Triad::kMagnetometer] = 2.5;
  const PoseSet poses = SimulatePoses(unit, RandomAttitudes(24, &random), noise, &random);
  CalibrateOptions options = trials::JointOptions(unit);
  const auto estimated = Calibrate(poses, options);
  ASSERT_TRUE(estimated) << estimated.error().message;
  EXPECT_TRUE(estimated->calibration.IsUsable());
  for (TriadOptions& triad : options.triads) triad.excess = ExcessNoise::kNone;
  const auto summary = Calibrate(poses, options);
  ASSERT_TRUE(summary) << summary.error().message;
  EXPECT_EQ(summary->calibration.outcome, Outcome::kNotConverged);
  EXPECT_TRUE(summary->calibration.quality.weak_directions.empty());
  const Finding* outliers = Find(summary->calibration.findings, FindingCode::kTooManyOutliers);
  ASSERT_NE(outliers, nullptr);
  EXPECT_TRUE(outliers->IsRefusal());
  EXPECT_EQ(outliers->Value("poses"), 24.0);
  EXPECT_THAT(outliers->remedy, ::testing::HasSubstr("excess: estimate"));
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
    ASSERT_TRUE(summary->calibration.IsUsable())
        << seed << ": " << summary->calibration.findings.front().Message();
    const Eigen::VectorXd error = Errors(summary->calibration, unit);
    // Rounding of readings up to 4 * 8 * 50 uT (1e3 * 1e-16) times a condition number of ~1e3.
    EXPECT_LT(error.lpNorm<Eigen::Infinity>(), 1e-9) << "seed " << seed;
  }
}

// `joint` poses with both sensors and sixty with one of them.
PoseSet PosesOfWhichFewHaveBoth(const SyntheticUnit& unit,
                                int joint,
                                Random* random,
                                double more_noise = 1.0) {
  SyntheticNoise noise;
  noise.rest_sigma[Triad::kAccelerometer] = 0.01 * more_noise;
  noise.rest_sigma[Triad::kMagnetometer] = 0.3 * more_noise;
  PoseSet poses = SimulatePoses(unit, RandomAttitudes(joint + 60, random), noise, random);
  for (std::size_t k = static_cast<std::size_t>(joint); k < poses.poses.size(); ++k) {
    poses.poses[k].triads[k % 2 == 0 ? Triad::kAccelerometer : Triad::kMagnetometer].reset();
  }
  return poses;
}

// The angle between gravity and field has up to six solutions in four poses with both sensors, each
// of which looks determined where it stands.
TEST(CalibrateAccelMag, RefusesWhereFewPosesWithBothSensorsHaveSeveralSolutions) {
  int told_of_four = 0;
  for (int seed = 0; seed < 20; ++seed) {
    for (const int joint : {4, 5, 8}) {
      Random random(static_cast<std::uint64_t>(seed));
      const SyntheticUnit unit = RandomUnit({}, &random);
      const auto summary =
          Calibrate(PosesOfWhichFewHaveBoth(unit, joint, &random), JointOptions(unit));
      ASSERT_TRUE(summary) << summary.error().message;
      const Calibration& calibration = summary->calibration;
      const std::string of = std::to_string(joint) + " poses, seed " + std::to_string(seed);
      if (calibration.IsUsable()) {
        // NEES of some 24 degrees of freedom; another solution is off by a hundred σ.
        const Eigen::VectorXd error = Errors(calibration, unit);
        int dimension = 0;
        EXPECT_LT(trials::Nees(error, calibration.covariance.matrix, &dimension), 100.0) << of;
        continue;
      }
      EXPECT_LT(joint, 8) << of;
      const Finding* rival = Find(calibration.findings, FindingCode::kAlignmentUndetermined);
      if (rival == nullptr) continue;
      EXPECT_EQ(rival->Value("poses"), joint) << of;
      told_of_four += joint == 4 ? 1 : 0;
    }
  }
  EXPECT_GE(told_of_four, 15);
}

// With a dip within its σ of zero, a magnetometer cannot be told from its negative, nor a rival
// solution of one handedness from one of the other.
TEST(CalibrateAccelMag, TakesTheMagnetometerToBeRightHandedNearTheEquator) {
  int usable = 0, told = 0;
  for (int seed = 0; seed < 60; ++seed) {
    for (const int joint : {5, 8, 12}) {
      Random random(static_cast<std::uint64_t>(seed));
      SyntheticUnit unit = RandomUnit({}, &random);
      unit.dip_rad = random.Uniform(0.2, 3.0) * kRadPerDeg;
      const auto summary =
          Calibrate(PosesOfWhichFewHaveBoth(unit, joint, &random, 5.0), JointOptions(unit));
      ASSERT_TRUE(summary) << summary.error().message;
      const Calibration& calibration = summary->calibration;
      if (!calibration.IsUsable()) continue;
      ++usable;
      told += Find(calibration.findings, FindingCode::kHandAssumed) != nullptr ? 1 : 0;
      const Eigen::Matrix3d& S = calibration.sensors[Triad::kMagnetometer]->model.sensitivity;
      const Eigen::Matrix3d& truth = unit.models[Triad::kMagnetometer]->sensitivity;
      // A rival solution is turned by ten degrees or more.
      EXPECT_LT((S - truth).norm(), 0.17 * truth.norm()) << joint << " poses, seed " << seed;
    }
  }
  EXPECT_GE(usable, 120);
  EXPECT_GE(told, usable / 2);
}

// Nor can it with a dip that is known, with a σ or without: if the dip shows the side of the
// equator, the likelier side is taken, else the one with the stated handedness.
TEST(CalibrateAccelMag, WeighsBothSidesOfTheEquatorAgainstAKnownDip) {
  int usable = 0, told = 0;
  for (int seed = 0; seed < 20; ++seed) {
    for (const double sigma_deg : {0.0, 0.2, 2.0}) {
      for (const double hand : {1.0, -1.0}) {
        Random random(static_cast<std::uint64_t>(seed));
        SyntheticUnit unit = RandomUnit({}, &random);
        unit.dip_rad = random.Uniform(-8.0, 8.0) * kRadPerDeg;
        Eigen::Matrix3d& truth = unit.models[Triad::kMagnetometer]->sensitivity;
        truth.row(2) *= hand;
        CalibrateOptions options = JointOptions(unit);
        options.reference.dip_rad = {unit.dip_rad + sigma_deg * kRadPerDeg * random.Normal(),
                                     sigma_deg * kRadPerDeg};
        if (hand < 0.0) {
          options.triads[Triad::kMagnetometer].mounting =
              Eigen::Vector3d(1.0, 1.0, -1.0).asDiagonal().toDenseMatrix();
        }
        const auto summary = Calibrate(PosesOfWhichFewHaveBoth(unit, 12, &random, 10.0), options);
        ASSERT_TRUE(summary) << summary.error().message;
        const Calibration& calibration = summary->calibration;
        if (!calibration.IsUsable()) continue;
        ++usable;
        told += Find(calibration.findings, FindingCode::kHandAssumed) != nullptr ? 1 : 0;
        const Eigen::Matrix3d& S = calibration.sensors[Triad::kMagnetometer]->model.sensitivity;
        EXPECT_LT((S - truth).norm(), 0.17 * truth.norm())
            << "dip " << unit.dip_rad / kRadPerDeg << ", σ " << sigma_deg << ", hand " << hand
            << ", seed " << seed;
      }
    }
  }
  EXPECT_GE(usable, 110);
  // A σ of 2 deg leaves some of the sides open, and nothing is stated of right-handed ones.
  EXPECT_GE(told, 5);
}

// Held to a wrong dip, readings scatter as if something had changed; the cause is named.
TEST(CalibrateAccelMag, RefusesADipThatTheReadingsContradict) {
  for (int seed = 0; seed < 20; ++seed) {
    for (const double sigma_deg : {0.0, 0.1}) {
      for (const double off_deg : {0.0, 0.6, 2.0, -10.0}) {
        Random random(static_cast<std::uint64_t>(seed));
        const SyntheticUnit unit = RandomUnit({}, &random);
        CalibrateOptions options = JointOptions(unit);
        options.reference.dip_rad = {unit.dip_rad + off_deg * kRadPerDeg, sigma_deg * kRadPerDeg};
        const PoseSet poses =
            SimulatePoses(unit, RandomAttitudes(24, &random), trials::ModelNoise(), &random);
        const auto summary = Calibrate(poses, options);
        ASSERT_TRUE(summary) << summary.error().message;
        const Calibration& calibration = summary->calibration;
        const std::string of = std::to_string(seed) + ", off by " + std::to_string(off_deg);
        // Readings that outweigh a σ keep the result where it belongs.
        if (off_deg == 0.0 || sigma_deg == 0.0) {
          EXPECT_EQ(calibration.IsUsable(), off_deg == 0.0) << of;
        }
        if (off_deg == 0.0) continue;
        const Finding* found = Find(calibration.findings, FindingCode::kStatedOtherwise);
        ASSERT_NE(found, nullptr) << of;
        if (calibration.IsUsable()) continue;
        EXPECT_NEAR(*found->Value("dip"), unit.dip_rad / kRadPerDeg, 0.5) << of;
      }
    }
  }
}

// σ follow the noise that is stated if no excess is to be estimated.
TEST(CalibrateAccelMag, SaysThatTheNoiseIsStatedTooSmall) {
  int said = 0, said_of_true = 0;
  for (int seed = 0; seed < 30; ++seed) {
    for (const double times : {1.0, 2.0}) {
      Random random(static_cast<std::uint64_t>(seed));
      const SyntheticUnit unit = RandomUnit({}, &random);
      CalibrateOptions options = JointOptions(unit);
      for (TriadOptions& triad : options.triads) triad.excess = ExcessNoise::kNone;
      PoseSet poses =
          SimulatePoses(unit, RandomAttitudes(24, &random), trials::ModelNoise(), &random);
      for (StaticPose& pose : poses.poses) {
        for (auto& reading : pose.triads) {
          if (reading) reading->mean_covariance_raw /= times * times;
        }
      }
      const auto summary = Calibrate(poses, options);
      ASSERT_TRUE(summary) << summary.error().message;
      const bool is_said =
          Find(summary->calibration.findings, FindingCode::kNoiseUnderstated) != nullptr;
      (times > 1.0 ? said : said_of_true) += is_said ? 1 : 0;
    }
  }
  // If the poses furthest off are left out, the others scatter by less than twice the noise.
  EXPECT_GE(said, 20);
  EXPECT_EQ(said_of_true, 0);
}

// One reading of a length that gravity and the field do not have, in a table of good ones.
TEST(CalibrateAccelMag, LeavesOutAReadingOfImpossibleLength) {
  int usable = 0;
  for (int seed = 0; seed < 30; ++seed) {
    for (const Triad triad : {Triad::kAccelerometer, Triad::kMagnetometer}) {
      Random random(static_cast<std::uint64_t>(seed));
      const SyntheticUnit unit = RandomUnit({}, &random);
      PoseSet poses =
          SimulatePoses(unit, RandomAttitudes(40, &random), trials::ModelNoise(), &random);
      poses.poses[7].triads[triad]->mean_raw *= 2.0 + random.Uniform(0.0, 8.0);
      const auto summary = Calibrate(poses, JointOptions(unit));
      ASSERT_TRUE(summary) << summary.error().message;
      const Calibration& calibration = summary->calibration;
      if (!calibration.IsUsable()) continue;
      ++usable;
      EXPECT_NE(Find(calibration.findings, FindingCode::kRejectedPoses), nullptr) << seed;
      int dimension = 0;
      const Eigen::VectorXd error = Errors(calibration, unit);
      EXPECT_LT(trials::Nees(error, calibration.covariance.matrix, &dimension), 100.0) << seed;
    }
  }
  EXPECT_GE(usable, 56);
}

// A rival solution of either handedness counts.
TEST(CalibrateAccelMag, TakesNoRightHandedRivalForALeftHandedMagnetometer) {
  for (int seed = 0; seed < 100; ++seed) {
    Random random(static_cast<std::uint64_t>(seed));
    SyntheticUnit unit = RandomUnit({}, &random);
    Eigen::Matrix3d& truth = unit.models[Triad::kMagnetometer]->sensitivity;
    truth.row(seed % 3) *= -1.0;
    for (const int joint : {4, 5}) {
      const auto summary =
          Calibrate(PosesOfWhichFewHaveBoth(unit, joint, &random, 3.0), JointOptions(unit));
      ASSERT_TRUE(summary) << summary.error().message;
      const Calibration& calibration = summary->calibration;
      if (!calibration.IsUsable()) continue;
      const Eigen::Matrix3d& S = calibration.sensors[Triad::kMagnetometer]->model.sensitivity;
      EXPECT_LT((S - truth).norm(), 0.17 * truth.norm()) << joint << " poses, seed " << seed;
    }
  }
}

// Rests of 4 s at 100 Hz.
PoseSet TimedPoses(const SyntheticUnit& unit, int count, Random* random) {
  PoseSet poses = SimulatePoses(unit, RandomAttitudes(count, random), SyntheticNoise{}, random);
  for (StaticPose& pose : poses.poses) {
    pose.end_ns = 3'990'000'000;
    for (Boxed<TriadPose>& seen : pose.triads) {
      if (seen) seen->samples = 400;
    }
  }
  return poses;
}

TEST(AllanNoise, WhitePartAveragesOutAndTheFloorDoesNot) {
  const AllanNoise noise{{0.1, 0.2, 0.3}, {0.0, 0.0, 1.0}};
  EXPECT_NEAR(noise.MeanSigma(4.0).x(), 0.05, 1e-15);
  EXPECT_NEAR(noise.MeanSigma(4.0).y(), 0.1, 1e-15);
  // 0.664 of IEEE Std 952 is sqrt(2 ln 2 / pi).
  EXPECT_NEAR(noise.MeanSigma(1e12).z(), 0.6643, 1e-4);
}

TEST(CalibrateWithAllan, WeighsEachMeanByTheTimeItWasAveraged) {
  Random random(1);
  const SyntheticUnit unit = RandomUnit({}, &random);
  CalibrateOptions options = JointOptions(unit);
  const AllanNoise noise{Eigen::Vector3d(0.01, 0.02, 0.03), Eigen::Vector3d(0.001, 0.002, 0.003)};
  options.triads[Triad::kAccelerometer].allan = noise;
  options.triads[Triad::kMagnetometer].allan = noise;
  const auto summary = Calibrate(TimedPoses(unit, 24, &random), options);
  ASSERT_TRUE(summary) << summary.error().message;
  const auto& sensor = summary->calibration.sensors[Triad::kAccelerometer];
  ASSERT_TRUE(sensor);
  EXPECT_EQ(sensor->noise.source, NoiseSource::kAllan);
  // 400 samples stand for 400 spacings, not for the 399 between the first and the last.
  EXPECT_LT((sensor->noise.sigma - noise.MeanSigma(4.0)).norm(), 1e-12);
}

TEST(CalibrateWithAllan, RefusesPosesOfUnknownDuration) {
  Random random(1);
  const SyntheticUnit unit = RandomUnit({}, &random);
  CalibrateOptions options = JointOptions(unit);
  options.triads[Triad::kMagnetometer].allan =
      AllanNoise{Eigen::Vector3d::Constant(0.1), Eigen::Vector3d::Zero()};
  PoseSet poses = TimedPoses(unit, 24, &random);
  poses.poses[4].end_ns = poses.poses[4].start_ns;
  const auto summary = Calibrate(poses, options);
  ASSERT_FALSE(summary);
  EXPECT_EQ(summary.error().kind(), ErrorKind::kBadInput);
  EXPECT_NE(summary.error().message.find("pose 5, magnetometer: its averaging time"),
            std::string::npos)
      << summary.error().message;
}

// datasets/six-rows, with the published centre and radii.
TEST(CalibrateAccel, StatesTheAxisAlignedEllipsoidOfSixRowsWhenAskedForTheStartOnly) {
  const std::vector<Eigen::Vector3d> rows = {{9.9604, -0.0975, 0.0549},
                                             {-9.6576, 0.0974, -0.0145},
                                             {0.0889, 9.7972, -0.0812},
                                             {0.0340, -9.8285, 0.0264},
                                             {0.0909, -0.0595, 9.9975},
                                             {0.1680, 0.0215, -9.7350}};
  CalibrateOptions options = AccelerometerOptions(9.8);
  options.triads[Triad::kAccelerometer].model = MatrixModel::kDiagonal;
  options.initialise = {InitialiseMethod::kEllipsoidAxisAligned, true, {}};
  const auto summary = Calibrate(AccelerometerPoses(rows, 0.0), options);
  ASSERT_TRUE(summary && summary->calibration.IsUsable());
  const TriadModel<double>& model = summary->calibration.sensors[Triad::kAccelerometer]->model;
  // Seven decimals are published.
  EXPECT_LT((model.bias - Eigen::Vector3d(0.1508625, -0.0150391, 0.1313511)).norm(), 1e-7);
  const Eigen::Vector3d radii = 9.8 * model.sensitivity.diagonal();
  EXPECT_LT((radii - Eigen::Vector3d(9.8101783, 9.8147126, 9.8664345)).norm(), 1e-7);
  for (const Eigen::Vector3d& row : rows) {
    EXPECT_NEAR(model.TruthFromRaw(row).norm(), 9.8, 1e-9);
  }
}

// One solution, four frames: norms of corrected readings and angles between corrected triads do not
// depend on the frame, and the σ of an invariant comes out the same from every covariance.
TEST(CalibrateAccelMag, GaugesAreExactRotationsOfOneSolution) {
  Random random(3);
  const SyntheticUnit unit = RandomUnit({}, &random);
  const PoseSet poses =
      SimulatePoses(unit, RandomAttitudes(24, &random), trials::ModelNoise(), &random);
  std::vector<Eigen::VectorXd> invariants;
  std::vector<double> variances;
  for (const Gauge gauge : {Gauge::kAccelX, Gauge::kAccelZ, Gauge::kSymmetric}) {
    CalibrateOptions options = JointOptions(unit);
    options.gauge = gauge;
    const auto summary = Calibrate(poses, options);
    ASSERT_TRUE(summary && summary->calibration.IsUsable());
    const Calibration& calibration = summary->calibration;
    const Eigen::Matrix3d& Sa = calibration.sensors[Triad::kAccelerometer]->model.sensitivity;
    const Eigen::Matrix3d& Sm = calibration.sensors[Triad::kMagnetometer]->model.sensitivity;
    // S_a S_a^T and S_a S_m^T do not depend on the frame.
    Eigen::VectorXd invariant(18);
    invariant << (Sa * Sa.transpose()).reshaped(), (Sa * Sm.transpose()).reshaped();
    invariants.push_back(invariant);
    // Variance of entry (x, z) of S_a S_m^T = row x of S_a times row z of S_m.
    Eigen::VectorXd gradient = Eigen::VectorXd::Zero(calibration.covariance.matrix.rows());
    for (int col = 0; col < 3; ++col) {
      gradient[3 + col] = Sm(2, col);
      gradient[12 + 3 + 6 + col] = Sa(0, col);
    }
    variances.push_back(gradient.dot(calibration.covariance.matrix * gradient));
  }
  for (std::size_t i = 1; i < invariants.size(); ++i) {
    EXPECT_LT((invariants[i] - invariants[0]).norm(), 1e-12);
    // The covariance went through two derivatives of condition ~10 at 1e-16.
    EXPECT_NEAR(variances[i] / variances[0], 1.0, 1e-9);
  }
}

TEST(CalibrateAccel, KeepsTheSignOfAChipThatReportsGravity) {
  Random random(4);
  SyntheticUnit unit = RandomUnit({}, &random);
  unit.models[Triad::kMagnetometer].reset();
  unit.models[Triad::kAccelerometer]->sensitivity *= -1.0;
  const PoseSet poses = ExactPoses(unit, 15, &random);
  CalibrateOptions options = AccelerometerOptions(unit.gravity_mps2);
  options.triads[Triad::kAccelerometer].sign = AccelerometerSign::kGravity;
  const auto summary = Calibrate(poses, options);
  ASSERT_TRUE(summary && summary->calibration.IsUsable());
  EXPECT_LT(Errors(summary->calibration, unit).lpNorm<Eigen::Infinity>(), 1e-9);
}

TEST(CalibrateAccel, SaysWhichDirectionIsWeakWhenPosesAreCoplanar) {
  Random random(15);
  std::vector<Eigen::Vector3d> readings;
  for (int k = 0; k < 16; ++k) {
    readings.emplace_back(
        9.8 * std::cos(0.4 * k), 9.8 * std::sin(0.4 * k), 0.02 + 1e-3 * random.Normal());
  }
  const auto summary = Calibrate(AccelerometerPoses(readings, 1e-3), AccelerometerOptions(9.8));
  ASSERT_TRUE(summary);
  const Calibration& calibration = summary->calibration;
  EXPECT_EQ(calibration.outcome, Outcome::kNotObservable);
  EXPECT_FALSE(calibration.sensors[Triad::kAccelerometer]);
  ASSERT_FALSE(calibration.quality.weak_directions.empty());
  EXPECT_NE(Find(calibration.findings, FindingCode::kTooFewDirections), nullptr);
  EXPECT_THAT(calibration.quality.weak_directions[0].description,
              ::testing::HasSubstr("bias z and scale z"));
  EXPECT_EQ(calibration.quality.weak_directions[0].advice, "add poses with body z up and down");
}

TEST(CalibrateAccel, SaysWhichAxisIsDeadAndWhichTwoAreOne) {
  Random random(16);
  std::vector<Eigen::Vector3d> dead, twice;
  for (int k = 0; k < 16; ++k) {
    const Eigen::Vector3d reading = 9.8 * random.Normal3().normalized();
    dead.emplace_back(reading.x(), 0.02, reading.z());
    twice.emplace_back(reading.x(), reading.y(), reading.y());
  }
  const auto refusal_of = [](const std::vector<Eigen::Vector3d>& readings) {
    const auto summary = Calibrate(AccelerometerPoses(readings, 1e-3), AccelerometerOptions(9.8));
    return summary ? summary->calibration.findings.front() : Finding(FindingCode::kMessage, "");
  };
  const Finding of_dead = refusal_of(dead), of_twice = refusal_of(twice);
  EXPECT_TRUE(of_dead.IsRefusal() && of_twice.IsRefusal());
  EXPECT_EQ(of_dead.code, FindingCode::kConstantAxis);
  EXPECT_THAT(of_dead.text, ::testing::HasSubstr("accelerometer: its y axis"));
  EXPECT_EQ(of_twice.code, FindingCode::kRepeatedAxis);
  EXPECT_THAT(of_twice.text, ::testing::HasSubstr("axes y and z"));
}

// A matrix that is not of the requested shape is reported, and nothing else is blamed for it.
TEST(CalibrateAccel, WhatAModelHoldsIsLookedForFirst) {
  Random random(18);
  const SyntheticUnit unit = RandomUnit({}, &random);
  const PoseSet poses =
      SimulatePoses(unit, RandomAttitudes(24, &random), trials::ModelNoise(), &random);
  for (const Triad triad : {Triad::kAccelerometer, Triad::kMagnetometer}) {
    CalibrateOptions options = JointOptions(unit);
    options.triads[triad].model = MatrixModel::kDiagonal;
    const auto summary = Calibrate(poses, options);
    ASSERT_TRUE(summary);
    const Findings& findings = summary->calibration.findings;
    const Finding* said = Find(findings, FindingCode::kFault);
    ASSERT_NE(said, nullptr) << TriadName(triad);
    EXPECT_EQ(said->sensor, triad);
    EXPECT_THAT(said->remedy, ::testing::HasSubstr("model: full"));
  }
}

TEST(CalibrateAccel, InventsNothingFromFewerPosesThanParameters) {
  Random random(6);
  SyntheticUnit unit = RandomUnit({}, &random);
  unit.models[Triad::kMagnetometer].reset();
  const auto summary =
      Calibrate(ExactPoses(unit, 8, &random), AccelerometerOptions(unit.gravity_mps2));
  ASSERT_TRUE(summary);
  EXPECT_EQ(summary->calibration.outcome, Outcome::kNotEnough);
  EXPECT_FALSE(summary->calibration.sensors[Triad::kAccelerometer]);
}

TEST(CalibrateAccel, TakesReadingsOffByAThousandForAUnitMistake) {
  Random random(7);
  SyntheticUnit unit = RandomUnit({}, &random);
  unit.models[Triad::kMagnetometer].reset();
  PoseSet poses = ExactPoses(unit, 15, &random);
  for (StaticPose& pose : poses.poses) pose.triads[Triad::kAccelerometer]->mean_raw *= 1000.0;
  const auto summary = Calibrate(poses, AccelerometerOptions(unit.gravity_mps2));
  ASSERT_TRUE(summary) << summary.error().message;
  EXPECT_EQ(summary->calibration.outcome, Outcome::kNotConverged);
  EXPECT_NE(Find(summary->calibration.findings, FindingCode::kWrongUnit), nullptr);
}

// A symmetric or diagonal magnetometer has its rotation beside the matrix: the start must not put
// one into it.
TEST(CalibrateAccelMag, EstimatesSmallerMagnetometerModelsThroughPermutedAxes) {
  Random random(8);
  for (const MatrixModel model : {MatrixModel::kDiagonal, MatrixModel::kSymmetric}) {
    UnitSpread spread;
    spread.cross_axis = 0.0;
    SyntheticUnit unit = RandomUnit(spread, &random);
    Eigen::Matrix3d& S = unit.models[Triad::kMagnetometer]->sensitivity;
    if (model == MatrixModel::kSymmetric) {
      S(0, 1) = S(1, 0) = 0.03;
      S(1, 2) = S(2, 1) = -0.02;
    }
    S *= trials::RandomAxisMap(&random);
    const PoseSet poses = ExactPoses(unit, 24, &random);
    CalibrateOptions options = JointOptions(unit);
    options.triads[Triad::kMagnetometer].model = model;
    const auto summary = Calibrate(poses, options);
    ASSERT_TRUE(summary && summary->calibration.IsUsable());
    EXPECT_LT(Errors(summary->calibration, unit).lpNorm<Eigen::Infinity>(), 1e-9);
  }
}

TEST(CalibrateAccelMag, GivesASymmetricMagnetometerNoRotationThatNoiseMade) {
  Random random(10);
  SyntheticUnit unit = RandomUnit({}, &random);
  Eigen::Matrix3d& truth = unit.models[Triad::kMagnetometer]->sensitivity;
  truth = 0.5 * (truth + truth.transpose()).eval();
  const PoseSet poses =
      SimulatePoses(unit, RandomAttitudes(24, &random), trials::ModelNoise(), &random);
  CalibrateOptions options = JointOptions(unit);
  options.triads[Triad::kMagnetometer].model = MatrixModel::kSymmetric;
  const auto summary = Calibrate(poses, options);
  ASSERT_TRUE(summary && summary->calibration.IsUsable());
  const Eigen::Matrix3d S = summary->calibration.sensors[Triad::kMagnetometer]->model.sensitivity;
  EXPECT_LT((S - S.transpose()).norm(), 1e-14);
}

TEST(Compare, FindsTwoCalibrationsOfOneUnitEqualWhateverTheirGauge) {
  Random random(9);
  const SyntheticUnit unit = RandomUnit({}, &random);
  CalibrateOptions options = JointOptions(unit);
  std::vector<Calibration> calibrations;
  for (const Gauge gauge : {Gauge::kAccelZ, Gauge::kSymmetric}) {
    options.gauge = gauge;
    const auto summary = Calibrate(
        SimulatePoses(unit, RandomAttitudes(24, &random), trials::ModelNoise(), &random), options);
    ASSERT_TRUE(summary && summary->calibration.IsUsable());
    calibrations.push_back(summary->calibration);
  }
  const auto comparison = Compare(calibrations[0], calibrations[1]);
  ASSERT_TRUE(comparison) << comparison.error().message;
  // 24 entries less 3 of the gauge; the dip belongs to the place.
  EXPECT_EQ(comparison->dof, 21);
  EXPECT_GT(comparison->p_value, 1e-3);  // one seeded draw
  const auto itself = Compare(calibrations[0], calibrations[0]);
  ASSERT_TRUE(itself);
  EXPECT_LT(itself->chi2, 1e-12);
}

// Gravity that is known with a σ may differ between places by as much, and all gains with it.
TEST(Compare, FindsAUnitUnchangedWhereGravityIsAnother) {
  Random random(19);
  SyntheticUnit unit = RandomUnit({}, &random);
  CalibrateOptions options = JointOptions(unit);
  options.reference.gravity_mps2 = {kStandardGravityMps2, 0.02};
  std::vector<Calibration> calibrations;
  for (const double gravity_mps2 : {9.79, 9.82}) {
    unit.gravity_mps2 = gravity_mps2;
    const auto summary = Calibrate(
        SimulatePoses(unit, RandomAttitudes(24, &random), trials::ModelNoise(), &random), options);
    ASSERT_TRUE(summary && summary->calibration.IsUsable());
    calibrations.push_back(summary->calibration);
  }
  const auto comparison = Compare(calibrations[0], calibrations[1]);
  ASSERT_TRUE(comparison) << comparison.error().message;
  EXPECT_GT(comparison->p_value, 0.01);
}

// The accelerometer sets the frame of one calibration and the magnetometer that of the other: both
// state bias and C^T C of the magnetometer, nine numbers.
TEST(Compare, HoldsWhatNoFrameChangesAgainstEachOtherWhereDifferentSensorsLead) {
  constexpr int kRuns = 200;
  double chi2 = 0.0;
  for (int run = 0; run < kRuns; ++run) {
    Random random(static_cast<std::uint64_t>(500 + run));
    const SyntheticUnit unit = RandomUnit({}, &random);
    const auto calibrate = [&](const CalibrateOptions& options) {
      const auto summary = Calibrate(
          SimulatePoses(unit, RandomAttitudes(24, &random), trials::ModelNoise(), &random),
          options);
      EXPECT_TRUE(summary && summary->calibration.IsUsable());
      return summary->calibration;
    };
    CalibrateOptions options = JointOptions(unit);
    for (TriadOptions& triad : options.triads) triad.excess = ExcessNoise::kNone;
    options.robust.enabled = false;
    const Calibration joint = calibrate(options);
    options.triads[Triad::kAccelerometer].enabled = false;
    const auto comparison = Compare(joint, calibrate(options));
    ASSERT_TRUE(comparison) << comparison.error().message;
    EXPECT_TRUE(comparison->frames_differ);
    ASSERT_EQ(comparison->dof, 9);
    chi2 += comparison->chi2 / 9.0 / kRuns;
  }
  // χ² of nine degrees of freedom, four σ of the mean.
  EXPECT_NEAR(chi2, 1.0, 4.0 * std::sqrt(2.0 / (9.0 * kRuns)));
}

// If the field strength is a convention, gains are for another field, and nothing else differs.
TEST(Compare, TakesOutAFieldStrengthThatIsAConvention) {
  Random random(11);
  const SyntheticUnit unit = RandomUnit({}, &random);
  const PoseSet poses =
      SimulatePoses(unit, RandomAttitudes(24, &random), trials::ModelNoise(), &random);
  CalibrateOptions options = JointOptions(unit);
  const auto known = Calibrate(poses, options);
  options.reference.field_ut = {};
  const auto convention = Calibrate(poses, options);
  ASSERT_TRUE(known && convention);
  const auto comparison = Compare(convention->calibration, known->calibration);
  ASSERT_TRUE(comparison) << comparison.error().message;
  EXPECT_TRUE(comparison->field_scale_taken_out);
  EXPECT_LT(comparison->largest_in_sigmas, 1e-6);
  EXPECT_TRUE(comparison->not_compared.empty());
}

TEST(Compare, NamesWhatBothHoldAndHoldOtherwise) {
  Random random(11);
  const SyntheticUnit unit = RandomUnit({}, &random);
  const PoseSet poses =
      SimulatePoses(unit, RandomAttitudes(24, &random), trials::ModelNoise(), &random);
  CalibrateOptions options = JointOptions(unit);
  options.triads[Triad::kAccelerometer].model = MatrixModel::kDiagonal;
  const auto diagonal = Calibrate(poses, options);
  ASSERT_TRUE(diagonal);
  Calibration other = diagonal->calibration;
  EXPECT_TRUE(Compare(diagonal->calibration, other)->not_compared.empty());
  other.sensors[Triad::kAccelerometer]->model.sensitivity(1, 0) += 0.01;
  EXPECT_THAT(Compare(diagonal->calibration, other)->not_compared,
              ::testing::Contains(
                  "accelerometer.sensitivity.yx (held fixed in both, at different values)"));
}

// Even if one calibration is a hundred times less certain, one and the same scale is taken out of
// both: it is one of 21 degrees of freedom.
TEST(Compare, TakesOneScaleOutOfACoarseAndAFineCalibration) {
  int differ = 0;
  for (int seed = 0; seed < 20; ++seed) {
    Random random(static_cast<std::uint64_t>(900 + seed));
    const SyntheticUnit unit = RandomUnit({}, &random);
    CalibrateOptions options = JointOptions(unit);
    options.reference.field_ut = {};
    const auto calibrate = [&](double sigma_ut) {
      SyntheticNoise noise = trials::ModelNoise();
      noise.rest_sigma[Triad::kMagnetometer] = sigma_ut;
      const auto summary =
          Calibrate(SimulatePoses(unit, RandomAttitudes(24, &random), noise, &random), options);
      EXPECT_TRUE(summary && summary->calibration.IsUsable());
      return summary->calibration;
    };
    const auto comparison = Compare(calibrate(0.5), calibrate(0.005));
    ASSERT_TRUE(comparison) << comparison.error().message;
    EXPECT_EQ(comparison->dof, 20);
    if (AgreementOf(*comparison) == Agreement::kDiffer) ++differ;
  }
  EXPECT_LE(differ, 2);  // 0.2 are expected by chance
}

// Two places with fields of their own, neither known: what all gains have in common is no
// difference, but what one axis alone has is.
TEST(Compare, LeavesTheCommonScaleOfUnknownFieldsOpen) {
  const auto calibrated = [](double field_ratio, double changed_gain, std::uint64_t seed) {
    Random random(11);
    SyntheticUnit unit = RandomUnit({}, &random);
    unit.models[Triad::kMagnetometer]->sensitivity.row(0) *= changed_gain;
    unit.field_ut *= field_ratio;
    Random noise(seed);
    const PoseSet poses =
        SimulatePoses(unit, RandomAttitudes(24, &noise), trials::ModelNoise(), &noise);
    CalibrateOptions options = JointOptions(unit);
    options.reference.field_ut = {};
    auto summary = Calibrate(poses, options);
    EXPECT_TRUE(summary && summary->calibration.IsUsable());
    return summary->calibration;
  };
  const Calibration here = calibrated(1.0, 1.0, 1);
  const auto same = Compare(here, calibrated(0.9, 1.0, 2));
  ASSERT_TRUE(same) << same.error().message;
  EXPECT_EQ(AgreementOf(*same), Agreement::kAgree) << same->p_value;
  EXPECT_TRUE(same->field_scale_taken_out);
  EXPECT_FALSE(IsTooAlike(*same));
  const auto other = Compare(here, calibrated(0.9, 1.02, 3));
  ASSERT_TRUE(other) << other.error().message;
  EXPECT_EQ(AgreementOf(*other), Agreement::kDiffer) << other->p_value;
}

}  // namespace calibrate_test
}  // namespace truetriad
