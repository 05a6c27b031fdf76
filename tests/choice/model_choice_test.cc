// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "model/attitude_sets.h"
#include "support/accel_mag_trials.h"
#include "support/finding_matchers.h"
#include "truetriad/verdict/summary.h"

namespace truetriad {
namespace model_choice_test {

using ::testing::Contains;
using ::testing::HasSubstr;
using trials::JointOptions;
using trials::ModelNoise;
using trials::RandomUnit;
using trials::UnitSpread;

constexpr Triad kAccel = Triad::kAccelerometer;
constexpr Triad kMag = Triad::kMagnetometer;

// Options with the model of every sensor open.
CalibrateOptions OpenOptions(const SyntheticUnit& unit) {
  CalibrateOptions options = JointOptions(unit);
  options.cross_validation_folds = 5;
  for (const Triad triad : {kAccel, kMag}) {
    options.triads[triad].model = MatrixModel::kAuto;
    options.triads[triad].nominal_sensitivity = Eigen::Matrix3d::Identity();
  }
  options.triads[kAccel].axis_terms[AxisTerm::kQuadratic] = Wanted::kAuto;
  return options;
}

CalibrationSummary Choose(const SyntheticUnit& unit,
                          const CalibrateOptions& options,
                          int poses = 24,
                          std::uint64_t seed = 5) {
  Random random(seed);
  const auto summary =
      Calibrate(SimulatePoses(unit, SpreadAttitudes(poses), ModelNoise(), &random), options);
  EXPECT_TRUE(summary) << summary.error().message;
  EXPECT_TRUE(summary->calibration.IsUsable());
  return *summary;
}

TEST(ModelChoice, TakesTheSmallestModelThatExplainsTheUnit) {
  const UnitSpread nominal{.gain_low = 1.0, .gain_high = 1.0, .cross_axis = 0.0};
  const UnitSpread gains{.cross_axis = 0.0};
  for (const auto& [spread, model] : {std::pair(nominal, MatrixModel::kBias),
                                      std::pair(gains, MatrixModel::kDiagonal),
                                      std::pair(UnitSpread(), MatrixModel::kFull)}) {
    Random random(3);
    const SyntheticUnit unit = RandomUnit(spread, &random);
    const CalibrationSummary summary = Choose(unit, OpenOptions(unit));
    EXPECT_EQ(summary.options.triads[kAccel].model, model);
    EXPECT_EQ(summary.options.triads[kMag].model, model);
    EXPECT_EQ(summary.options.triads[kAccel].axis_terms[AxisTerm::kQuadratic], Wanted::kNo);
  }
}

TEST(ModelChoice, FindsAQuadraticTermThatIsThere) {
  Random random(3);
  SyntheticUnit unit = RandomUnit({}, &random);
  unit.models[kAccel]->axis_terms[AxisTerm::kQuadratic] << 1e-4, -2e-4, 1e-4;
  const CalibrationSummary summary = Choose(unit, OpenOptions(unit));
  EXPECT_EQ(summary.options.triads[kAccel].axis_terms[AxisTerm::kQuadratic], Wanted::kYes);
  EXPECT_TRUE(
      summary.calibration.sensors[kAccel]->axis_term_sigma[AxisTerm::kQuadratic].has_value());
}

TEST(ModelChoice, FindsACubicTermWhereThereIsOne) {
  for (const bool is_there : {true, false}) {
    Random random(3);
    SyntheticUnit unit = RandomUnit({}, &random);
    if (is_there) unit.models[kAccel]->axis_terms[AxisTerm::kCubic] << 2e-4, -3e-4, 2e-4;
    CalibrateOptions options = OpenOptions(unit);
    options.triads[kAccel].axis_terms[AxisTerm::kCubic] = Wanted::kAuto;
    const CalibrationSummary summary = Choose(unit, options);
    EXPECT_EQ(summary.options.triads[kAccel].axis_terms[AxisTerm::kCubic],
              is_there ? Wanted::kYes : Wanted::kNo);
    EXPECT_EQ(summary.calibration.sensors[kAccel]->axis_term_sigma[AxisTerm::kCubic].has_value(),
              is_there);
  }
}

TEST(ModelChoice, KnowsAMagnetometerThatIsOnlySoftIron) {
  Random random(3);
  SyntheticUnit unit = RandomUnit({}, &random);
  Eigen::Matrix3d& S = unit.models[kMag]->sensitivity;
  S = (0.5 * (S + S.transpose())).eval();
  EXPECT_EQ(Choose(unit, OpenOptions(unit)).options.triads[kMag].model, MatrixModel::kSymmetric);
}

TEST(ModelChoice, WeighsBiasesAloneAgainstAnUnknownStrengthOfTheField) {
  Random random(3);
  const SyntheticUnit unit =
      RandomUnit({.gain_low = 1.0, .gain_high = 1.0, .cross_axis = 0.0}, &random);
  CalibrateOptions options = OpenOptions(unit);
  options.reference.field_ut = {};
  const CalibrationSummary summary = Choose(unit, options);
  EXPECT_EQ(summary.options.triads[kMag].model, MatrixModel::kBias);
  EXPECT_NEAR(*summary.calibration.reference.field_ut, unit.field_ut, 0.1);
}

TEST(ModelChoice, LeavesAloneWhatIsStated) {
  Random random(3);
  const SyntheticUnit unit =
      RandomUnit({.gain_low = 1.0, .gain_high = 1.0, .cross_axis = 0.0}, &random);
  CalibrateOptions options = OpenOptions(unit);
  options.triads[kAccel].model = MatrixModel::kFull;
  options.triads[kAccel].axis_terms[AxisTerm::kQuadratic] = Wanted::kYes;
  options.triads[kMag].fixed_sensitivity = Eigen::Matrix3d::Identity();
  const CalibrationSummary summary = Choose(unit, options);
  EXPECT_EQ(summary.options.triads[kAccel].model, MatrixModel::kFull);
  EXPECT_EQ(summary.options.triads[kAccel].axis_terms[AxisTerm::kQuadratic], Wanted::kYes);
  // But for rounding of the gauge's rotation.
  EXPECT_TRUE(summary.calibration.sensors[kMag]->model.sensitivity.isIdentity(1e-12));
}

TEST(ModelChoice, ShowsWhatItWeighed) {
  Random random(3);
  const SyntheticUnit unit = RandomUnit({}, &random);
  const Quality quality = Choose(unit, OpenOptions(unit)).calibration.quality;
  // One step from full: less of either matrix, or a quadratic term.
  ASSERT_EQ(quality.rests.model_choice.size(), 4U);
  const ModelAlternative& chosen = quality.rests.model_choice.front();
  EXPECT_TRUE(chosen.chosen);
  EXPECT_EQ(chosen.description, "accelerometer full; magnetometer full");
  EXPECT_FALSE(chosen.p_value);
  for (const ModelAlternative& model : quality.rests.model_choice) {
    if (model.chosen) continue;
    const bool smaller = model.parameters < chosen.parameters;
    EXPECT_EQ(model.minus_2_log_l > chosen.minus_2_log_l, smaller) << model.description;
    EXPECT_EQ(*model.p_value < 0.01, smaller) << model.description;
    EXPECT_GT(model.bic, chosen.bic) << model.description;
    EXPECT_GT(*model.held_out, *chosen.held_out) << model.description;
  }
}

TEST(ModelChoice, ShowsTheStepsThatLedThere) {
  Random random(3);
  const SyntheticUnit unit =
      RandomUnit({.gain_low = 1.0, .gain_high = 1.0, .cross_axis = 0.0}, &random);
  const Quality quality = Choose(unit, OpenOptions(unit)).calibration.quality;
  const std::vector<ModelAlternative>& steps = quality.rests.model_steps;
  // A quadratic term, two steps of the accelerometer's matrix and three of the magnetometer's.
  ASSERT_EQ(steps.size(), 7U);
  EXPECT_EQ(steps.front().description, "accelerometer full, quadratic term; magnetometer full");
  EXPECT_FALSE(steps.front().p_value);
  for (std::size_t i = 1; i < steps.size(); ++i) {
    EXPECT_LT(steps[i].parameters, steps[i - 1].parameters);
    EXPECT_GT(*steps[i].p_value, 0.0);
  }
  EXPECT_EQ(steps.back().bic, quality.rests.model_choice.front().bic);
}

// Poses of an accelerometer alone, one degree of freedom each, less nine parameters.
TEST(ModelChoice, WeighsNothingWhereFewPosesLeaveNothingToWeighWith) {
  Random random(3);
  const SyntheticUnit unit = RandomUnit({}, &random);
  CalibrateOptions options = OpenOptions(unit);
  options.triads[kMag].enabled = false;
  for (const int poses : {10, 14}) {
    const CalibrationSummary summary = Choose(unit, options, poses);
    EXPECT_EQ(summary.options.triads[kAccel].model, MatrixModel::kFull);
    EXPECT_EQ(summary.options.triads[kAccel].axis_terms[AxisTerm::kQuadratic], Wanted::kNo);
    EXPECT_TRUE(summary.calibration.quality.rests.model_choice.empty());
    EXPECT_THAT(summary.calibration.findings, Contains(HasCode(FindingCode::kChoiceNotMade)));
  }
  // Two more than the least without the quadratic term's three.
  const CalibrationSummary summary = Choose(unit, options, 20);
  EXPECT_EQ(summary.calibration.quality.rests.model_choice.size(), 2U);
}

TEST(ModelChoice, SaysWhatIsMissingWhenNothingIsDetermined) {
  Random random(3);
  const SyntheticUnit unit = RandomUnit({}, &random);
  const auto summary =
      Calibrate(SimulatePoses(unit, SpreadAttitudes(3), ModelNoise(), &random), OpenOptions(unit));
  ASSERT_TRUE(summary);
  EXPECT_EQ(summary->calibration.outcome, Outcome::kNotEnough);
  EXPECT_THAT(summary->calibration.findings.back().Message(), HasSubstr("3 poses"));
  EXPECT_TRUE(summary->calibration.quality.rests.model_choice.empty());
}

}  // namespace model_choice_test
}  // namespace truetriad
