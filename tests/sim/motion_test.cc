// SPDX-License-Identifier: Apache-2.0
#include "sim/motion.h"

#include <numbers>

#include <gtest/gtest.h>

#include "sim/scenario_samples.h"
#include "sim/surroundings.h"
#include "sim/timeline.h"

namespace truetriad {
namespace motion_test {

/// Every kind of step, with all that moves the unit.
Scenario EverythingThatMoves() {
  Scenario scenario = QuietScenario();
  PosesStep& poses = std::get<PosesStep>(scenario.motion[0]);
  poses.travel_m = 0.3;
  poses.tilt_sigma_rad = 0.05;
  poses.rest_spread = 0.3;
  poses.shuffle = true;
  scenario.motion.push_back(TurnStep{Eigen::Vector3d(1.0, 2.0, 3.0), -2.5, 3.0, 1.0});
  scenario.motion.push_back(RateStep{Eigen::Vector3d::UnitX(), {1.0, -3.0}, 2.0, 0.5, 1.0});
  scenario.motion.push_back(TumbleStep{20.0, 2.0});
  scenario.disturbances.push_back(UnsettledPose{3, Eigen::Vector3d(0.02, -0.01, 0.03), 0.5});
  scenario.sensors[Triad::kAccelerometer]->lever_arm_m = Eigen::Vector3d(0.1, -0.2, 0.05);
  return scenario;
}

TEST(Motion, RatesAndAccelerationsAreTheDerivativesOfTheAttitude) {
  const Scenario scenario = EverythingThatMoves();
  const Timeline timeline = MakeTimeline(scenario, 0);
  constexpr double kStepS = 1e-4;
  int moving = 0;
  for (double time_s = 0.03; time_s < timeline.motion.duration_s(); time_s += 0.0917) {
    const MotionPhase& phase = timeline.motion.phase(timeline.motion.PhaseAt(time_s));
    if (time_s - kStepS < phase.begin_s || time_s + kStepS > phase.end_s()) continue;
    const Kinematics at = phase.At(time_s);
    const Kinematics before = phase.At(time_s - kStepS);
    const Kinematics after = phase.At(time_s + kStepS);
    // Errors of central differences: step^2 / 6 times the third derivative, for moves of pi in
    // 1.2 s up to 60 pi / 1.2^3 rad/s^3, and for rates a power of 1.2 s and 60 / 30 more; rounding
    // 1e-16 / step.
    const Eigen::AngleAxisd turn(before.world_from_body.conjugate() * after.world_from_body);
    EXPECT_LT((turn.angle() * turn.axis() / (2.0 * kStepS) - at.rate_radps).norm(), 1e-6) << time_s;
    EXPECT_LT(
        ((after.rate_radps - before.rate_radps) / (2.0 * kStepS) - at.angular_acceleration_radps2)
            .norm(),
        1e-5)
        << time_s;
    moving += at.rate_radps.norm() > 0.1 ? 1 : 0;
  }
  EXPECT_GT(moving, 100);
}

TEST(Motion, AttitudeIsContinuousFromPhaseToPhase) {
  const Timeline timeline = MakeTimeline(EverythingThatMoves(), 0);
  std::size_t index = 0;
  for (;; ++index) {
    const MotionPhase& phase = timeline.motion.phase(index);
    if (phase.end_s() >= timeline.motion.duration_s()) break;
    const MotionPhase& next = timeline.motion.phase(index + 1);
    EXPECT_EQ(phase.end_s(), next.begin_s);
    EXPECT_LT(phase.At(phase.end_s()).world_from_body.angularDistance(next.world_from_body), 1e-7);
  }
  EXPECT_GT(index, 48U);
}

TEST(Motion, TumblingReachesItsRate) {
  Scenario scenario = QuietScenario();
  scenario.motion = {TumbleStep{600.0, 2.0}};
  const Timeline timeline = MakeTimeline(scenario, 0);
  double sum = 0.0;
  int count = 0;
  Eigen::Matrix3d moment = Eigen::Matrix3d::Zero();
  for (double time_s = 4.0; time_s < 600.0; time_s += 0.1, ++count) {
    const std::size_t phase = timeline.motion.PhaseAt(time_s);
    const Kinematics at = timeline.motion.phase(phase).At(time_s);
    sum += at.rate_radps.squaredNorm();
    const Eigen::Vector3d up = at.world_from_body.conjugate() * Eigen::Vector3d::UnitZ();
    moment += up * up.transpose();
  }
  // The cross term of the first and third angle does not average out to nothing: 10 %.
  EXPECT_NEAR(std::sqrt(sum / count), 2.0, 0.2);
  EXPECT_GT((moment / count).selfadjointView<Eigen::Lower>().eigenvalues().minCoeff(), 0.1);
}

TEST(Surroundings, LeverArmIsTheSecondDerivativeOfTheSensorsPosition) {
  const Scenario scenario = EverythingThatMoves();
  const Timeline timeline = MakeTimeline(scenario, 0);
  const Eigen::Vector3d arm = scenario.sensors[Triad::kAccelerometer]->lever_arm_m;
  const Eigen::Vector3d gravity(0.0, 0.0, scenario.world.gravity_mps2);
  Surroundings surroundings(scenario, timeline.motion, timeline.rests);
  constexpr double kStepS = 5e-4;
  for (double time_s = 0.03; time_s < timeline.motion.duration_s(); time_s += 0.0917) {
    const MotionPhase& phase = timeline.motion.phase(timeline.motion.PhaseAt(time_s));
    if (time_s - kStepS < phase.begin_s || time_s + kStepS > phase.end_s()) continue;
    surroundings.MoveTo(time_s);
    const Kinematics at = phase.At(time_s);
    // Where the sensor is, but for the centre.
    const auto position = [&](double t) -> Eigen::Vector3d {
      return phase.At(t).world_from_body * arm;
    };
    const Eigen::Vector3d acceleration =
        (position(time_s + kStepS) - 2.0 * position(time_s) + position(time_s - kStepS)) /
            (kStepS * kStepS) +
        at.acceleration_mps2;
    const Eigen::Vector3d force = at.world_from_body.conjugate() * (acceleration + gravity);
    // Step^2 / 12 times the fourth derivative: an arm of 0.23 m times up to 9.8 rad/s (2.5 turns in
    // 3 s, 1.875 times the mean at the peak) to the fourth.
    EXPECT_LT((surroundings.ForceMps2() - force).norm(), 1e-4) << time_s;
  }
}

TEST(Gyroscope, IntegratesToTheAttitudesToTheLastDigit) {
  Scenario scenario = EverythingThatMoves();
  scenario.sensors[Triad::kGyroscope]->sampling.rate_hz = 97.0;  // No whole number of ns.
  scenario.sensors[Triad::kAccelerometer].reset();
  scenario.sensors[Triad::kMagnetometer].reset();
  const std::unique_ptr<Simulation> simulation = Simulate(scenario);
  const Samples samples = SamplesOf(scenario, Triad::kGyroscope);
  Eigen::Quaterniond attitude = simulation->WorldFromBody(0.0);
  for (std::size_t i = 1; i < samples.readings.size(); ++i) {
    const double interval_s =
        static_cast<double>(samples.time_ns[i] - samples.time_ns[i - 1]) * 1e-9;
    const Eigen::Vector3d turn = interval_s * samples.readings[i];
    if (turn.norm() > 0.0) attitude = attitude * Eigen::AngleAxisd(turn.norm(), turn.normalized());
    const Eigen::Quaterniond truth =
        simulation->WorldFromBody(static_cast<double>(samples.time_ns[i]) * 1e-9);
    const double sign = attitude.dot(truth) < 0.0 ? -1.0 : 1.0;
    // 16,000 steps, each rounded to 2e-16: a random walk to 1e-13, growth of the norm likewise.
    ASSERT_LT((attitude.coeffs() - sign * truth.coeffs()).norm(), 1e-12) << i;
  }
}

TEST(Gyroscope, SeesTheEarthTurn) {
  Scenario scenario = StillScenario(10.0);
  scenario.world.earth_rate = SimulatedWorld::EarthRate{0.8, 0.0};
  for (const auto output : {GyroscopeOutput::kMeanRate, GyroscopeOutput::kInstantaneous}) {
    scenario.sensors[Triad::kGyroscope]->gyroscope_output = output;
    for (const Eigen::Vector3d& rate : SamplesOf(scenario, Triad::kGyroscope).readings) {
      ASSERT_NEAR(rate.x(), 7.292115e-5 * std::cos(0.8), 1e-18);
      ASSERT_NEAR(rate.z(), 7.292115e-5 * std::sin(0.8), 1e-18);
    }
  }
}

TEST(Gyroscope, MeanAndInstantaneousRatesAgreeAtAHighRate) {
  Scenario scenario = EverythingThatMoves();
  scenario.disturbances.clear();
  scenario.world.earth_rate = SimulatedWorld::EarthRate{0.8, 0.1};
  for (auto& sensor : scenario.sensors) sensor->sampling.rate_hz = 1000.0;
  const Samples mean = SamplesOf(scenario, Triad::kGyroscope);
  scenario.sensors[Triad::kGyroscope]->gyroscope_output = GyroscopeOutput::kInstantaneous;
  const Samples now = SamplesOf(scenario, Triad::kGyroscope);
  ASSERT_EQ(mean.readings.size(), now.readings.size());
  for (std::size_t i = 1; i < now.readings.size(); ++i) {
    // The mean of two instants is that of the interval but for interval^2 / 12 times the second
    // derivative of the rate (up to 60 pi / 1.2^3 rad/s^3).
    const Eigen::Vector3d expected = 0.5 * (now.readings[i - 1] + now.readings[i]);
    ASSERT_LT((mean.readings[i] - expected).norm(), 5e-5) << i;
  }
}

}  // namespace motion_test
}  // namespace truetriad
