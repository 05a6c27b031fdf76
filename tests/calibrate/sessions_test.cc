// SPDX-License-Identifier: Apache-2.0
//
// Several recordings of one unit: what belongs to the unit is shared, the bias of a sensor that
// switching on changes is each session's own.

#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "math/distributions.h"
#include "support/accel_mag_trials.h"
#include "support/finding_matchers.h"
#include "support/synthetic_poses.h"
#include "truetriad/calibrate/calibrate.h"
#include "truetriad/data/pose_collection.h"
#include "truetriad/verdict/summary.h"

namespace truetriad {
namespace sessions_test {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::SizeIs;

constexpr Triad kAccel = Triad::kAccelerometer;
constexpr Triad kGyro = Triad::kGyroscope;
constexpr Triad kMag = Triad::kMagnetometer;
constexpr int kSessionPoses = 12;

// What switching on changes: of consumer parts, true units.
constexpr double kAccelTurnOnMps2 = 0.02;
constexpr double kGyroTurnOnRadps = 0.01;

SyntheticUnit DrawNineAxes(Random* random) {
  SyntheticUnit unit = trials::RandomUnit({}, random);
  TriadModel<double>& gyroscope = unit.models[kGyro].emplace();
  gyroscope.sensitivity = Eigen::Matrix3d::Identity() +
                          0.02 * Eigen::Matrix3d::NullaryExpr([&] { return random->Normal(); });
  gyroscope.bias = 0.05 * random->Normal3();
  unit.units[kGyro] = {"rad/s", 1.0, false};
  return unit;
}

// Sessions of a unit, and the truth that a calibration of all of them is about.
struct Recorded {
  std::vector<PoseSet> sessions;
  SyntheticUnit mean;  // with the mean of the sessions' biases
};

Recorded Record(const SyntheticUnit& unit, int count, double noise, Random* random) {
  Recorded recorded;
  recorded.mean = unit;
  for (int session = 0; session < count; ++session) {
    SyntheticUnit now = unit;
    now.models[kAccel]->bias += now.models[kAccel]->sensitivity.norm() / std::sqrt(3.0) *
                                kAccelTurnOnMps2 * random->Normal3();
    now.models[kGyro]->bias += kGyroTurnOnRadps * random->Normal3();
    for (const Triad triad : {kAccel, kGyro}) {
      recorded.mean.models[triad]->bias +=
          (now.models[triad]->bias - unit.models[triad]->bias) / count;
    }
    SyntheticNoise rest;
    rest.rest_sigma[kAccel] = noise * 2e-3;
    rest.rest_sigma[kMag] = noise * 0.1;
    rest.rest_sigma[kGyro] = noise * 1e-4;
    SyntheticTurns turns;
    turns.gyroscope_sigma_radps = noise * 2e-3;
    turns.accelerometer_sigma_mps2 = noise * 0.02;
    const auto attitudes = RandomAttitudes(kSessionPoses, random);
    PoseSet& set = recorded.sessions.emplace_back(SimulatePoses(now, attitudes, rest, random));
    AddTurns(now, attitudes, turns, noise > 0.0 ? random : nullptr, &set);
    set.source = "session " + std::to_string(session + 1);
  }
  return recorded;
}

CalibrateOptions OptionsOf(const SyntheticUnit& unit) {
  CalibrateOptions options = trials::JointOptions(unit);
  options.triads[kGyro].enabled = true;
  for (const Triad triad : kTriads) options.triads[triad].excess = ExcessNoise::kNone;
  return options;
}

PoseSet Joined(std::vector<PoseSet> sessions) {
  Result<PoseSet> joined = JoinSessions(std::move(sessions));
  EXPECT_TRUE(joined) << joined.error().message;
  return joined ? *std::move(joined) : PoseSet();
}

TEST(Sessions, AreNumberedThroughAndNoTurnLeadsFromOneToTheNext) {
  Random random(1);
  const PoseSet joined = Joined(Record(DrawNineAxes(&random), 3, 1.0, &random).sessions);
  ASSERT_THAT(joined.poses, SizeIs(3 * kSessionPoses));
  ASSERT_THAT(joined.sessions, SizeIs(3));
  EXPECT_EQ(joined.sessions[1].first_pose, kSessionPoses + 1);
  EXPECT_EQ(joined.sessions[1].last_pose, 2 * kSessionPoses);
  for (std::size_t k = 0; k < joined.poses.size(); ++k) {
    EXPECT_EQ(joined.poses[k].number, static_cast<int>(k) + 1);
    EXPECT_EQ(joined.poses[k].session, static_cast<int>(k) / kSessionPoses);
    if (k == 0) continue;
    EXPECT_GE(joined.poses[k].start_ns, joined.poses[k - 1].end_ns);
  }
  for (const RecordedMove& move : joined.moves) {
    EXPECT_EQ(joined.poses[move.from].session, joined.poses[move.from + 1].session);
  }
}

TEST(Sessions, OfDifferentUnitsAreRefused) {
  Random random(2);
  Recorded recorded = Record(DrawNineAxes(&random), 2, 1.0, &random);
  recorded.sessions[0].serial = "A";
  recorded.sessions[1].serial = "B";
  const Result<PoseSet> joined = JoinSessions(recorded.sessions);
  ASSERT_FALSE(joined);
  EXPECT_EQ(joined.error().kind(), ErrorKind::kBadInput);
  EXPECT_THAT(joined.error().message, HasSubstr("session 2: is a recording of unit `B`"));
}

TEST(Sessions, InDifferentUnitsOfMeasurementAreRefused) {
  Random random(2);
  Recorded recorded = Record(DrawNineAxes(&random), 2, 1.0, &random);
  for (StreamSummary& stream : recorded.sessions[1].streams) {
    if (stream.triad == kAccel) stream.unit = {"g", kStandardGravityMps2, false};
  }
  const Result<PoseSet> joined = JoinSessions(recorded.sessions);
  ASSERT_FALSE(joined);
  EXPECT_THAT(joined.error().message, HasSubstr("the accelerometer is in g, but in m/s^2"));
}

TEST(Sessions, WithAMagnetometerThatIsMountedDifferentlyAreRefused) {
  Random random(2);
  Recorded recorded = Record(DrawNineAxes(&random), 2, 1.0, &random);
  for (PoseSet& session : recorded.sessions) session.tags.firmware = "px4";
  recorded.sessions[0].tags.magnetometer_mount_deg = Eigen::Vector3d(0.0, 0.0, 90.0);
  for (const auto& other : {std::optional<Eigen::Vector3d>(), {Eigen::Vector3d(180.0, 0.0, 0.0)}}) {
    recorded.sessions[1].tags.magnetometer_mount_deg = other;
    const Result<PoseSet> joined = JoinSessions(recorded.sessions);
    ASSERT_FALSE(joined);
    EXPECT_THAT(joined.error().message, HasSubstr("session 2: the magnetometer is turned"));
    EXPECT_THAT(joined.error().message, HasSubstr("but by 0, 0, 90 deg in session 1"));
  }
  recorded.sessions[1].tags.magnetometer_mount_deg = Eigen::Vector3d(0.0, 0.0, 90.0);
  // Where the firmware corrects it is undone.
  recorded.sessions[1].tags.magnetometer_turn_deg = Eigen::Vector3d(180.0, 0.0, 0.0);
  EXPECT_EQ(Joined(recorded.sessions).tags.magnetometer_turn_deg, Eigen::Vector3d(180.0, 0.0, 0.0));
}

TEST(Sessions, HaveTheirParametersWhereTheLastSays) {
  Random random(2);
  Recorded recorded = Record(DrawNineAxes(&random), 2, 1.0, &random);
  for (PoseSet& session : recorded.sessions) session.tags.firmware = "px4";
  recorded.sessions[0].tags.device_slots = {{0, 1, 2}};
  recorded.sessions[1].tags.device_slots = {{2, 1, 0}};
  recorded.sessions[0].tags.station = "first";
  const PoseSet joined = Joined(recorded.sessions);
  EXPECT_EQ(joined.tags.device_slots, recorded.sessions[1].tags.device_slots);
  EXPECT_EQ(joined.tags.station, "first");
  EXPECT_THAT(joined.findings,
              Contains(testing::Field(&Finding::text,
                                      HasSubstr("numbers its sensors differently in session 2"))));
}

// Exact but for the rounding of sums and the nominal noise that weighs readings without any.
TEST(Sessions, AreFoundExactlyWithoutNoise) {
  Random random(3);
  const Recorded recorded = Record(DrawNineAxes(&random), 3, 0.0, &random);
  const CalibrateOptions options = OptionsOf(recorded.mean);
  const auto summary = Calibrate(Joined(recorded.sessions), options);
  ASSERT_TRUE(summary) << summary.error().message;
  ASSERT_TRUE(summary->calibration.IsUsable());
  for (const Triad triad : kTriads) {
    const TriadModel<double>& found = summary->calibration.sensors[triad]->model;
    const TriadModel<double>& truth = *recorded.mean.models[triad];
    const double strength = triad == kGyro ? 1.0 : recorded.mean.WorldVector(triad).norm();
    const double gain = truth.sensitivity.norm();
    EXPECT_LT((found.bias - truth.bias).norm(), 1e-6 * gain * strength) << TriadName(triad);
    EXPECT_LT((found.sensitivity - truth.sensitivity).norm(), 1e-6 * gain) << TriadName(triad);
  }
}

TEST(Sessions, ShareTheMagnetometersBiasUnlessToldOtherwise) {
  Random random(4);
  const Recorded recorded = Record(DrawNineAxes(&random), 3, 1.0, &random);
  CalibrateOptions options = OptionsOf(recorded.mean);
  const auto has_of = [](const Calibration& calibration, Triad triad) {
    for (const BiasRepeatability& scatter : calibration.quality.rests.repeatability) {
      if (scatter.triad == triad) return true;
    }
    return false;
  };
  const auto summary = Calibrate(Joined(recorded.sessions), options);
  ASSERT_TRUE(summary && summary->calibration.IsUsable());
  EXPECT_TRUE(has_of(summary->calibration, kAccel));
  EXPECT_TRUE(has_of(summary->calibration, kGyro));
  EXPECT_FALSE(has_of(summary->calibration, kMag));
  EXPECT_THAT(summary->calibration.quality.rests.sessions, SizeIs(6));
  EXPECT_THAT(summary->calibration.findings, Contains(HasCode(FindingCode::kSessions)));

  options.triads[kMag].bias_per_session = true;
  const auto other = Calibrate(Joined(recorded.sessions), options);
  ASSERT_TRUE(other && other->calibration.IsUsable());
  EXPECT_TRUE(has_of(other->calibration, kMag));
}

// The bias of each session with its own σ; 12 poses a session.
TEST(Sessions, StateEachBiasWithinItsSigma) {
  Random random(5);
  double chi2 = 0.0;
  int count = 0;
  for (int trial = 0; trial < 20; ++trial) {
    const SyntheticUnit unit = DrawNineAxes(&random);
    Recorded recorded = Record(unit, 3, 1.0, &random);
    const auto summary = Calibrate(Joined(recorded.sessions), OptionsOf(unit));
    ASSERT_TRUE(summary && summary->calibration.IsUsable());
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (const SessionBias& session : summary->calibration.quality.rests.sessions) {
      if (session.triad == kGyro) mean += session.bias_raw / 3.0;
    }
    const TriadCalibration& gyroscope = *summary->calibration.sensors[kGyro];
    EXPECT_LT((mean - gyroscope.model.bias).norm(), 1e-12);
    const Eigen::Vector3d off = gyroscope.model.bias - recorded.mean.models[kGyro]->bias;
    chi2 += off.cwiseQuotient(gyroscope.bias_sigma).squaredNorm();
    count += 3;
  }
  // Sum of squares of `count` numbers of unit variance: chance of 1 in 10 000 on each side.
  EXPECT_GT(ChiSquareCdf(chi2, count), 1e-4);
  EXPECT_LT(ChiSquareCdf(chi2, count), 1.0 - 1e-4);
}

// Each unit's error over its whole covariance.
TEST(Sessions, HaveNeesAsTheirCovarianceSays) {
  Random random(6);
  double sum = 0.0;
  int dimension = 0;
  for (int trial = 0; trial < 40; ++trial) {
    const SyntheticUnit unit = DrawNineAxes(&random);
    const Recorded recorded = Record(unit, 3, 1.0, &random);
    const auto summary = Calibrate(Joined(recorded.sessions), OptionsOf(unit));
    ASSERT_TRUE(summary && summary->calibration.IsUsable());
    int size = 0;
    sum += trials::Nees(trials::Errors(summary->calibration, recorded.mean),
                        summary->calibration.covariance.matrix,
                        &size);
    dimension += size;
  }
  // χ² with `dimension` degrees of freedom, 1 in 10 000 on each side.
  EXPECT_GT(ChiSquareCdf(sum, dimension), 1e-4) << sum << " of " << dimension;
  EXPECT_LT(ChiSquareCdf(sum, dimension), 1.0 - 1e-4) << sum << " of " << dimension;
}

// With six sessions the σ of a σ is a third of it.
TEST(Sessions, ShowHowTheBiasRepeats) {
  Random random(7);
  double square = 0.0;
  int count = 0;
  for (int trial = 0; trial < 20; ++trial) {
    const SyntheticUnit unit = DrawNineAxes(&random);
    const Recorded recorded = Record(unit, 6, 1.0, &random);
    const auto summary = Calibrate(Joined(recorded.sessions), OptionsOf(unit));
    ASSERT_TRUE(summary && summary->calibration.IsUsable());
    for (const BiasRepeatability& scatter : summary->calibration.quality.rests.repeatability) {
      if (scatter.triad != kGyro) continue;
      square += scatter.value_raw.squaredNorm() / (kGyroTurnOnRadps * kGyroTurnOnRadps);
      count += 3;
      EXPECT_GT(scatter.next_session_raw.minCoeff(), scatter.value_raw.minCoeff());
    }
  }
  // Each axis is χ² with 5 degrees of freedom over 5: of 60 of them the σ of the mean is
  // sqrt(2 / 300) = 0.082; four of them.
  EXPECT_NEAR(square / count, 1.0, 0.33);
}

// Both stop where a step is far below σ.
TEST(Sessions, AreSolvedByPlainCeresAlike) {
  Random random(9);
  const SyntheticUnit unit = DrawNineAxes(&random);
  const PoseSet joined = Joined(Record(unit, 3, 1.0, &random).sessions);
  CalibrateOptions options = OptionsOf(unit);
  const auto eliminated = Calibrate(joined, options);
  options.solver = Solver::kCeres;
  const auto ceres = Calibrate(joined, options);
  ASSERT_TRUE(eliminated && ceres);
  for (const Triad triad : kTriads) {
    const TriadCalibration& a = *eliminated->calibration.sensors[triad];
    const TriadCalibration& b = *ceres->calibration.sensors[triad];
    EXPECT_LT((a.model.bias - b.model.bias).cwiseQuotient(a.bias_sigma).norm(), 1e-4);
  }
}

// One pose of the second session cannot tell an accelerometer's bias there.
TEST(Sessions, NameTheOneThatShowsTooLittle) {
  Random random(8);
  const SyntheticUnit unit = DrawNineAxes(&random);
  Recorded recorded = Record(unit, 2, 1.0, &random);
  PoseSet& last = recorded.sessions.back();
  last.poses.resize(1);
  last.moves.clear();
  CalibrateOptions options = OptionsOf(unit);
  options.triads[kMag].enabled = options.triads[kGyro].enabled = false;
  const auto summary = Calibrate(Joined(recorded.sessions), options);
  ASSERT_TRUE(summary);
  EXPECT_EQ(summary->calibration.outcome, Outcome::kNotObservable);
  ASSERT_FALSE(summary->calibration.quality.weak_directions.empty());
  EXPECT_THAT(summary->calibration.quality.weak_directions.front().description,
              HasSubstr("accelerometer bias"));
  EXPECT_THAT(summary->calibration.quality.weak_directions.front().description,
              HasSubstr("in session 1"));
}

}  // namespace sessions_test
}  // namespace truetriad
