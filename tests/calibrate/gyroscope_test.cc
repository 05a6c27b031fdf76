// SPDX-License-Identifier: Apache-2.0
//
// The gyroscope in the graph: its turns tie the poses together, its rests show its bias.

#include <algorithm>
#include <cmath>
#include <memory>
#include <ostream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "math/distributions.h"
#include "math/random.h"
#include "sim/scenario_samples.h"
#include "support/finding_matchers.h"
#include "truetriad/calibrate/calibrate.h"
#include "truetriad/calibrate/evaluate.h"
#include "truetriad/data/pose_collection.h"
#include "truetriad/math/rotation.h"
#include "truetriad/verdict/summary.h"

namespace truetriad {
namespace gyroscope_test {

using ::testing::HasSubstr;

constexpr Triad kAccel = Triad::kAccelerometer;
constexpr Triad kGyro = Triad::kGyroscope;
constexpr Triad kMag = Triad::kMagnetometer;
constexpr double kRateHz = 100.0;

// What a simulated unit and its recording have.
struct Parts {
  bool g_sensitivity = false;
  bool magnetometer = false;
  bool higher_terms = false;
};
void PrintTo(const Parts& parts, std::ostream* out) {
  *out << "Gyroscope" << (parts.g_sensitivity ? "WithG" : "")
       << (parts.magnetometer ? "AndMagnetometer" : "") << (parts.higher_terms ? "Bent" : "");
}

// A unit with a gyroscope in counts, axes permuted, that may have g-sensitivity.
Scenario GyroscopeScenario(const Parts& parts) {
  Scenario scenario = QuietScenario();
  if (!parts.magnetometer) scenario.sensors[kMag].reset();
  SimulatedTriad& gyroscope = *scenario.sensors[kGyro];
  gyroscope.unit = {"counts", 1.0, true};
  gyroscope.nominal.sensitivity << 60.0, 4700.0, -30.0, -4800.0, 90.0, 200.0, -100.0, 60.0, 4600.0;
  gyroscope.nominal.bias << 32768.0, 32400.0, 32900.0;
  gyroscope.gyroscope_output = GyroscopeOutput::kInstantaneous;
  if (parts.higher_terms) {
    // In their own order the poses lie along a spiral, and every axis would turn one way only.
    std::get<PosesStep>(scenario.motion.front()).shuffle = true;
    gyroscope.nominal.axis_terms[AxisTerm::kAsymmetry] << 2e-3, -1e-3, 3e-3;
    // 1000 to 3000 ug/g^2.
    scenario.sensors[kAccel]->nominal.axis_terms[AxisTerm::kQuadratic] << 1e-4, -3e-4, 2e-4;
    // As many ug/g^3.
    scenario.sensors[kAccel]->nominal.axis_terms[AxisTerm::kCubic] << -1e-5, 2e-5, 3e-5;
  }
  if (parts.g_sensitivity) {
    gyroscope.g_sensitivity.emplace();
    *gyroscope.g_sensitivity << 3.0, -1.0, 0.5, 0.2, 2.0, -0.7, 1.1, 0.4, -2.0;
  }
  return scenario;
}

CalibrateOptions OptionsFor(const Scenario& scenario) {
  CalibrateOptions options;
  options.cross_validation_folds = 0;
  options.reference.gravity_mps2 = {scenario.world.gravity_mps2, 0.0};
  options.reference.field_ut = {scenario.world.field_ut, 0.0};
  for (const Triad triad : kTriads) {
    options.triads[triad].enabled = scenario.sensors[triad].has_value();
    options.triads[triad].excess = ExcessNoise::kNone;
  }
  if (scenario.sensors[kGyro]->g_sensitivity) options.triads[kGyro].g_sensitivity = Wanted::kYes;
  for (const AxisTermInfo& info : kAxisTerms) {
    const auto& sensor = scenario.sensors[info.triad];
    if (!sensor || sensor->nominal.axis_terms[info.term].isZero(0.0)) continue;
    options.triads[info.triad].axis_terms[info.term] = Wanted::kYes;
  }
  return options;
}

// The poses by the rows of the true rests, or from `early_s` before, with the moves between them.
PoseSet Collect(const Scenario& scenario, double early_s = 0.0) {
  const std::unique_ptr<Simulation> simulation = Simulate(scenario);
  PoseSelection selection;
  selection.kind = PoseSelectionKind::kRanges;
  selection.moves = true;
  for (const TrueRest& rest : simulation->rests()) {
    const auto first = static_cast<std::int64_t>(
        std::max(0.0, std::ceil((rest.start_s - early_s) * kRateHz - 1e-6)));
    const auto last = static_cast<std::int64_t>(std::ceil(rest.end_s * kRateHz - 1e-6)) - 1;
    selection.ranges.push_back({first, last, {}, {}});
  }
  Result<PoseSet> poses = CollectPoses(*simulation, selection);
  EXPECT_TRUE(poses) << poses.error().message;
  return *std::move(poses);
}

class GyroscopeOf : public ::testing::TestWithParam<Parts> {
 protected:
  Scenario scenario() const { return GyroscopeScenario(GetParam()); }
};

// Readings of mean rates: integrating them is exact for turns about a fixed axis, except for the
// effect of specific force, which is taken at the times for which the readings stand.
TEST_P(GyroscopeOf, IsFoundExactlyWithoutNoise) {
  const Scenario quiet = scenario();
  CalibrateOptions options = OptionsFor(quiet);
  for (TriadOptions& triad : options.triads) {
    triad.noise_sigma_raw = Eigen::Vector3d::Constant(1e-4);
  }
  const auto summary = Calibrate(Collect(quiet), options);
  ASSERT_TRUE(summary) << summary.error().message;
  ASSERT_TRUE(summary->calibration.IsUsable()) << summary->calibration.findings.back().Message();
  const Calibration truth = TruthOf(quiet, 0);
  const TriadCalibration& found = *summary->calibration.sensors[kGyro];
  const TriadCalibration& expected = *truth.sensors[kGyro];
  // The trapezoid's error of a minimum-jerk turn falls with the sixth power of 1 / 120, its number
  // of steps; the readings are rounded to 1e-16 of 3e4 counts.
  EXPECT_LT((found.model.sensitivity - expected.model.sensitivity).norm(), 1e-7 * 4700.0);
  EXPECT_LT((found.model.bias - expected.model.bias).norm(), 1e-6);
  ASSERT_EQ(found.g_sensitivity.has_value(), expected.g_sensitivity.has_value());
  if (found.g_sensitivity) {
    EXPECT_LT((*found.g_sensitivity - *expected.g_sensitivity).norm(), 1e-6);
  }
  for (const AxisTermInfo& info : kAxisTerms) {
    const TriadCalibration& sensor = *summary->calibration.sensors[info.triad];
    const TriadModel<double>& true_model = truth.sensors[info.triad]->model;
    const Eigen::Vector3d& value = true_model.axis_terms[info.term];
    // As a share of the signal; gravity is solved to 1e-9.
    const bool is_gyroscope = info.triad == kGyro;
    const double signal =
        true_model.sensitivity.row(0).norm() * (is_gyroscope ? 1.0 : kStandardGravityMps2);
    EXPECT_LT((sensor.model.axis_terms[info.term] - value).norm() * info.PowerOf(signal),
              is_gyroscope ? 1e-7 : 1e-9);
    EXPECT_EQ(sensor.axis_term_sigma[info.term].has_value(), !value.isZero(0.0));
  }
  EXPECT_LT(*summary->calibration.quality.residual_rms[kGyro], 1e-8);
}

// χ² of all errors with their printed covariance, summed over runs: inside its 99.9 % interval.
TEST_P(GyroscopeOf, HasTheErrorsThatItStates) {
  Scenario noisy = scenario();
  noisy.sensors[kAccel]->noise.density.setConstant(0.003);
  noisy.sensors[kGyro]->noise.density.setConstant(2e-4);
  if (noisy.sensors[kMag]) noisy.sensors[kMag]->noise.density.setConstant(0.04);
  double chi2 = 0.0;
  double dof = 0.0;
  for (int run = 0; run < 40; ++run) {
    noisy.seed = static_cast<std::uint64_t>(100 + run);
    CalibrateOptions options = OptionsFor(noisy);
    options.robust.enabled = false;
    const auto summary = Calibrate(Collect(noisy), options);
    ASSERT_TRUE(summary) << summary.error().message;
    ASSERT_TRUE(summary->calibration.IsUsable()) << summary->calibration.findings.back().Message();
    Calibration truth = TruthOf(noisy, 0);
    truth.gauge = Gauge::kAccelX;
    const auto comparison = Compare(truth, summary->calibration);
    ASSERT_TRUE(comparison) << comparison.error().message;
    chi2 += comparison->chi2;
    dof += comparison->dof;
  }
  RecordProperty("nees_per_dof", std::to_string(chi2 / dof));
  EXPECT_GT(ChiSquareCdf(chi2, dof), 0.0005) << chi2 / dof;
  EXPECT_LT(ChiSquareCdf(chi2, dof), 0.9995) << chi2 / dof;
}

INSTANTIATE_TEST_SUITE_P(EachSet,
                         GyroscopeOf,
                         ::testing::Values(Parts{false, false, false},
                                           Parts{true, false, false},
                                           Parts{false, true, false},
                                           Parts{true, true, false},
                                           Parts{false, false, true},
                                           Parts{true, true, true}),
                         ::testing::PrintToStringParamName());

TEST(Gyroscope, DropsATurnThatSaturatesAndStillFindsTheRest) {
  Scenario scenario = GyroscopeScenario({});
  scenario.sensors[kAccel]->noise.density.setConstant(0.003);
  scenario.sensors[kGyro]->noise.density.setConstant(2e-4);
  // Half a turn in 1.2 s with minimum jerk reaches 1.875 pi / 1.2 = 4.9 rad/s.
  scenario.sensors[kGyro]->range_raw = Eigen::Vector2d(32768.0 - 17000.0, 32768.0 + 17000.0);
  PoseSet poses = Collect(scenario);
  int faulty = 0;
  for (const RecordedMove& move : poses.moves) faulty += move.fault ? 1 : 0;
  ASSERT_GT(faulty, 0);
  ASSERT_LT(faulty, 12);
  const auto summary = Calibrate(poses, OptionsFor(scenario));
  ASSERT_TRUE(summary) << summary.error().message;
  ASSERT_TRUE(summary->calibration.IsUsable()) << summary->calibration.findings.back().Message();
  const auto comparison = Compare(TruthOf(scenario, 0), summary->calibration);
  ASSERT_TRUE(comparison);
  EXPECT_GT(comparison->p_value, 1e-3);
}

// In their own order the poses lie along a spiral, so that hardly an axis turns both ways:
// asymmetry and gain are then one. The run ends there, and says which turns would help.
TEST(Gyroscope, NamesAnAsymmetryThatItsTurnsDoNotShow) {
  Scenario scenario = GyroscopeScenario({});
  scenario.sensors[kAccel]->noise.density.setConstant(0.003);
  scenario.sensors[kGyro]->noise.density.setConstant(2e-4);
  auto& poses = std::get<PosesStep>(scenario.motion.front());
  // Turns the same way about each axis of the body in turn, with a tilt that shows them.
  poses.poses.clear();
  Eigen::Quaterniond attitude(Eigen::AngleAxisd(0.5, Eigen::Vector3d(1.0, 1.0, 0.0).normalized()));
  for (int k = 0; k < 24; ++k) {
    poses.poses.push_back({attitude, {}, {}});
    attitude = attitude * Eigen::AngleAxisd(1.1, Eigen::Vector3d::Unit(k % 3));
  }
  CalibrateOptions options = OptionsFor(scenario);
  options.triads[kGyro].axis_terms[AxisTerm::kAsymmetry] = Wanted::kYes;
  const auto summary = Calibrate(Collect(scenario), options);
  ASSERT_TRUE(summary) << summary.error().message;
  EXPECT_EQ(summary->calibration.outcome, Outcome::kNotObservable)
      << summary->calibration.findings.back().Message();
  bool is_named = false;
  for (const WeakDirection& weak : summary->calibration.quality.weak_directions) {
    is_named = is_named || (weak.description.find("asymmetry") != std::string::npos &&
                            weak.advice.find("both ways") != std::string::npos);
  }
  EXPECT_TRUE(is_named);
  // Without the asymmetry the turns suffice.
  options.triads[kGyro].axis_terms[AxisTerm::kAsymmetry] = Wanted::kNo;
  const auto without = Calibrate(Collect(scenario), options);
  ASSERT_TRUE(without);
  EXPECT_TRUE(without->calibration.IsUsable()) << without->calibration.findings.back().Message();
}

// A matrix that is held from another unit would turn the poses by wrong angles.
TEST(Gyroscope, RefusesAMatrixThatIsHeldAndNotItsOwn) {
  Scenario scenario = GyroscopeScenario({false, true, false});
  scenario.sensors[kAccel]->noise.density.setConstant(0.003);
  scenario.sensors[kGyro]->noise.density.setConstant(2e-4);
  scenario.sensors[kMag]->noise.density.setConstant(0.04);
  const PoseSet poses = Collect(scenario);
  const Eigen::Matrix3d truth = TruthOf(scenario, 0).sensors[kGyro]->model.sensitivity;
  CalibrateOptions options = OptionsFor(scenario);
  options.triads[kGyro].excess = ExcessNoise::kEstimate;
  options.triads[kGyro].fixed_sensitivity = truth;
  const auto right = Calibrate(poses, options);
  ASSERT_TRUE(right) << right.error().message;
  EXPECT_TRUE(right->calibration.IsUsable()) << right->calibration.findings.back().Message();
  for (const double factor : {1.3, 2.0, -1.0, 100.0}) {
    options.triads[kGyro].fixed_sensitivity = factor * truth;
    const auto wrong = Calibrate(poses, options);
    ASSERT_TRUE(wrong) << wrong.error().message;
    EXPECT_EQ(wrong->calibration.outcome, Outcome::kNotConverged) << factor;
    EXPECT_THAT(wrong->calibration.findings.back(), HasCode(FindingCode::kHeldGyroscope));
  }
  // An error of a few per cent is reported.
  options.triads[kGyro].fixed_sensitivity = 1.03 * truth;
  const auto near = Calibrate(poses, options);
  ASSERT_TRUE(near);
  const Finding* held = Find(near->calibration.findings, FindingCode::kHeldGyroscope);
  ASSERT_NE(held, nullptr);
  EXPECT_EQ(held->severity, Severity::kWarning);
}

// Noise of a good unit: rests of 1 s at 100 Hz, and turns of 1.2 s.
Scenario NoisyGyroscopeScenario(std::uint64_t seed) {
  Scenario scenario = GyroscopeScenario({true, false, false});
  scenario.sensors[kAccel]->noise.density.setConstant(0.003);
  scenario.sensors[kGyro]->noise.density.setConstant(2e-4);
  scenario.seed = seed;
  return scenario;
}

// The one Gauss-Newton step by which a turn is left out, against a whole calibration without it.
TEST(Gyroscope, IsHeldOutTurnByTurnAsIfEachHadNotBeenRecorded) {
  const Scenario scenario = NoisyGyroscopeScenario(5);
  CalibrateOptions options = OptionsFor(scenario);
  options.robust.enabled = false;
  options.cross_validation_folds = 5;
  const PoseSet poses = Collect(scenario);
  const auto whole = Calibrate(poses, options);
  ASSERT_TRUE(whole) << whole.error().message;
  ASSERT_TRUE(whole->calibration.quality.rests.held_out.has_value());
  const auto& turns = whole->calibration.quality.rests.held_out->turns;
  ASSERT_TRUE(turns.has_value());
  ASSERT_EQ(turns->errors_rad.size(), poses.moves.size());
  for (std::size_t i = 0; i < poses.moves.size(); i += 5) {
    PoseSet without = poses;
    without.moves[i].fault = Finding(FindingCode::kTurnGap, "left out by the test");
    const auto part = Calibrate(without, options);
    ASSERT_TRUE(part) << part.error().message;
    PoseSet only = poses;
    for (std::size_t k = 0; k < only.moves.size(); ++k) {
      if (k != i) only.moves[k].fault = Finding(FindingCode::kTurnGap, "not asked");
    }
    const auto evaluation = Evaluate(part->calibration, only);
    ASSERT_TRUE(evaluation) << evaluation.error().message;
    ASSERT_EQ(evaluation->turns->count, 1);
    // A shift of the parameters by 1e-3 of themselves changes a turn of 3 rad by 3e-3; the second
    // order of that is 1e-5.
    EXPECT_NEAR(turns->errors_rad[i], evaluation->turns->rms_rad, 1e-5) << "turn " << i;
  }
}

// Only in the recording that the calibration was made from; in another one all turns count.
TEST(Gyroscope, IsNotEvaluatedOnATurnThatItsCalibrationLeftOut) {
  const Scenario scenario = NoisyGyroscopeScenario(5);
  CalibrateOptions options = OptionsFor(scenario);
  for (TriadOptions& triad : options.triads) triad.excess = ExcessNoise::kEstimate;
  PoseSet poses = Collect(scenario);
  // Adds a hundredth of a radian a second.
  for (Eigen::Vector3d& reading : poses.moves[3].gyroscope_raw) reading[1] += 50.0;
  const auto summary = Calibrate(poses, options);
  ASSERT_TRUE(summary) << summary.error().message;
  ASSERT_EQ(summary->calibration.quality.rests.rejected_poses.size(), 1U);
  const auto turns = static_cast<int>(poses.moves.size());
  const auto own = Evaluate(summary->calibration, poses, /*is_own=*/true);
  ASSERT_TRUE(own) << own.error().message;
  EXPECT_TRUE(own->is_own);
  EXPECT_EQ(own->turns->count, turns - 1);
  const auto other = Evaluate(summary->calibration, poses);
  ASSERT_TRUE(other) << other.error().message;
  EXPECT_EQ(other->turns->count, turns);
  EXPECT_GT(other->turns->rms_rad, 5.0 * own->turns->rms_rad);
}

// Whether the gyroscope is said to be turning still in rests that begin `early_s` too soon.
bool SaysUnsettled(double early_s, std::uint64_t seed) {
  Scenario scenario = NoisyGyroscopeScenario(seed);
  std::get<PosesStep>(scenario.motion.front()).rest_s = 2.0;
  CalibrateOptions options = OptionsFor(scenario);
  for (TriadOptions& triad : options.triads) triad.excess = ExcessNoise::kEstimate;
  const auto summary = Calibrate(Collect(scenario, early_s), options);
  EXPECT_TRUE(summary) << summary.error().message;
  if (!summary) return false;
  const auto& tests = summary->calibration.quality.left_out_tests;
  return std::any_of(tests.begin(), tests.end(), [](const LeftOutTest& test) {
    return test.triad == kGyro && test.term == "settling" && test.is_shown;
  });
}

TEST(Gyroscope, ThatStillTurnsWhereRestsBeginIsFound) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) EXPECT_TRUE(SaysUnsettled(0.3, seed)) << seed;
}

// The test is at a level of 1e-4: more than one of 40 has a probability of 1e-5.
TEST(Gyroscope, ThatHasComeToRestIsNotSaidToTurn) {
  int said = 0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) said += SaysUnsettled(0.0, seed) ? 1 : 0;
  EXPECT_LE(said, 1);
}

// Errors² of fresh recordings over what was predicted of them, summed: each angle² has two degrees
// of freedom, so that the mean of 40 runs of some 11 turns scatters by sqrt(2 / 880) = 5 %, and by
// twice that where neighbours share a pose and a run shares its parameters. 4 sigma.
TEST(Gyroscope, IsAsGoodOnFreshTurnsAsIsPredicted) {
  double ratio = 0.0;
  constexpr int kRuns = 40;
  for (int run = 0; run < kRuns; ++run) {
    const Scenario scenario = NoisyGyroscopeScenario(static_cast<std::uint64_t>(200 + 2 * run));
    CalibrateOptions options = OptionsFor(scenario);
    options.robust.enabled = false;
    const auto summary = Calibrate(Collect(scenario), options);
    ASSERT_TRUE(summary) << summary.error().message;
    Scenario later = scenario;
    ++later.seed;
    const auto evaluation = Evaluate(summary->calibration, Collect(later));
    ASSERT_TRUE(evaluation) << evaluation.error().message;
    ASSERT_TRUE(evaluation->turns.has_value());
    const double error = evaluation->turns->rms_rad / evaluation->turns->predicted_rms_rad;
    ratio += error * error / kRuns;
    // Its rests show a rate of zero as well as the means are known.
    EXPECT_NEAR(*evaluation->norm_rms[kGyro] / *evaluation->predicted_rms[kGyro], 1.0, 0.6);
  }
  RecordProperty("squared_error_over_predicted", std::to_string(ratio));
  EXPECT_NEAR(ratio, 1.0, 0.4);
}

TEST(Gyroscope, IsNotCalibratedAloneWithoutKnownMotions) {
  const Scenario scenario = GyroscopeScenario({});
  CalibrateOptions options = OptionsFor(scenario);
  options.triads[kAccel].enabled = false;
  const auto summary = Calibrate(Collect(scenario), options);
  ASSERT_TRUE(summary) << summary.error().message;
  EXPECT_FALSE(summary->calibration.IsUsable());
  EXPECT_THAT(summary->calibration.findings.back(), HasCode(FindingCode::kNoKnownMotion));
}

TEST(Gyroscope, IsRefusedWhereNothingTurns) {
  Scenario scenario = GyroscopeScenario({});
  PoseSet poses = Collect(scenario);
  poses.moves.clear();
  const auto summary = Calibrate(poses, OptionsFor(scenario));
  ASSERT_TRUE(summary) << summary.error().message;
  EXPECT_FALSE(summary->calibration.IsUsable());
  EXPECT_THAT(summary->calibration.findings.back(), HasCode(FindingCode::kTurnAxesMissing));
}

class ChoiceOfTheGyroscope : public ::testing::TestWithParam<Parts> {};

// A unit of the kind of GyroscopeScenario, calibrated with everything left open.
TEST_P(ChoiceOfTheGyroscope, HasTheTermsThatTheUnitHas) {
  Scenario scenario = GyroscopeScenario(GetParam());
  scenario.sensors[kAccel]->noise.density.setConstant(0.003);
  scenario.sensors[kGyro]->noise.density.setConstant(2e-4);
  if (scenario.sensors[kMag]) scenario.sensors[kMag]->noise.density.setConstant(0.04);
  CalibrateOptions options = OptionsFor(scenario);
  options.cross_validation_folds = 5;
  for (TriadOptions& triad : options.triads) triad.model = MatrixModel::kAuto;
  options.triads[kAccel].axis_terms[AxisTerm::kQuadratic] = Wanted::kAuto;
  options.triads[kGyro].axis_terms[AxisTerm::kAsymmetry] = Wanted::kAuto;
  options.triads[kGyro].g_sensitivity = Wanted::kAuto;
  const auto summary = Calibrate(Collect(scenario), options);
  ASSERT_TRUE(summary) << summary.error().message;
  ASSERT_TRUE(summary->calibration.IsUsable()) << summary->calibration.findings.back().Message();
  const CalibrateOptions& chosen = summary->options;
  const auto wanted = [](bool there) { return there ? Wanted::kYes : Wanted::kNo; };
  EXPECT_EQ(chosen.triads[kGyro].g_sensitivity, wanted(GetParam().g_sensitivity));
  EXPECT_EQ(chosen.triads[kGyro].axis_terms[AxisTerm::kAsymmetry], wanted(GetParam().higher_terms));
  EXPECT_EQ(chosen.triads[kAccel].axis_terms[AxisTerm::kQuadratic],
            wanted(GetParam().higher_terms));
  EXPECT_EQ(chosen.triads[kGyro].model, MatrixModel::kFull);
  EXPECT_EQ(chosen.triads[kAccel].model, MatrixModel::kFull);
  ASSERT_FALSE(summary->calibration.quality.rests.model_choice.empty());
  // The result is the same as if the chosen model had been asked for.
  const auto again = Calibrate(Collect(scenario), chosen);
  ASSERT_TRUE(again);
  EXPECT_EQ(again->calibration.sensors[kGyro]->model.sensitivity,
            summary->calibration.sensors[kGyro]->model.sensitivity);
  EXPECT_TRUE(again->calibration.quality.rests.model_choice.empty());
}

INSTANTIATE_TEST_SUITE_P(EachSet,
                         ChoiceOfTheGyroscope,
                         ::testing::Values(Parts{false, false, false},
                                           Parts{true, false, false},
                                           Parts{false, true, true},
                                           Parts{true, true, true}),
                         ::testing::PrintToStringParamName());

// ------------------------------------------------------------------------------------ earth's rate

constexpr double kLatitudeRad = 0.8;
constexpr double kDeclinationRad = 0.1;

// A nine-axis unit whose gyroscope feels the earth turn, and options that allow for that.
Scenario EarthScenario() {
  Scenario scenario = GyroscopeScenario({true, true, false});
  scenario.world.earth_rate = SimulatedWorld::EarthRate{kLatitudeRad, kDeclinationRad};
  return scenario;
}

CalibrateOptions EarthOptions(const Scenario& scenario) {
  CalibrateOptions options = OptionsFor(scenario);
  options.reference.earth_rate = EarthRateOptions{kLatitudeRad, kDeclinationRad};
  for (TriadOptions& triad : options.triads) {
    triad.noise_sigma_raw = Eigen::Vector3d::Constant(1e-4);
  }
  return options;
}

// Norm of the error of the gyroscope's bias, counts: the earth's rate is 0.34 of them.
double BiasError(const CalibrationSummary& summary, const Scenario& scenario) {
  return (summary.calibration.sensors[kGyro]->model.bias -
          TruthOf(scenario, 0).sensors[kGyro]->model.bias)
      .norm();
}

TEST(EarthRate, IsTakenOutExactlyWithoutNoise) {
  const Scenario scenario = EarthScenario();
  const PoseSet poses = Collect(scenario);
  CalibrateOptions options = EarthOptions(scenario);
  options.robust.enabled = false;
  const auto summary = Calibrate(poses, options);
  ASSERT_TRUE(summary) << summary.error().message;
  ASSERT_TRUE(summary->calibration.IsUsable()) << summary->calibration.findings.back().Message();
  const TriadCalibration& found = *summary->calibration.sensors[kGyro];
  const Calibration truth = TruthOf(scenario, 0);
  const TriadCalibration& expected = *truth.sensors[kGyro];
  // The limits are those without the earth's rate.
  EXPECT_LT((found.model.sensitivity - expected.model.sensitivity).norm(), 1e-7 * 4700.0);
  EXPECT_LT(BiasError(*summary, scenario), 1e-6);
  EXPECT_LT((*found.g_sensitivity - *expected.g_sensitivity).norm(), 1e-6);
  EXPECT_LT(*summary->calibration.quality.residual_rms[kGyro], 1e-8);
  const double counted_chi2 = summary->calibration.quality.reduced_chi2;
  EXPECT_LT(counted_chi2, 1e-3);

  // If the earth's rate is left out, turns contradict the other sensors: nothing is usable.
  options.reference.earth_rate.reset();
  const auto ignored = Calibrate(poses, options);
  ASSERT_TRUE(ignored) << ignored.error().message;
  EXPECT_GT(ignored->calibration.quality.reduced_chi2, 1e3);
  EXPECT_FALSE(ignored->calibration.IsUsable());
}

// Variances in uT^2, (rad/s)^2 and rad^2 side by side: each keeps its degrees of freedom.
TEST(ExcessNoise, OfAMagnetometerHasDegreesOfFreedomBesideThatOfTurns) {
  Scenario scenario = GyroscopeScenario({true, true, false});
  scenario.sensors[kAccel]->noise.density.setConstant(0.003);
  scenario.sensors[kGyro]->noise.density.setConstant(2e-6);
  scenario.sensors[kMag]->noise.density.setConstant(0.04);
  PoseSet poses = Collect(scenario);
  const Eigen::Matrix3d S = TruthOf(scenario, 0).sensors[kMag]->model.sensitivity;
  Random random(8);
  for (StaticPose& pose : poses.poses) {
    pose.triads[kMag]->mean_raw += S * random.Normal3();
  }
  CalibrateOptions options = OptionsFor(scenario);
  for (TriadOptions& triad : options.triads) triad.excess = ExcessNoise::kEstimate;
  const auto summary = Calibrate(poses, options);
  ASSERT_TRUE(summary) << summary.error().message;
  ASSERT_TRUE(summary->calibration.IsUsable()) << summary->calibration.findings.back().Message();
  const double dof = summary->calibration.sensors[kMag]->noise.excess_dof;
  EXPECT_GT(dof, 1.0);
  EXPECT_LT(dof, 3.0 * static_cast<double>(poses.poses.size()));
}

// Without a given dip, its sign is that of the hemisphere: the side on which the earth's rate has
// to be.
TEST(EarthRate, IsTakenOutExactlyInTheSouthernHemisphere) {
  Scenario scenario = EarthScenario();
  scenario.world.earth_rate->latitude_rad = -kLatitudeRad;
  scenario.world.dip_rad = -1.1;
  CalibrateOptions options = EarthOptions(scenario);
  options.reference.earth_rate->latitude_rad = -kLatitudeRad;
  options.reference.northern_hemisphere = false;
  const auto summary = Calibrate(Collect(scenario), options);
  ASSERT_TRUE(summary) << summary.error().message;
  ASSERT_TRUE(summary->calibration.IsUsable()) << summary->calibration.findings.back().Message();
  EXPECT_LT(BiasError(*summary, scenario), 1e-6);
}

// Attitudes from outside whose heading nobody knows, without a magnetometer: the gyroscope finds
// north.
TEST(EarthRate, TellsTheHeadingOfKnownAttitudes) {
  Scenario scenario = EarthScenario();
  scenario.sensors[kMag].reset();
  PoseSet poses = Collect(scenario);
  const Eigen::Quaterniond outside_from_world = RotationExp({0.0, 0.0, 2.5});
  const std::vector<TrueRest> rests = Simulate(scenario)->rests();
  ASSERT_EQ(rests.size(), poses.poses.size());
  for (std::size_t k = 0; k < rests.size(); ++k) {
    poses.poses[k].attitude.emplace().world_from_body =
        outside_from_world * rests[k].world_from_body;
  }
  CalibrateOptions options = EarthOptions(scenario);
  options.attitudes.kind = AttitudeKind::kGiven;
  options.gauge = Gauge::kFixture;
  const auto summary = Calibrate(poses, options);
  ASSERT_TRUE(summary) << summary.error().message;
  ASSERT_TRUE(summary->calibration.IsUsable()) << summary->calibration.findings.back().Message();
  EXPECT_LT(BiasError(*summary, scenario), 1e-6);
  EXPECT_LT(*summary->calibration.quality.residual_rms[kGyro], 1e-8);
}

TEST(EarthRate, IsRefusedWhereNothingTellsTheHeading) {
  const Scenario scenario = EarthScenario();
  CalibrateOptions options = EarthOptions(scenario);
  EXPECT_TRUE(options.Validate());
  PoseSet poses = Collect(scenario);
  for (RecordedMove& move : poses.moves) {
    if (move.from == 3 || move.from == 4) {
      move.fault = Finding(FindingCode::kTurnGap, "not recorded");
    }
  }
  poses.poses[4].triads[kMag].reset();
  const auto summary = Calibrate(poses, options);
  ASSERT_FALSE(summary);
  EXPECT_THAT(summary.error().message, HasSubstr("pose 5"));

  options.triads[kMag].enabled = false;
  const Status status = options.Validate();
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().kind(), ErrorKind::kUsage);
  EXPECT_THAT(status.error().message, HasSubstr("heading"));
  options.triads[kGyro].enabled = false;
  EXPECT_TRUE(options.Validate());
}

TEST(EarthRate, IsRefusedForAUnitThatIsTumbled) {
  CalibrateOptions options = EarthOptions(EarthScenario());
  options.triads[kGyro].g_sensitivity = Wanted::kNo;
  options.motion = MotionOptions();
  const Status status = options.Validate();
  ASSERT_FALSE(status);
  EXPECT_THAT(status.error().message, HasSubstr("motion"));
}

}  // namespace gyroscope_test
}  // namespace truetriad
