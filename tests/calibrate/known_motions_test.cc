// SPDX-License-Identifier: Apache-2.0
//
// Rates of a table and turns by hand that the operator states.

#include <cmath>
#include <memory>
#include <numbers>
#include <optional>
#include <random>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "data/memory_source.h"
#include "math/distributions.h"
#include "math/random.h"
#include "problem/known_motion_rows.h"
#include "sim/scenario_samples.h"
#include "support/finding_matchers.h"
#include "truetriad/calibrate/calibrate.h"
#include "truetriad/calibrate/evaluate.h"
#include "truetriad/data/pose_collection.h"

namespace truetriad {
namespace known_motions_test {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr Triad kAccel = Triad::kAccelerometer;
constexpr Triad kGyro = Triad::kGyroscope;
constexpr Triad kMag = Triad::kMagnetometer;
constexpr double kTwoPi = 2.0 * std::numbers::pi;

void UseCounts(SimulatedTriad* gyroscope) {
  gyroscope->unit = {"counts", 1.0, true};
  gyroscope->nominal.sensitivity << 60.0, 4700.0, -30.0, -4800.0, 90.0, 200.0, -100.0, 60.0, 4600.0;
  gyroscope->nominal.bias << 32768.0, 32400.0, 32900.0;
}

// A gyroscope in counts, axes permuted, and nothing else on a table that turns about three axes.
Scenario RateTable() {
  Scenario scenario = QuietScenario();
  scenario.sensors[kAccel].reset();
  scenario.sensors[kMag].reset();
  UseCounts(&*scenario.sensors[kGyro]);
  scenario.motion.clear();
  for (int axis = 0; axis < 3; ++axis) {
    RateStep step;
    step.axis_in_body = Eigen::Vector3d::Unit(axis);
    step.rates_radps = {-3.0, -1.0, 1.0, 3.0};
    scenario.motion.emplace_back(step);
  }
  return scenario;
}

// The same gyroscope turned by hand: once, and twice back, about each axis.
Scenario HandTurns() {
  Scenario scenario = RateTable();
  scenario.motion.clear();
  for (int axis = 0; axis < 3; ++axis) {
    for (const double turns : {1.0, -2.0}) {
      TurnStep step;
      step.axis_in_body = Eigen::Vector3d::Unit(axis);
      step.turns = turns;
      scenario.motion.emplace_back(step);
    }
  }
  return scenario;
}

// What the program writes beside a simulated recording.
PoseSelection SelectionOf(const Scenario& scenario) {
  const std::unique_ptr<Simulation> simulation = Simulate(scenario);
  std::vector<SampleBlock> blocks;
  while (*simulation->Next(&blocks)) {
  }
  PoseSelection selection;
  selection.kind = PoseSelectionKind::kRanges;
  selection.moves = true;
  selection.ranges = simulation->rest_rows();
  selection.turns = simulation->turns();
  selection.rates = simulation->rates();
  for (StatedTurn& turn : selection.turns) {
    turn.sigma_rad = 0.01;
    turn.axis_sigma_rad = 0.02;
  }
  return selection;
}

PoseSet Collect(const Scenario& scenario, const PoseSelection& selection) {
  Result<PoseSet> poses = CollectPoses(*Simulate(scenario), selection);
  EXPECT_TRUE(poses) << poses.error().message;
  return *std::move(poses);
}

CalibrateOptions OptionsFor(const Scenario& scenario) {
  CalibrateOptions options;
  options.cross_validation_folds = 0;
  options.reference.gravity_mps2 = {scenario.world.gravity_mps2, 0.0};
  for (const Triad triad : kTriads) {
    options.triads[triad].enabled = scenario.sensors[triad].has_value();
    options.triads[triad].excess = ExcessNoise::kNone;
  }
  if (options.HasGyroscopeAlone()) options.gauge = Gauge::kFixture;
  return options;
}

Calibration Calibrated(const PoseSet& poses, const CalibrateOptions& options) {
  const auto summary = Calibrate(poses, options);
  EXPECT_TRUE(summary) << summary.error().message;
  if (!summary) return {};
  EXPECT_TRUE(summary->calibration.IsUsable()) << summary->calibration.findings.back().Message();
  return summary->calibration;
}

// Errors of the gyroscope against the truth, as shares of its gain and in counts.
void ExpectTruth(const Scenario& scenario, const Calibration& found, double share, double counts) {
  ASSERT_TRUE(found.sensors[kGyro]);
  const Calibration truth = TruthOf(scenario, 0);
  const TriadModel<double>& expected = truth.sensors[kGyro]->model;
  const TriadModel<double>& model = found.sensors[kGyro]->model;
  EXPECT_LT((model.sensitivity - expected.sensitivity).norm(), share * expected.sensitivity.norm());
  EXPECT_LT((model.bias - expected.bias).norm(), counts);
}

TEST(KnownRates, GiveAGyroscopeAloneExactlyWithoutNoise) {
  const Scenario scenario = RateTable();
  const PoseSet poses = Collect(scenario, SelectionOf(scenario));
  EXPECT_THAT(poses.rates, SizeIs(12));
  CalibrateOptions options = OptionsFor(scenario);
  options.triads[kGyro].noise_sigma_raw = Eigen::Vector3d::Constant(1.0);
  // Readings are rounded to 1e-6 counts in 5e4.
  ExpectTruth(scenario, Calibrated(poses, options), 1e-9, 1e-5);
}

// χ² of all errors with their printed covariance, summed over runs: inside its 99.9 % interval.
TEST(KnownRates, HaveTheErrorsThatTheyState) {
  Scenario scenario = RateTable();
  scenario.sensors[kGyro]->noise.density.setConstant(2e-4);
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  constexpr double kTableSigma = 1e-4;
  double chi2 = 0.0, dof = 0.0;
  for (int run = 0; run < 30; ++run) {
    scenario.seed = static_cast<std::uint64_t>(100 + run);
    PoseSelection selection = SelectionOf(scenario);
    for (StatedRate& rate : selection.rates) {
      for (double& value : rate.rate_radps) value += kTableSigma * normal(random);
      rate.covariance_radps2 = kTableSigma * kTableSigma * Eigen::Matrix3d::Identity();
    }
    CalibrateOptions options = OptionsFor(scenario);
    options.robust.enabled = false;
    const Calibration found = Calibrated(Collect(scenario, selection), options);
    const auto comparison = Compare(TruthOf(scenario, 0), found);
    ASSERT_TRUE(comparison) << comparison.error().message;
    EXPECT_EQ(comparison->dof, 12);
    chi2 += comparison->chi2;
    dof += comparison->dof;
  }
  RecordProperty("nees_per_dof", std::to_string(chi2 / dof));
  EXPECT_GT(ChiSquareCdf(chi2, dof), 0.0005) << chi2 / dof;
  EXPECT_LT(ChiSquareCdf(chi2, dof), 0.9995) << chi2 / dof;
}

TEST(KnownRates, AreLeftOutWhereOneIsWrong) {
  Scenario scenario = RateTable();
  scenario.sensors[kGyro]->noise.density.setConstant(2e-4);
  PoseSelection selection = SelectionOf(scenario);
  for (StatedRate& rate : selection.rates) {
    rate.covariance_radps2 = 1e-8 * Eigen::Matrix3d::Identity();
  }
  selection.rates[5].rate_radps *= 1.01;
  CalibrateOptions options = OptionsFor(scenario);
  options.triads[kGyro].excess = ExcessNoise::kEstimate;
  const Calibration found = Calibrated(Collect(scenario, selection), options);
  ASSERT_THAT(found.quality.rests.rejected_poses, SizeIs(1));
  const auto comparison = Compare(TruthOf(scenario, 0), found);
  ASSERT_TRUE(comparison);
  EXPECT_GT(comparison->p_value, 1e-3);
}

// A table about one axis shows one column of the matrix.
TEST(KnownRates, AboutOneAxisAreNotEnough) {
  Scenario scenario = RateTable();
  scenario.motion.resize(1);
  const auto summary = Calibrate(Collect(scenario, SelectionOf(scenario)), OptionsFor(scenario));
  ASSERT_TRUE(summary) << summary.error().message;
  EXPECT_FALSE(summary->calibration.IsUsable());
  EXPECT_THAT(summary->calibration.findings.back(), HasCode(FindingCode::kTurnAxesMissing));
}

// What is collected from the gyroscope's log of a rate table, with `change` made to each reading.
template <typename Change>
Result<PoseSet> CollectChanged(const Scenario& scenario, const Change& change) {
  const Samples samples = SamplesOf(scenario, kGyro);
  MemoryStream stream(kGyro);
  stream.info.unit = scenario.sensors[kGyro]->unit;
  for (std::size_t i = 0; i < samples.readings.size(); ++i) {
    stream.Add(samples.time_ns[i], change(i, samples.readings[i]));
  }
  PoseSelection selection = SelectionOf(scenario);
  for (StatedRate& rate : selection.rates) {
    rate.covariance_radps2 = 1e-10 * Eigen::Matrix3d::Identity();
  }
  MemorySource source({stream});
  return CollectPoses(source, selection);
}

Scenario NoisyTable() {
  Scenario scenario = RateTable();
  scenario.sensors[kGyro]->noise.density.setConstant(2e-4);
  return scenario;
}

std::string RefusalOfTable(const Result<PoseSet>& poses) {
  EXPECT_FALSE(poses);
  return poses ? "" : poses.error().message;
}

// Compares what is found from `poses` with the truth; a fault must be reported.
Result<Comparison> WithALeftOutTerm(const Scenario& scenario, const Result<PoseSet>& poses) {
  if (!poses) return poses.error();
  CalibrateOptions options = OptionsFor(scenario);
  options.triads[kGyro].excess = ExcessNoise::kEstimate;
  const Calibration found = Calibrated(*poses, options);
  EXPECT_NE(Find(found.findings, FindingCode::kFault), nullptr);
  return Compare(TruthOf(scenario, 0), found);
}

// A low-pass of 0.8 s: the readings wander so much within a stretch that its ends alone do not show
// it.
TEST(KnownRates, ThatHaveNotSettledAreRefused) {
  std::optional<Eigen::Vector3d> low;
  const auto poses =
      CollectChanged(NoisyTable(), [&low](std::size_t, const Eigen::Vector3d& reading) {
        low = low ? Eigen::Vector3d(*low + (reading - *low) * 0.01 / 0.8) : reading;
        return *low;
      });
  EXPECT_THAT(RefusalOfTable(poses), HasSubstr("begin"));
}

TEST(KnownRates, OfAStuckAxisAreRefused) {
  std::optional<double> stuck;
  const auto poses =
      CollectChanged(NoisyTable(), [&stuck](std::size_t i, const Eigen::Vector3d& reading) {
        if (i < 6000) return reading;
        if (!stuck) stuck = reading.x();
        return Eigen::Vector3d(*stuck, reading.y(), reading.z());
      });
  EXPECT_THAT(RefusalOfTable(poses), HasSubstr("x axis stuck at"));
}

// Spikes break most rests; the stretches at a rate tell of them as well.
TEST(KnownRates, TellOfReadingsThatAreOffToOneSide) {
  const Scenario scenario = NoisyTable();
  Random random(1);
  const auto poses =
      CollectChanged(scenario, [&random](std::size_t, const Eigen::Vector3d& reading) {
        const double spike = random.Uniform() < 0.03 ? 3000.0 : 0.0;
        return Eigen::Vector3d(reading + Eigen::Vector3d(spike, 0.0, 0.0));
      });
  const Result<Comparison> comparison = WithALeftOutTerm(scenario, poses);
  ASSERT_TRUE(comparison) << comparison.error().message;
  EXPECT_LT(comparison->largest_in_sigmas, 5.0);
}

// A step of the bias near the end of the run: the robust fit leaves out what comes after it but for
// two rates that nothing else checks.
TEST(KnownRates, AfterAStepOfTheBiasWidenSigma) {
  const Scenario scenario = NoisyTable();
  const std::size_t count = SamplesOf(scenario, kGyro).readings.size();
  const auto poses =
      CollectChanged(scenario, [count](std::size_t i, const Eigen::Vector3d& reading) {
        const double step = 10 * i > 9 * count ? 100.0 : 0.0;
        return Eigen::Vector3d(reading + Eigen::Vector3d(step, 0.7 * step, 0.3 * step));
      });
  const Result<Comparison> comparison = WithALeftOutTerm(scenario, poses);
  ASSERT_TRUE(comparison) << comparison.error().message;
  for (const ComparisonEntry& entry : comparison->entries) {
    // Of the bias, which is another after the step, only the mean is known.
    if (entry.parameter.find("bias") != std::string::npos) continue;
    EXPECT_LT(std::abs(entry.difference), 5.0 * entry.sigma) << entry.parameter;
  }
}

TEST(KnownRates, OfAPoseAreTakenFromTheRests) {
  const Scenario scenario = RateTable();
  PoseSelection selection = SelectionOf(scenario);
  // The rest that follows the first rate is pose 2; the rate's own rows become a pose before it.
  selection.ranges.insert(
      selection.ranges.begin() + 1,
      PoseRange{selection.rates[0].at.rows.first, selection.rates[0].at.rows.last, {}, {}});
  selection.rates[0].at.rows = {};
  selection.rates[0].at.pose = 2;
  const PoseSet poses = Collect(scenario, selection);
  EXPECT_THAT(poses.poses, SizeIs(13));
  EXPECT_EQ(poses.poses[1].number, 3);
  EXPECT_TRUE(poses.moves[0].fault);
  CalibrateOptions options = OptionsFor(scenario);
  options.triads[kGyro].noise_sigma_raw = Eigen::Vector3d::Constant(1.0);
  ExpectTruth(scenario, Calibrated(poses, options), 1e-9, 1e-5);
}

// The same rows, by the times of the first and the last.
TEST(KnownMotions, ByTimeAreThoseByRows) {
  for (const bool by_hand : {false, true}) {
    const Scenario scenario = by_hand ? HandTurns() : RateTable();
    PoseSelection selection = SelectionOf(scenario);
    const PoseSet by_rows = Collect(scenario, selection);
    const Samples samples = SamplesOf(scenario, kGyro);
    const auto give_time = [&samples](MotionPlace* at) {
      at->times = {samples.time_ns[static_cast<std::size_t>(at->rows.first)],
                   samples.time_ns[static_cast<std::size_t>(at->rows.last)]};
      at->rows = {};
    };
    for (StatedTurn& turn : selection.turns) give_time(&turn.at);
    for (StatedRate& rate : selection.rates) give_time(&rate.at);
    const PoseSet by_time = Collect(scenario, selection);
    ASSERT_THAT(by_time.rates, SizeIs(by_rows.rates.size()));
    for (std::size_t i = 0; i < by_rows.rates.size(); ++i) {
      const StaticPose& expected = by_rows.rates[i].means;
      EXPECT_EQ(by_time.rates[i].means.first_row, expected.first_row);
      EXPECT_EQ(by_time.rates[i].means.last_row, expected.last_row);
      EXPECT_EQ(by_time.rates[i].means.triads[kGyro]->mean_raw, expected.triads[kGyro]->mean_raw);
    }
    ASSERT_THAT(by_time.turns, SizeIs(by_rows.turns.size()));
    for (std::size_t i = 0; i < by_rows.turns.size(); ++i) {
      EXPECT_EQ(by_time.turns[i].move.time_ns, by_rows.turns[i].move.time_ns);
      EXPECT_EQ(by_time.turns[i].move.gyroscope_raw, by_rows.turns[i].move.gyroscope_raw);
    }
  }
}

TEST(KnownMotions, BeyondTheLogAreRefusedWithWhereTheyAreStated) {
  constexpr std::int64_t kFar = 1'000'000'000;
  const auto refusal = [](const Scenario& scenario, const PoseSelection& selection) {
    const auto poses = CollectPoses(*Simulate(scenario), selection);
    EXPECT_FALSE(poses);
    return poses ? "" : poses.error().message;
  };
  const Scenario table = RateTable();
  PoseSelection rates = SelectionOf(table);
  rates.rates.back().at.stated_in = "rates.yaml:7";
  rates.rates.back().at.rows = {kFar, kFar + 9};
  EXPECT_THAT(refusal(table, rates),
              HasSubstr("rates.yaml:7 (rows 1000000000 to 1000000009) has no reading"));
  rates.rates.back().at.rows = {};
  rates.rates.back().at.times = {kFar, kFar + 9};
  EXPECT_THAT(refusal(table, rates),
              HasSubstr("rates.yaml:7: is stated by time, but another rate is stated by rows"));

  const Scenario hand = HandTurns();
  PoseSelection turns = SelectionOf(hand);
  turns.turns.back().at.stated_in = "turns.yaml:4";
  turns.turns.back().at.rows.last = kFar;
  EXPECT_THAT(refusal(hand, turns), HasSubstr("turns.yaml:4: a turn is stated for rows"));
  turns.turns.back().at.rows = {};
  turns.turns.back().at.times = {0, kFar * kFar};
  EXPECT_THAT(refusal(hand, turns), HasSubstr("turns.yaml:4: a turn is stated for 0.0"));
  turns.turns.back().at.times = {};
  turns.turns.back().at.pose = 99;
  EXPECT_THAT(refusal(hand, turns), HasSubstr("turns.yaml:4: "));
}

TEST(KnownRates, OfATableAreItsRows) {
  const Scenario scenario = RateTable();
  PoseSet table;
  StreamSummary stream;
  stream.triad = kGyro;
  stream.unit = scenario.sensors[kGyro]->unit;
  table.streams.push_back(stream);
  const TriadModel<double> truth = TruthOf(scenario, 0).sensors[kGyro]->model;
  std::vector<StatedRate> rates;
  for (int row = 0; row < 7; ++row) {
    StaticPose& pose = table.poses.emplace_back();
    pose.number = row + 1;
    Eigen::Vector3d rate = Eigen::Vector3d::Zero();
    if (row > 0) rate[(row - 1) / 2] = row % 2 == 0 ? 2.0 : -2.0;
    pose.triads[kGyro].emplace().mean_raw = truth.RawFromTruth(rate);
    if (row == 0) continue;
    rates.emplace_back().at.pose = pose.number;
    rates.back().rate_radps = rate;
  }
  ASSERT_TRUE(TakeRates(rates, &table));
  EXPECT_THAT(table.poses, SizeIs(1));
  EXPECT_THAT(table.rates, SizeIs(6));
  CalibrateOptions options = OptionsFor(scenario);
  options.triads[kGyro].noise_sigma_raw = Eigen::Vector3d::Constant(1.0);
  ExpectTruth(scenario, Calibrated(table, options), 1e-12, 1e-9);

  rates.front().at.pose = 99;
  EXPECT_THAT(TakeRates(rates, &table).error().message, HasSubstr("pose 99"));
  rates.front().at.rows = {0, 9};
  EXPECT_THAT(TakeRates(rates, &table).error().message, HasSubstr("`pose: N`"));
}

TEST(KnownTurns, GiveAGyroscopeAloneExactlyWithoutNoise) {
  const Scenario scenario = HandTurns();
  const PoseSet poses = Collect(scenario, SelectionOf(scenario));
  ASSERT_THAT(poses.turns, SizeIs(6));
  for (const KnownTurn& turn : poses.turns) EXPECT_FALSE(turn.move.fault);
  CalibrateOptions options = OptionsFor(scenario);
  options.triads[kGyro].noise_sigma_raw = Eigen::Vector3d::Constant(1.0);
  const Calibration found = Calibrated(poses, options);
  // The trapezoid's error of a minimum-jerk turn falls with the sixth power of its steps.
  ExpectTruth(scenario, found, 1e-7, 1e-3);
  ASSERT_THAT(found.quality.rests.turns, SizeIs(6));
  EXPECT_NEAR(found.quality.rests.turns[1].found_rad, -2.0 * kTwoPi, 1e-6);
}

// A turn ends where it began whatever its axis: the σ of the axis is all that limits the
// misalignments, and that of the turn the gains.
TEST(KnownTurns, AreWorthWhatTheOperatorKnows) {
  const Scenario scenario = HandTurns();
  PoseSelection selection = SelectionOf(scenario);
  selection.turns.erase(selection.turns.begin() + 1, selection.turns.end());
  for (int axis = 1; axis < 3; ++axis) {
    selection.turns.push_back(SelectionOf(scenario).turns[static_cast<std::size_t>(2 * axis)]);
  }
  CalibrateOptions options = OptionsFor(scenario);
  options.triads[kGyro].noise_sigma_raw = Eigen::Vector3d::Constant(1e-3);
  const Calibration found = Calibrated(Collect(scenario, selection), options);
  const Eigen::Matrix3d share =
      (found.sensors[kGyro]->sensitivity_sigma.array().colwise() /
       TruthOf(scenario, 0).sensors[kGyro]->model.sensitivity.rowwise().norm().array())
          .matrix();
  // Sensing axis x reads body y: its gain by the turn about y, 0.01 rad in 2 pi; what it reads of a
  // turn about x by how much of y there was in the axis, 0.02.
  EXPECT_NEAR(share(0, 1), 0.01 / kTwoPi, 0.1 * 0.01 / kTwoPi);
  EXPECT_NEAR(share(0, 0), 0.02, 0.002);
  EXPECT_NEAR(share(1, 1), 0.02, 0.002);
}

// Rows that begin or end within a turn leave out a part of its angle, always of one sign.
TEST(KnownTurns, ThatTheirRowsCutAreLeftOut) {
  const Scenario scenario = HandTurns();
  const PoseSelection whole = SelectionOf(scenario);
  CalibrateOptions options = OptionsFor(scenario);
  options.triads[kGyro].noise_sigma_raw = Eigen::Vector3d::Constant(1.0);
  for (const double cut_begin : {0.0, 0.25}) {
    for (const double cut_end : {0.0, 0.25}) {
      PoseSelection selection = whole;
      for (StatedTurn& turn : selection.turns) {
        const auto rows = static_cast<double>(turn.at.rows.last - turn.at.rows.first);
        turn.at.rows.first += std::lround(cut_begin * rows);
        turn.at.rows.last -= std::lround(cut_end * rows);
      }
      const PoseSet poses = Collect(scenario, selection);
      const bool is_cut = cut_begin + cut_end > 0.0;
      for (const KnownTurn& turn : poses.turns) EXPECT_EQ(turn.move.fault.has_value(), is_cut);
      EXPECT_EQ(Find(poses.findings, FindingCode::kTurnCut) != nullptr, is_cut);
      if (!is_cut) continue;
      const auto refused = Calibrate(poses, options);
      ASSERT_TRUE(refused);
      EXPECT_FALSE(refused->calibration.IsUsable());
      EXPECT_THAT(refused->calibration.findings.back().Message(),
                  HasSubstr("while the unit still turns"));
    }
  }
  // The other turns are used without the one whose rows are cut.
  PoseSelection selection = whole;
  selection.turns[1].at.rows.last -=
      (selection.turns[1].at.rows.last - selection.turns[1].at.rows.first) / 4;
  const PoseSet poses = Collect(scenario, selection);
  EXPECT_TRUE(poses.turns[1].move.fault);
  ExpectTruth(scenario, Calibrated(poses, options), 1e-7, 1e-3);
}

TEST(KnownTurns, ThatAreHeldOutArePredicted) {
  Scenario scenario = RateTable();
  scenario.sensors[kGyro]->noise.density.setConstant(2e-4);
  TurnStep step;
  step.axis_in_body = Eigen::Vector3d(1.0, 2.0, -1.0);
  step.turns = 3.0;
  scenario.motion.emplace_back(step);
  PoseSelection selection = SelectionOf(scenario);
  for (StatedTurn& turn : selection.turns) turn.held_out = true;
  const Calibration found = Calibrated(Collect(scenario, selection), OptionsFor(scenario));
  ASSERT_THAT(found.quality.rests.turns, SizeIs(1));
  const TurnCheck& turn = found.quality.rests.turns.front();
  EXPECT_FALSE(turn.used);
  EXPECT_NEAR(turn.found_rad, 3.0 * kTwoPi, 4.0 * turn.found_sigma_rad);
  EXPECT_LT(turn.found_sigma_rad, 1e-3);
}

// With the accelerometer the moves between the rests already tell how far a turn went.
TEST(KnownTurns, OfAWrongSignAreRefused) {
  Scenario scenario = QuietScenario();
  scenario.sensors[kMag].reset();
  scenario.motion.emplace_back(TurnStep{});
  PoseSelection selection = SelectionOf(scenario);
  selection.turns[0].angle_rad *= -1.0;
  CalibrateOptions options = OptionsFor(scenario);
  for (TriadOptions& triad : options.triads) {
    triad.noise_sigma_raw = Eigen::Vector3d::Constant(1e-4);
  }
  const auto refused = Calibrate(Collect(scenario, selection), options);
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("-360 deg"));
  EXPECT_THAT(refused.error().message, HasSubstr("measures 360 deg"));
  selection.turns[0].angle_rad *= -1.0;
  ExpectTruth(scenario, Calibrated(Collect(scenario, selection), options), 1e-6, 1e-6);
}

TEST(KnownRates, JacobianOfTheRowsMatchesFiniteDifferences) {
  SharedLayout layout;
  layout.bias[kGyro] = 0;
  layout.sensitivity[kGyro] = 3;
  layout.g_sensitivity = 12;
  layout.reference = 21;
  layout.size = 21 + kReferenceSize;
  Eigen::VectorXd shared = Eigen::VectorXd::LinSpaced(layout.size, 0.5, 2.0);
  PoseNode node;
  node.role = PoseRole::kRate;
  node.kind = PoseKind::kHeld;
  node.known_rate_radps << 0.3, -2.0, 1.1;
  node.known_force_mps2 << 1.0, 9.0, -3.0;
  node.observations.emplace_back();
  node.observations.front().triad = kGyro;
  node.observations.front().mean_raw << 4.0, 5.0, 6.0;
  PoseResidual12 residual;
  PoseSharedJacobian jacobian;
  node.Evaluate(layout, shared.data(), node.state.data(), &residual, &jacobian, nullptr);
  for (int i = 0; i < layout.size; ++i) {
    // The rows are linear: any step does, up to rounding.
    Eigen::VectorXd moved = shared;
    moved[i] += 1.0;
    PoseResidual12 after;
    node.Evaluate(layout, moved.data(), node.state.data(), &after, nullptr, nullptr);
    EXPECT_LT((after - residual - jacobian.col(i)).norm(), 1e-12) << i;
  }
}

}  // namespace known_motions_test
}  // namespace truetriad
