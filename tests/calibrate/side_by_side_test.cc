// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "support/accel_mag_trials.h"
#include "truetriad/calibrate/calibrate.h"
#include "truetriad/calibrate/evaluate.h"

namespace truetriad {
namespace side_by_side_test {

using ::testing::HasSubstr;
using trials::JointOptions;
using trials::RandomUnit;

// A calibrated unit and poses of it that the calibration has not seen.
struct Trial {
  Calibration calibration;
  PoseSet fresh;
};

Trial MakeTrial(std::uint64_t seed, int poses = 24) {
  Random random(seed);
  const SyntheticUnit unit = RandomUnit({}, &random);
  const auto summary =
      Calibrate(SimulatePoses(unit, RandomAttitudes(24, &random), trials::ModelNoise(), &random),
                JointOptions(unit));
  EXPECT_TRUE(summary && summary->calibration.IsUsable());
  return {summary->calibration,
          SimulatePoses(unit, RandomAttitudes(poses, &random), trials::ModelNoise(), &random)};
}

const ErrorOfTwo& Find(const SideBySide& both, std::string_view name) {
  const auto found = std::find_if(both.errors.begin(),
                                  both.errors.end(),
                                  [name](const ErrorOfTwo& error) { return error.name == name; });
  EXPECT_NE(found, both.errors.end()) << name;
  return *found;
}

// What an import leaves of a calibration: no σ, no strength of the field, standard gravity.
Calibration Imported(Calibration calibration) {
  calibration.covariance.matrix.setZero();
  calibration.reference = {};
  calibration.findings = {{FindingCode::kImported, "imported"}};
  return calibration;
}

// A bias that is off by d moves the length in a pose by the part of d along the field: RMS d / √3.
TEST(SideBySide, SaysByHowMuchAWrongBiasIsWorse) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    SCOPED_TRACE(seed);
    const Trial trial = MakeTrial(seed, 200);
    Calibration wrong = trial.calibration;
    constexpr double kOffMps2 = 0.2, kOffUt = 4.0;
    wrong.sensors[Triad::kAccelerometer]->model.bias.z() += kOffMps2;
    wrong.sensors[Triad::kMagnetometer]->model.bias.x() -= kOffUt;
    const auto both = EvaluateSideBySide(trial.calibration, Imported(wrong), trial.fresh);
    ASSERT_TRUE(both) << both.error().message;
    EXPECT_EQ(BetterOf(*both), Better::kA);
    // 200 poses tell such an RMS to 5 %; gains are within 5 % of one.
    const ErrorOfTwo& force = Find(*both, "accelerometer");
    EXPECT_NEAR(std::sqrt(force.b * force.b - force.a * force.a) / (1e3 * kOffMps2 / std::sqrt(3)),
                1.0,
                0.25);
    EXPECT_EQ(force.better, Better::kA);
    const ErrorOfTwo& field = Find(*both, "magnetometer-spread");
    EXPECT_NEAR(
        std::sqrt(field.b * field.b - field.a * field.a) / (kOffUt / std::sqrt(3)), 1.0, 0.25);
    EXPECT_EQ(Find(*both, "angle").better, Better::kA);

    const auto turned = EvaluateSideBySide(Imported(wrong), trial.calibration, trial.fresh);
    ASSERT_TRUE(turned) << turned.error().message;
    EXPECT_EQ(BetterOf(*turned), Better::kB);
    EXPECT_EQ(Find(*turned, "accelerometer").a, force.b);
  }
}

TEST(SideBySide, FindsNoDifferenceWhereThereIsNone) {
  int different = 0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    const Trial trial = MakeTrial(seed);
    EXPECT_EQ(BetterOf(*EvaluateSideBySide(trial.calibration, trial.calibration, trial.fresh)),
              Better::kNeither);
    // As far apart as the readings' noise lets both be.
    Calibration other = trial.calibration;
    for (const Triad triad : {Triad::kAccelerometer, Triad::kMagnetometer}) {
      TriadCalibration& sensor = *other.sensors[triad];
      sensor.model.bias += 0.5 * sensor.bias_sigma;
    }
    const auto both = EvaluateSideBySide(trial.calibration, other, trial.fresh);
    ASSERT_TRUE(both) << both.error().message;
    different += BetterOf(*both) == Better::kNeither ? 0 : 1;
  }
  EXPECT_LE(different, 4);
}

// An imported calibration assumes standard gravity: that of the other one counts for both.
TEST(SideBySide, HoldsBothAgainstTheGravityThatOneWasCalibratedWith) {
  Trial trial = MakeTrial(3);
  trial.calibration.reference.gravity_mps2 = 9.81;
  for (const bool is_first : {true, false}) {
    const Calibration imported = Imported(trial.calibration);
    const auto both = is_first ? EvaluateSideBySide(imported, trial.calibration, trial.fresh)
                               : EvaluateSideBySide(trial.calibration, imported, trial.fresh);
    ASSERT_TRUE(both) << both.error().message;
    EXPECT_EQ(both->gravity_mps2, 9.81);
    EXPECT_EQ(both->field_ut, trial.calibration.reference.field_ut);
    EXPECT_EQ(BetterOf(*both), Better::kNeither);
  }
}

// Nobody knows how strong the field is where the recording was taken.
TEST(SideBySide, LetsNoCalibrationWinByTheStrengthOfTheField) {
  const Trial trial = MakeTrial(4);
  Calibration scaled = trial.calibration;
  scaled.sensors[Triad::kMagnetometer]->model.sensitivity *= 1.05;
  const auto both = EvaluateSideBySide(trial.calibration, scaled, trial.fresh);
  ASSERT_TRUE(both) << both.error().message;
  EXPECT_GT(Find(*both, "magnetometer").b, 3.0 * Find(*both, "magnetometer").a);
  EXPECT_EQ(BetterOf(*both), Better::kNeither);
}

TEST(SideBySide, ComparesWithoutAStrengthOfTheFieldAboutTheMean) {
  const Trial trial = MakeTrial(5);
  const Calibration imported = Imported(trial.calibration);
  const auto both = EvaluateSideBySide(imported, imported, trial.fresh);
  ASSERT_TRUE(both) << both.error().message;
  EXPECT_TRUE(both->a.about_mean[Triad::kMagnetometer]);
  // Of 48 µT by a noise of some tenths.
  EXPECT_LT(Find(*both, "magnetometer-spread").a, 2.0);
  EXPECT_EQ(std::count_if(both->errors.begin(),
                          both->errors.end(),
                          [](const ErrorOfTwo& error) { return error.name == "magnetometer"; }),
            0);
}

TEST(SideBySide, NamesTheOneThatCannotBeEvaluated) {
  const Trial trial = MakeTrial(6);
  Calibration refused = trial.calibration;
  refused.outcome = Outcome::kNotObservable;
  const auto both = EvaluateSideBySide(trial.calibration, refused, trial.fresh);
  ASSERT_FALSE(both);
  EXPECT_THAT(both.error().message, HasSubstr("b: this calibration is not usable"));
}

// The same readings in other units.
PoseSet InUnits(PoseSet poses, const PerTriad<std::string>& names) {
  for (StreamSummary& stream : poses.streams) {
    const Unit unit = *ParseTriadUnit(stream.triad, names[stream.triad]);
    const double factor = stream.unit.truth_per_raw / unit.truth_per_raw;
    stream.unit = unit;
    for (StaticPose& pose : poses.poses) {
      if (!pose.triads[stream.triad]) continue;
      pose.triads[stream.triad]->mean_raw *= factor;
      pose.triads[stream.triad]->mean_covariance_raw *= factor * factor;
    }
  }
  return poses;
}

TEST(Evaluate, TakesReadingsInAnyUnitOfKnownSize) {
  const Trial trial = MakeTrial(7);
  const auto expected = Evaluate(trial.calibration, trial.fresh);
  ASSERT_TRUE(expected) << expected.error().message;
  const auto found = Evaluate(trial.calibration, InUnits(trial.fresh, {{"g", "deg/s", "G"}}));
  ASSERT_TRUE(found) << found.error().message;
  for (const Triad triad : {Triad::kAccelerometer, Triad::kMagnetometer}) {
    EXPECT_NEAR(*found->norm_rms[triad] / *expected->norm_rms[triad], 1.0, 1e-9);
    EXPECT_NEAR(*found->predicted_rms[triad] / *expected->predicted_rms[triad], 1.0, 1e-9);
    EXPECT_NEAR(*found->error_ratio[triad] / *expected->error_ratio[triad], 1.0, 1e-9);
  }
  EXPECT_NEAR(*found->angle_ratio / *expected->angle_ratio, 1.0, 1e-9);
}

TEST(Evaluate, TakesCountsOfKnownSizeAlone) {
  const Trial trial = MakeTrial(8);
  const auto expected = Evaluate(trial.calibration, trial.fresh);
  PoseSet counts = InUnits(trial.fresh, {{"counts", "counts", "counts"}});  // one is one true unit
  const auto refused = Evaluate(trial.calibration, counts);
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("si_per_count"));
  const auto found = Evaluate(trial.calibration, counts, false, {{1.0, 1.0, 1.0}});
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_NEAR(*found->error_ratio[Triad::kAccelerometer],
              *expected->error_ratio[Triad::kAccelerometer],
              1e-9);
}

TEST(Compare, TakesCalibrationsOfReadingsInOtherUnits) {
  Random random(9);
  const SyntheticUnit unit = RandomUnit({}, &random);
  const PoseSet poses =
      SimulatePoses(unit, RandomAttitudes(24, &random), trials::ModelNoise(), &random);
  const auto in_si = Calibrate(poses, JointOptions(unit));
  const auto in_g = Calibrate(InUnits(poses, {{"g", "deg/s", "mG"}}), JointOptions(unit));
  ASSERT_TRUE(in_si && in_g);
  const auto comparison = Compare(in_si->calibration, in_g->calibration);
  ASSERT_TRUE(comparison) << comparison.error().message;
  // Both are of the same readings, and differ by where the solver stops.
  EXPECT_LT(comparison->largest_in_sigmas, 1e-3);
  EXPECT_GT(comparison->dof, 10);
}

}  // namespace side_by_side_test
}  // namespace truetriad
