// SPDX-License-Identifier: Apache-2.0
//
// A unit that is tumbled without rests: a chain of attitudes, one arrow-shaped system.

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "math/distributions.h"
#include "motion/motion_graph.h"
#include "motion/motion_start.h"
#include "problem/graph_builder.h"
#include "problem/start_values.h"
#include "solve/chain_elimination.h"
#include "solve/solve_graph.h"
#include "support/finding_matchers.h"
#include "support/six_turns.h"
#include "truetriad/model/calibration.h"

namespace truetriad {
namespace motion_test {

using ::testing::HasSubstr;
using trials::DrawSixTurns;
using trials::RecordSixTurns;
using trials::SixTurns;
using trials::SixTurnsOptions;

constexpr Triad kAccel = Triad::kAccelerometer;
constexpr Triad kGyro = Triad::kGyroscope;
constexpr Triad kMag = Triad::kMagnetometer;

Eigen::Vector3d NoPush(double /*time_s*/) { return Eigen::Vector3d::Zero(); }

// A shorter recording of the same kind: as many turns in less time.
SixTurns ShortUnit(Random* random) {
  SixTurns unit = DrawSixTurns(random);
  unit.samples = 2400;
  return unit;
}

class MotionWith : public ::testing::TestWithParam<std::pair<bool, double>> {
 protected:
  bool held() const { return GetParam().first; }
  double spacing_s() const { return GetParam().second; }
};

// What is left is how well turns are followed between readings: the trapezoid's error of a rate
// that swings by 1.6 rad/s with the period of a turn, 5 s, is dt^2 w'' / 12 = 3e-5 rad/s at its
// largest, and changes sign within a turn: it adds up to 2.4e-5 rad, and of gravity to 2.4e-4
// m/s^2.
TEST_P(MotionWith, IsFollowedExactlyWithoutNoise) {
  Random random(5);
  const SixTurns unit = ShortUnit(&random);
  const PoseSet recording = RecordSixTurns(unit, 0.0, NoPush, &random);
  const auto summary = Calibrate(recording, SixTurnsOptions(unit, held(), spacing_s()));
  ASSERT_TRUE(summary) << summary.error().message;
  const Calibration& found = summary->calibration;
  ASSERT_TRUE(found.IsUsable()) << found.findings.back().Message();
  EXPECT_LT((found.sensors[kAccel]->model.bias - unit.accelerometer.bias).norm(), 2.4e-4);
  EXPECT_LT((found.sensors[kGyro]->model.bias - unit.gyroscope.bias).norm(), 3e-5);
  EXPECT_LT((found.sensors[kMag]->model.bias - unit.magnetometer.bias).norm(), 1e-4 * 27.0);
  EXPECT_LT((found.sensors[kMag]->model.sensitivity - unit.magnetometer.sensitivity).norm(),
            2e-4 * 27.0);
}

// χ² of all errors with their printed covariance, summed over runs: inside its 99.9 % interval.
TEST_P(MotionWith, HasTheErrorsThatItStates) {
  double chi2 = 0.0;
  double dof = 0.0;
  for (int run = 0; run < 30; ++run) {
    Random random(static_cast<std::uint64_t>(100 + run));
    const SixTurns unit = ShortUnit(&random);
    const auto summary = Calibrate(RecordSixTurns(unit, 1.0, NoPush, &random),
                                   SixTurnsOptions(unit, held(), spacing_s()));
    ASSERT_TRUE(summary) << summary.error().message;
    ASSERT_TRUE(summary->calibration.IsUsable()) << summary->calibration.findings.back().Message();
    const trials::JointError error = trials::JointErrorOf(
        trials::SixTurnsErrors(unit, summary->calibration), summary->calibration.covariance.matrix);
    chi2 += error.chi2;
    dof += error.dof;
  }
  EXPECT_GT(ChiSquareCdf(chi2, dof), 0.0005) << chi2 / dof;
  EXPECT_LT(ChiSquareCdf(chi2, dof), 0.9995) << chi2 / dof;
}

INSTANTIATE_TEST_SUITE_P(EachSpacing,
                         MotionWith,
                         ::testing::Values(std::pair(true, 0.0),
                                           std::pair(true, 0.1),
                                           std::pair(false, 0.0),
                                           std::pair(false, 0.1)));

// Without the accelerometer the magnetometer leads the body frame, and turns are followed against
// the field: the unit as it is in that frame.
SixTurns InMagnetometersFrame(SixTurns unit) {
  const Eigen::Matrix3d Q = GaugeRotation(Gauge::kAccelX, unit.magnetometer.sensitivity);
  unit.magnetometer.sensitivity *= Q;
  unit.gyroscope.sensitivity *= Q;
  return unit;
}

CalibrateOptions FieldOptions(const SixTurns& unit, double spacing_s) {
  CalibrateOptions options = SixTurnsOptions(unit, false, spacing_s);
  options.triads[kAccel].enabled = false;
  return options;
}

// As IsFollowedExactlyWithoutNoise: 2.4e-5 rad of the field's direction. Of each axis of the rate
// no more than what the trapezoid is off by at its largest: 1.6 rad/s (2 pi / 5 s)^2 / 12 (80
// Hz)^2.
TEST(MotionAgainstTheField, IsFollowedExactlyWithoutNoise) {
  Random random(5);
  const SixTurns unit = ShortUnit(&random);
  const PoseSet recording = RecordSixTurns(unit, 0.0, NoPush, &random);
  const auto summary = Calibrate(recording, FieldOptions(unit, 0.1));
  ASSERT_TRUE(summary) << summary.error().message;
  const Calibration& found = summary->calibration;
  ASSERT_TRUE(found.IsUsable()) << found.findings.back().Message();
  const SixTurns truth = InMagnetometersFrame(unit);
  EXPECT_EQ(found.gauge_sensor, kMag);
  const Eigen::Vector3d off = found.sensors[kGyro]->model.bias - truth.gyroscope.bias;
  EXPECT_LT(off.cwiseAbs().maxCoeff(), 3.3e-5);
  EXPECT_LT((found.sensors[kMag]->model.bias - truth.magnetometer.bias).norm(), 1e-4 * 27.0);
  EXPECT_LT((found.sensors[kMag]->model.sensitivity - truth.magnetometer.sensitivity).norm(),
            2e-4 * 27.0);
  EXPECT_LT((found.sensors[kGyro]->model.sensitivity - truth.gyroscope.sensitivity).norm(), 2e-4);
}

// Readings gathered at an attitude every 0.1 s say what they say each by itself: without noise what
// differs is of third order in how far the unit turns in half of that, a tenth of a radian.
TEST(MotionAgainstTheField, IsNoOtherWhereReadingsAreGathered) {
  Random random(5);
  const SixTurns unit = ShortUnit(&random);
  const PoseSet recording = RecordSixTurns(unit, 0.0, NoPush, &random);
  const auto single = Calibrate(recording, FieldOptions(unit, 0.0));
  const auto gathered = Calibrate(recording, FieldOptions(unit, 0.1));
  ASSERT_TRUE(single && single->calibration.IsUsable());
  ASSERT_TRUE(gathered && gathered->calibration.IsUsable());
  const SixTurns truth = InMagnetometersFrame(unit);
  const auto off_of = [&](const CalibrationSummary& summary) -> Eigen::Vector3d {
    return summary.calibration.sensors[kGyro]->model.bias - truth.gyroscope.bias;
  };
  const Eigen::Vector3d off = off_of(*single);
  EXPECT_LT((off_of(*gathered) - off).norm(), 1e-2 * off.norm());
}

TEST(MotionAgainstTheField, HasTheErrorsThatItStates) {
  double chi2 = 0.0, dof = 0.0;
  for (int run = 0; run < 30; ++run) {
    Random random(static_cast<std::uint64_t>(200 + run));
    const SixTurns unit = ShortUnit(&random);
    const auto summary =
        Calibrate(RecordSixTurns(unit, 1.0, NoPush, &random), FieldOptions(unit, 0.1));
    ASSERT_TRUE(summary) << summary.error().message;
    ASSERT_TRUE(summary->calibration.IsUsable()) << summary->calibration.findings.back().Message();
    const SixTurns truth = InMagnetometersFrame(unit);
    Eigen::VectorXd error(24);
    Eigen::Index at = 0;
    for (const auto& [triad, model] :
         {std::pair(kGyro, truth.gyroscope), std::pair(kMag, truth.magnetometer)}) {
      const TriadModel<double>& found = summary->calibration.sensors[triad]->model;
      error.segment<3>(at) = found.bias - model.bias;
      const Eigen::Matrix3d by_rows = (found.sensitivity - model.sensitivity).transpose();
      error.segment<9>(at + 3) = by_rows.reshaped();
      at += 12;
    }
    const trials::JointError joint =
        trials::JointErrorOf(error, summary->calibration.covariance.matrix);
    chi2 += joint.chi2;
    dof += joint.dof;
  }
  EXPECT_GT(ChiSquareCdf(chi2, dof), 0.0005) << chi2 / dof;
  EXPECT_LT(ChiSquareCdf(chi2, dof), 0.9995) << chi2 / dof;
}

// A chain of a noisy recording, started at the truth.
struct Tumble {
  PoseSet recording;
  CalibrateOptions options;
  std::optional<MotionTrack> track;
  PoseGraph graph;

  Tumble() {
    Random random(9);
    const SixTurns unit = ShortUnit(&random);
    recording = RecordSixTurns(unit, 1.0, NoPush, &random);
    options = SixTurnsOptions(unit, false, 0.1);
    track = *MotionTrack::Of(recording, PerTriad<bool>{{true, true, true}});
    StartValues start;
    start.reference.head<3>() << kStandardGravityMps2, 1.0, unit.dip_rad;
    start.models[kAccel] = unit.accelerometer;
    start.models[kGyro] = unit.gyroscope;
    start.models[kMag] = unit.magnetometer;
    LayOutParameters(options, start, &graph);
    const GyroModel gyroscope{unit.gyroscope};
    const std::vector<Moment> moments = track->Gather(0.1, &gyroscope);
    MotionNoise noise;
    for (const Triad triad : kTriads) {
      noise.density[triad] = options.triads[triad].noise_sigma_raw->cwiseAbs2() / unit.rate_hz;
    }
    BuildMoments(*track, moments, StartAttitudes(start, *track, moments), &graph);
    WeighMoments(noise, *track, moments, &graph);
  }
};

// The gradient of the cost with the attitudes at their best for each value of the parameters, by
// central differences over a hundredth of σ.
TEST(MotionGraph, GradientIsThatOfTheCostWithoutAttitudes) {
  const Tumble tumble;
  // Linearised nine times at one place, the attitudes following.
  ChainElimination elimination(ChainOf(tumble.graph));
  const auto settle = [&](const Eigen::VectorXd& shared) {
    for (int round = 0; round < 9; ++round) elimination.Linearise(shared);
    return elimination.cost();
  };
  const double cost = settle(tumble.graph.shared);
  EXPECT_NEAR(elimination.CostAt(tumble.graph.shared), cost, 1e-9 * cost);
  const Eigen::VectorXd gradient = elimination.gradient();
  const Eigen::MatrixXd information = elimination.information();
  for (int j = 0; j < tumble.graph.layout.free_size(); ++j) {
    const double step = 1e-2 / std::sqrt(information(j, j));
    const Eigen::VectorXd direction = tumble.graph.layout.basis.col(j);
    const double above = settle(tumble.graph.shared + step * direction);
    const double below = settle(tumble.graph.shared - step * direction);
    const double expected = gradient[j] / std::sqrt(information(j, j));
    EXPECT_NEAR((above - below) / 2e-2, expected, 1e-5 * (1.0 + std::abs(expected))) << j;
    // Second differences show the information, but for what the residuals bend.
    EXPECT_NEAR((above - 2.0 * cost + below) / 1e-4, 1.0, 0.1) << j;
  }
}

// The same rows, the attitudes eliminated or not: cost and parameters, and what is known of them.
TEST(MotionGraph, EndsWhereCeresEndsRowByRow) {
  Tumble tumble;
  PoseGraph by_ceres = tumble.graph;
  tumble.graph.solver = Solver::kEliminated;
  by_ceres.solver = Solver::kCeres;
  // A share t of the cost C, left, is sqrt(2 t C) of a sigma: C is 1e4.
  constexpr double kTolerance = 1e-18;
  const SolveOutcome eliminated = SolveGraph(&tumble.graph, kTolerance);
  const SolveOutcome whole = SolveGraph(&by_ceres, kTolerance);
  EXPECT_TRUE(eliminated.converged);
  EXPECT_TRUE(whole.converged);
  EXPECT_NEAR(whole.final_cost, eliminated.final_cost, 1e-9 * eliminated.final_cost);
  const ChainElimination solved = Linearised(tumble.graph);
  const Eigen::VectorXd off =
      tumble.graph.layout.basis.transpose() * (by_ceres.shared - tumble.graph.shared);
  EXPECT_LT(std::sqrt(off.dot(solved.information() * off)), 1e-6);
}

class MotionByHand : public ::testing::TestWithParam<double> {};

// A hand pushes: accelerations in m/s^2 that hang together for a second, noise of one reading being
// 0.18. The noise found allows for them, and the errors are inside what is stated: χ² of 15 runs,
// an approximation (the pushes are no noise), within twice its expectation.
TEST_P(MotionByHand, IsNotMisledByTheAccelerationsOfTheHand) {
  double chi2 = 0.0;
  double dof = 0.0;
  for (int run = 0; run < 15; ++run) {
    Random random(static_cast<std::uint64_t>(300 + run));
    const SixTurns unit = ShortUnit(&random);
    const Eigen::Vector3d phase = trials::UniformVector(3.0, &random);
    const auto push = [&phase](double time_s) -> Eigen::Vector3d {
      return GetParam() * Eigen::Vector3d(std::sin(4.1 * time_s + phase[0]),
                                          std::sin(7.3 * time_s + phase[1]),
                                          std::sin(5.9 * time_s + phase[2]));
    };
    CalibrateOptions options = SixTurnsOptions(unit, true, 0.1);
    for (TriadOptions& triad : options.triads) {
      triad.noise_sigma_raw.reset();
      triad.excess = ExcessNoise::kEstimate;
    }
    options.robust.enabled = true;
    const auto summary = Calibrate(RecordSixTurns(unit, 1.0, push, &random), options);
    ASSERT_TRUE(summary) << summary.error().message;
    ASSERT_TRUE(summary->calibration.IsUsable()) << summary->calibration.findings.back().Message();
    const trials::JointError error = trials::JointErrorOf(
        trials::SixTurnsErrors(unit, summary->calibration), summary->calibration.covariance.matrix);
    chi2 += error.chi2;
    dof += error.dof;
  }
  EXPECT_LT(chi2 / dof, 2.0);
  EXPECT_GT(chi2 / dof, 0.3);
}

INSTANTIATE_TEST_SUITE_P(GentlyAndNot, MotionByHand, ::testing::Values(0.4, 1.5, 4.0));

void ExpectWithinFourSigmas(const SixTurns& unit, const Calibration& found) {
  const Eigen::VectorXd error = trials::SixTurnsErrors(unit, found);
  for (Eigen::Index i = 0; i < error.size(); ++i) {
    EXPECT_LE(std::abs(error[i]), 4.0 * std::sqrt(found.covariance.matrix(i, i)) + 1e-12) << i;
  }
}

TEST(Motion, BreaksTheChainWhereTheGyroscopeHasNoReadingsAndStillFindsTheUnit) {
  Random random(11);
  const SixTurns unit = ShortUnit(&random);
  PoseSet recording = RecordSixTurns(unit, 1.0, NoPush, &random);
  ReadingTrack& rates = recording.tracks[kGyro];
  rates.reading_raw.erase(rates.reading_raw.begin() + 900, rates.reading_raw.begin() + 1000);
  rates.time_ns.erase(rates.time_ns.begin() + 900, rates.time_ns.begin() + 1000);
  const auto summary = Calibrate(recording, SixTurnsOptions(unit, true, 0.1));
  ASSERT_TRUE(summary) << summary.error().message;
  const Calibration& found = summary->calibration;
  ASSERT_TRUE(found.IsUsable()) << found.findings.back().Message();
  EXPECT_THAT(found.findings, ::testing::Contains(HasCode(FindingCode::kGyroscopeGaps)));
  ExpectWithinFourSigmas(unit, found);
}

// Turns between the nodes then miss along their axes; with so much noise no single step tells.
TEST(Motion, IsNotMisledByRowsThatWereLostFromRegularTimes) {
  for (const double lost : {0.02, 0.06}) {
    SCOPED_TRACE(lost);
    Random random(21);
    const SixTurns unit = ShortUnit(&random);
    PoseSet recording = RecordSixTurns(unit, 1.0, NoPush, &random);
    std::vector<bool> is_lost;
    for (int i = 0; i < unit.samples; ++i) is_lost.push_back(random.Uniform() < lost);
    for (const Triad triad : kTriads) {
      ReadingTrack& track = recording.tracks[triad];
      std::vector<Eigen::Vector3d> kept;
      for (std::size_t i = 0; i < track.reading_raw.size(); ++i) {
        if (!is_lost[i]) kept.push_back(track.reading_raw[i]);
      }
      track.time_ns.resize(kept.size());
      track.reading_raw = std::move(kept);
    }
    CalibrateOptions options = SixTurnsOptions(unit, true, 0.1);
    for (TriadOptions& triad : options.triads) {
      triad.noise_sigma_raw.reset();
      triad.excess = ExcessNoise::kEstimate;
    }
    const auto summary = Calibrate(recording, options);
    ASSERT_TRUE(summary) << summary.error().message;
    ASSERT_TRUE(summary->calibration.IsUsable()) << summary->calibration.findings.back().Message();
    EXPECT_THAT(summary->calibration.findings, ::testing::Contains(HasCode(FindingCode::kFault)));
    ExpectWithinFourSigmas(unit, summary->calibration);
  }
}

TEST(Motion, FindsTheUnitFromPiecesInAnotherOrder) {
  Random random(15);
  const SixTurns unit = ShortUnit(&random);
  PoseSet recording = RecordSixTurns(unit, 1.0, NoPush, &random);
  // The end first, at times that go on without a gap.
  constexpr std::ptrdiff_t kCut = 1330;
  for (const Triad triad : kTriads) {
    std::vector<Eigen::Vector3d>& readings = recording.tracks[triad].reading_raw;
    std::rotate(readings.begin(), readings.begin() + kCut, readings.end());
  }
  recording.joints.push_back(
      {recording.tracks[kGyro].time_ns[static_cast<std::size_t>(unit.samples - kCut)],
       0,
       "",
       true});
  const auto summary = Calibrate(recording, SixTurnsOptions(unit, false, 0.1));
  ASSERT_TRUE(summary) << summary.error().message;
  ASSERT_TRUE(summary->calibration.IsUsable()) << summary->calibration.findings.back().Message();
  // A joint is no lack of readings.
  EXPECT_EQ(Find(summary->calibration.findings, FindingCode::kGyroscopeGaps), nullptr);
  ExpectWithinFourSigmas(unit, summary->calibration);
}

// The attitude in a piece that no vector sensor saw, or the heading where only gravity was seen, is
// nobody's.
TEST(Motion, FindsTheUnitDespitePiecesWithoutReadings) {
  Random random(15);
  const SixTurns unit = ShortUnit(&random);
  const PoseSet recording = RecordSixTurns(unit, 1.0, NoPush, &random);
  for (const bool sees_gravity : {false, true}) {
    PoseSet gappy = recording;
    const std::vector<std::int64_t> times_ns = gappy.tracks[kGyro].time_ns;
    for (const Triad triad : {kAccel, kMag}) {
      if (sees_gravity && triad == kAccel) continue;
      ReadingTrack& track = gappy.tracks[triad];
      track.time_ns.erase(track.time_ns.begin() + 1000, track.time_ns.begin() + 1040);
      track.reading_raw.erase(track.reading_raw.begin() + 1000, track.reading_raw.begin() + 1040);
    }
    gappy.joints = {{times_ns[1000], 1000, "", true}, {times_ns[1040], 1040, "", true}};
    const auto summary = Calibrate(gappy, SixTurnsOptions(unit, false, 0.1));
    ASSERT_TRUE(summary) << summary.error().message;
    ASSERT_TRUE(summary->calibration.IsUsable()) << summary->calibration.findings.back().Message();
    ExpectWithinFourSigmas(unit, summary->calibration);
  }
}

TEST(Motion, NeedsTimesThatDiffer) {
  Random random(12);
  const SixTurns unit = ShortUnit(&random);
  const PoseSet recording = RecordSixTurns(unit, 1.0, NoPush, &random);
  for (const Triad triad : {kGyro, kAccel}) {
    PoseSet frozen = recording;
    auto& times = frozen.tracks[triad].time_ns;
    std::fill(times.begin(), times.end(), times.front());
    const auto summary = Calibrate(frozen, SixTurnsOptions(unit, true, 0.1));
    ASSERT_FALSE(summary);
    EXPECT_THAT(summary.error().message, HasSubstr("no two readings at different times"));
  }
}

TEST(Motion, TakesASpacingBeyondTheRecordingForTwoAttitudes) {
  Random random(12);
  const SixTurns unit = ShortUnit(&random);
  const PoseSet recording = RecordSixTurns(unit, 1.0, NoPush, &random);
  const auto summary = Calibrate(recording, SixTurnsOptions(unit, true, 1e300));
  ASSERT_TRUE(summary) << summary.error().message;
  EXPECT_FALSE(summary->calibration.IsUsable());
}

TEST(Motion, SaysWhichSensorIsMirrored) {
  Random random(14);
  const SixTurns unit = ShortUnit(&random);
  const PoseSet recording = RecordSixTurns(unit, 1.0, NoPush, &random);
  for (const Triad triad : {kMag, kGyro}) {
    PoseSet mirrored = recording;
    for (Eigen::Vector3d& reading : mirrored.tracks[triad].reading_raw) reading.x() *= -1.0;
    const auto summary = Calibrate(mirrored, SixTurnsOptions(unit, triad == kMag, 0.1));
    ASSERT_TRUE(summary) << summary.error().message;
    EXPECT_THAT(
        summary->calibration.findings,
        ::testing::Contains(::testing::AllOf(HasCode(FindingCode::kLeftHanded), IsAbout(triad))));
  }
}

TEST(Motion, SaysWhatOneAxisOfTurningLeavesOpen) {
  Random random(13);
  const SixTurns unit = ShortUnit(&random);
  PoseSet recording = RecordSixTurns(unit, 1.0, NoPush, &random);
  for (ReadingTrack& track : recording.tracks) {  // the first turn alone
    track.time_ns.resize(400);
    track.reading_raw.resize(400);
  }
  const auto summary = Calibrate(recording, SixTurnsOptions(unit, false, 0.1));
  ASSERT_TRUE(summary) << summary.error().message;
  EXPECT_FALSE(summary->calibration.IsUsable());
  EXPECT_EQ(summary->calibration.outcome, Outcome::kNotObservable);
}

}  // namespace motion_test
}  // namespace truetriad
