// SPDX-License-Identifier: Apache-2.0
#include "truetriad/planning/plan.h"

#include <cmath>
#include <numbers>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "model/attitude_sets.h"
#include "planning/pose_order.h"
#include "support/accel_mag_trials.h"

namespace truetriad {
namespace plan_test {

constexpr double kAccelSigma = 0.003;  // m/s^2
constexpr double kMagSigma = 0.05;     // uT

// A unit that reads true units.
SyntheticUnit IdealUnit() {
  SyntheticUnit unit;
  unit.dip_rad = trials::kDip;
  unit.models[Triad::kAccelerometer] = TriadModel<double>();
  unit.models[Triad::kMagnetometer] = TriadModel<double>();
  unit.units[Triad::kAccelerometer] = trials::UnitOf(Triad::kAccelerometer, false);
  unit.units[Triad::kMagnetometer] = trials::UnitOf(Triad::kMagnetometer, false);
  return unit;
}

PlanOptions JointPlan(int poses) {
  PlanOptions options;
  options.calibrate = trials::JointOptions(IdealUnit());
  for (TriadOptions& triad : options.calibrate.triads) triad.excess = ExcessNoise::kNone;
  options.calibrate.triads[Triad::kAccelerometer].noise_sigma_raw =
      Eigen::Vector3d::Constant(kAccelSigma);
  options.calibrate.triads[Triad::kMagnetometer].noise_sigma_raw =
      Eigen::Vector3d::Constant(kMagSigma);
  options.nominal_dip_rad = trials::kDip;
  options.grid.attitudes = HandAttitudes();
  options.poses = poses;
  return options;
}

PlanOptions AccelerometerPlan(int poses) {
  PlanOptions options = JointPlan(poses);
  options.calibrate.triads[Triad::kMagnetometer].enabled = false;
  return options;
}

std::vector<Eigen::Quaterniond> AttitudesOf(const PoseProgram& program) {
  std::vector<Eigen::Quaterniond> attitudes;
  for (const ProgramPose& pose : program.poses) attitudes.push_back(pose.world_from_body);
  return attitudes;
}

PoseSet ExactReadings(const SyntheticUnit& unit, const std::vector<Eigen::Quaterniond>& attitudes) {
  Random unused(0);
  return SimulatePoses(unit, attitudes, SyntheticNoise{}, &unused);
}

Plan MustPlan(const PoseSet& measured, const PlanOptions& options) {
  const Result<Plan> plan = MakePlan(measured, options);
  EXPECT_TRUE(plan) << plan.error().message;
  return plan ? *plan : Plan();
}

double SigmaOf(const Plan& plan, const std::string& name) {
  for (const PlannedSigma& sigma : plan.sigmas) {
    if (sigma.name == name) return sigma.after;
  }
  ADD_FAILURE() << "no quantity " << name;
  return 0.0;
}

TEST(MakePlan, PredictsTheCovarianceThatTheCalibrationStatesInEveryGauge) {
  for (const Gauge gauge : {Gauge::kAccelX, Gauge::kAccelZ, Gauge::kSymmetric}) {
    PlanOptions options = JointPlan(12);
    options.calibrate.gauge = gauge;
    const Plan plan = MustPlan({}, options);
    const auto summary =
        Calibrate(ExactReadings(IdealUnit(), AttitudesOf(plan.program)), options.calibrate);
    ASSERT_TRUE(summary && summary->calibration.IsUsable());
    const NamedCovariance& stated = summary->calibration.covariance;
    ASSERT_EQ(plan.covariance.parameters, stated.parameters);
    // Both are linearised at the same point but for the optimiser's tolerance.
    EXPECT_LT((plan.covariance.matrix - stated.matrix).norm(), 1e-6 * stated.matrix.norm());
    EXPECT_NEAR(SigmaOf(plan, "accelerometer.bias.x"), std::sqrt(stated.matrix(0, 0)), 1e-9);
  }
}

TEST(MakePlan, CountsTwentyTwoQuantitiesOfTheJointModel) {
  EXPECT_EQ(MustPlan({}, JointPlan(12)).sigmas.size(), 22U);
}

TEST(MakePlan, TwelvePlannedPosesAreWorthEighteenRandomOnes) {
  PlanOptions options = JointPlan(12);
  options.grid = {SpreadAttitudes(600), true};
  options.random_draws = 200;
  const Plan plan = MustPlan({}, options);
  EXPECT_TRUE(plan.IsMet());
  ASSERT_TRUE(plan.random);
  EXPECT_GE(plan.random->gain, 1.5);
  ASSERT_TRUE(plan.random->equal_poses);
  EXPECT_GE(*plan.random->equal_poses, 18);
}

// With the matrix held, a pose with the unit direction u says u u^T / s^2 of the bias. The trace of
// all is n / s^2, so the best that n poses can do is s sqrt(3 / n) on each axis. The landscape
// around it is flat: exchange may stop half a percent from it.
TEST(MakePlan, FindsTheKnownOptimumOfABias) {
  for (const PlanCriterion criterion : {PlanCriterion::kDeterminant, PlanCriterion::kVariances}) {
    PlanOptions options = AccelerometerPlan(12);
    options.criterion = criterion;
    options.calibrate.triads[Triad::kAccelerometer].model = MatrixModel::kBias;
    const Plan plan = MustPlan({}, options);
    double product = 1.0;
    for (const PlannedSigma& sigma : plan.sigmas) product *= sigma.after;
    EXPECT_NEAR(std::cbrt(product) / (kAccelSigma * std::sqrt(3.0 / 12.0)), 1.0, 0.005);
  }
}

TEST(MakePlan, TakesTheFewestPosesThatReachAWantedSigma) {
  PlanOptions options = AccelerometerPlan(0);
  options.calibrate.triads[Triad::kAccelerometer].model = MatrixModel::kBias;
  // s sqrt(3 / n) <= wanted for n >= 3 (s / wanted)^2 = 26.7.
  options.wanted["accelerometer.bias"] = 1.005 * kAccelSigma / 3.0;
  const Plan plan = MustPlan({}, options);
  EXPECT_EQ(plan.program.poses.size(), 27U);
  EXPECT_TRUE(plan.IsMet());
  ASSERT_EQ(plan.wanted.size(), 1U);
  EXPECT_EQ(plan.wanted.front().poses_needed, 27);
}

TEST(MakePlan, SaysWhenWantedSigmasAreOutOfReach) {
  PlanOptions options = AccelerometerPlan(0);
  options.wanted["accelerometer.bias"] = 1e-4;
  options.max_poses = 20;
  const Plan plan = MustPlan({}, options);
  EXPECT_EQ(plan.program.poses.size(), 20U);
  EXPECT_FALSE(plan.IsMet());
  EXPECT_FALSE(plan.wanted.front().met);
  EXPECT_FALSE(plan.wanted.front().poses_needed);
}

TEST(MakePlan, NamesWhatAGivenProgramCannotSee) {
  PlanOptions options = AccelerometerPlan(0);
  PoseProgram level;  // z never leaves the horizon
  for (int k = 0; k < 12; ++k) {
    const Eigen::Quaterniond x_up(
        Eigen::AngleAxisd(-0.5 * std::numbers::pi, Eigen::Vector3d::UnitY()));
    level.poses.push_back(
        {x_up * Eigen::AngleAxisd(k * std::numbers::pi / 6.0, Eigen::Vector3d::UnitZ()), {}, ""});
  }
  options.program = level;
  const Plan plan = MustPlan({}, options);
  EXPECT_FALSE(plan.determined);
  EXPECT_FALSE(plan.IsMet());
  EXPECT_TRUE(std::isinf(SigmaOf(plan, "accelerometer.scale_error.z")));
  ASSERT_FALSE(plan.weak_directions.empty());
  std::string all;
  for (const WeakDirection& weak : plan.weak_directions) all += weak.description;
  EXPECT_NE(all.find("scale z"), std::string::npos) << all;
}

// The faces of a cube show an accelerometer six readings: not enough for nine parameters by itself,
// and the closed-form start has nothing to begin with though the field would help.
TEST(MakePlan, SaysWhenTheCalibrationWouldNotFindItsStart) {
  PlanOptions options = JointPlan(12);
  options.grid.attitudes = CubeAttitudes();
  const Plan plan = MustPlan({}, options);
  EXPECT_TRUE(plan.determined);
  EXPECT_FALSE(plan.rehearsed);
  EXPECT_FALSE(plan.IsMet());
  ASSERT_FALSE(plan.messages.empty());
  EXPECT_NE(plan.messages.back().find("too few directions"), std::string::npos)
      << plan.messages.back();
}

// Eight poses with two vectors each say enough for all parameters, but each sensor's own start
// needs nine readings.
TEST(MakePlan, SaysHowManyPosesTheCalibrationNeedsAtLeast) {
  PlanOptions options = JointPlan(8);
  options.criterion = PlanCriterion::kDeterminant;
  const Plan plan = MustPlan({}, options);
  EXPECT_TRUE(plan.determined);
  EXPECT_FALSE(plan.rehearsed);
  ASSERT_FALSE(plan.messages.empty());
  const std::string& message = plan.messages.back();
  EXPECT_NE(message.find("8 poses, but model `full` needs at least 9"), std::string::npos)
      << message;
}

// The attitude that somebody takes who reads "y up, x 45 deg above level, x 90 deg west of north"
// as AttitudeInWords says it; where the words name no heading, it is as it happens to be.
Eigen::Quaterniond AttitudeFromWords(const std::string& words, Random* random) {
  const std::string axes = "xyz";
  const double degree = std::numbers::pi / 180.0;
  Eigen::Vector3d up = Eigen::Vector3d::Zero();  // in the body
  double azimuth = random->Uniform(-std::numbers::pi, std::numbers::pi);
  Eigen::Index first = 0;
  std::istringstream parts(words);
  std::string part;
  std::getline(parts, part, ',');
  const bool minus = part.front() == '-';
  const auto upward = static_cast<Eigen::Index>(axes.find(part[minus ? 1 : 0]));
  while (std::getline(parts, part, ',')) {
    std::istringstream text(part);
    std::string axis, angle;
    text >> axis >> angle;
    const auto index = static_cast<Eigen::Index>(axes.find(axis));
    if (part.find("level") != std::string::npos) {
      const double sine = std::sin(std::stod(angle) * degree);
      up[index] = part.find("above") != std::string::npos ? sine : -sine;
      continue;
    }
    first = index;
    const double side = part.find("west") != std::string::npos ? 1.0 : -1.0;
    if (part.find("deg") != std::string::npos) {
      const double size = std::stod(angle) * degree;
      azimuth =
          side * (part.find("of north") != std::string::npos ? size : std::numbers::pi - size);
    } else if (part.find("to the north") != std::string::npos) {
      azimuth = 0.0;
    } else if (part.find("to the south") != std::string::npos) {
      azimuth = std::numbers::pi;
    } else {
      azimuth = side * 0.5 * std::numbers::pi;
    }
  }
  up[upward] = (minus ? -1.0 : 1.0) * std::sqrt(1.0 - up.squaredNorm());
  const auto upright = Eigen::Quaterniond::FromTwoVectors(up, Eigen::Vector3d::UnitZ());
  const Eigen::Vector3d pointer = upright * Eigen::Vector3d::Unit(first);
  const double turn = azimuth - std::atan2(pointer.y(), pointer.x());
  return Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ()) * upright;
}

TEST(MakePlan, KeepsItsWordWhenAMagnetometersPosesAreTakenAsTheyAreWorded) {
  PlanOptions options = JointPlan(12);
  options.calibrate.triads[Triad::kAccelerometer].enabled = false;
  const Plan plan = MustPlan({}, options);
  ASSERT_TRUE(plan.IsMet());
  Random random(17);
  std::vector<Eigen::Quaterniond> taken;
  for (const ProgramPose& pose : plan.program.poses) {
    taken.push_back(AttitudeFromWords(pose.label, &random));
    // Words are whole degrees: each of three angles is off by half of one at most.
    EXPECT_LT(taken.back().angularDistance(pose.world_from_body),
              std::sqrt(3.0) * 0.5 * std::numbers::pi / 180.0)
        << pose.label;
  }
  const auto summary = Calibrate(ExactReadings(IdealUnit(), taken), options.calibrate);
  ASSERT_TRUE(summary && summary->calibration.IsUsable());
  const NamedCovariance& stated = summary->calibration.covariance;
  ASSERT_EQ(plan.covariance.parameters, stated.parameters);
  for (Eigen::Index i = 0; i < stated.matrix.rows(); ++i) {
    // Twice the share that 1 degree may turn the readings by.
    EXPECT_NEAR(std::sqrt(stated.matrix(i, i)),
                std::sqrt(plan.covariance.matrix(i, i)),
                0.035 * std::sqrt(plan.covariance.matrix(i, i)))
        << stated.parameters[static_cast<std::size_t>(i)];
  }
}

TEST(MakePlan, CompletesARecordingThatIsEnoughForACalibration) {
  Random random(5);
  SyntheticNoise noise = trials::ModelNoise();
  const SyntheticUnit unit = trials::RandomUnit({}, &random);
  PoseSet measured = SimulatePoses(unit, RandomAttitudes(12, &random), noise, &random);
  for (StaticPose& pose : measured.poses) pose.end_ns = pose.start_ns + 3'000'000'000;
  PlanOptions options = JointPlan(6);
  for (TriadOptions& triad : options.calibrate.triads) triad.noise_sigma_raw.reset();
  const Plan plan = MustPlan(measured, options);
  EXPECT_EQ(plan.measured_poses, 12);
  EXPECT_EQ(plan.program.poses.size(), 6U);
  EXPECT_EQ(plan.rest_s, 3.0);
  ASSERT_EQ(plan.noise.size(), 2U);
  EXPECT_EQ(plan.noise[1].noise.source, NoiseSource::kStatic);
  // 0.05 uT by the unit's gain, between 0.9 and 1.1.
  EXPECT_NEAR(plan.noise[1].noise.sigma.x(), 0.05, 0.0051);
  // What was there is stated as the calibration of it states it.
  const auto before = Calibrate(measured, options.calibrate);
  ASSERT_TRUE(before && before->calibration.IsUsable());
  const TriadCalibration& sensor = *before->calibration.sensors[Triad::kMagnetometer];
  for (const PlannedSigma& sigma : plan.sigmas) {
    EXPECT_LT(sigma.after, sigma.before) << sigma.name;
    if (sigma.name != "magnetometer.bias.z") continue;
    // TRIAD attitudes instead of refined ones: off by the noise, a thousandth of the field.
    EXPECT_NEAR(
        sigma.before, sensor.bias_sigma.z() / sensor.model.sensitivity(2, 2), 0.01 * sigma.before);
  }
  // The completed set is as good as predicted.
  const SyntheticUnit same = unit;
  PoseSet completed = measured;
  for (const StaticPose& pose :
       SimulatePoses(same, AttitudesOf(plan.program), noise, &random).poses) {
    completed.poses.push_back(pose);
    completed.poses.back().number = static_cast<int>(completed.poses.size());
  }
  const auto after = Calibrate(completed, options.calibrate);
  ASSERT_TRUE(after && after->calibration.IsUsable());
  const TriadCalibration& better = *after->calibration.sensors[Triad::kMagnetometer];
  EXPECT_NEAR(SigmaOf(plan, "magnetometer.bias.z"),
              better.bias_sigma.z() / better.model.sensitivity(2, 2),
              0.02 * better.bias_sigma.z());
}

TEST(MakePlan, CompletesAFewPosesThatAreNotEnough) {
  Random random(6);
  const SyntheticUnit unit = IdealUnit();
  const PoseSet measured =
      SimulatePoses(unit, RandomAttitudes(4, &random), trials::ModelNoise(), &random);
  const Plan alone = MustPlan({}, JointPlan(12));
  const Plan plan = MustPlan(measured, JointPlan(8));
  EXPECT_TRUE(plan.IsMet());
  // Four poses that nobody chose and eight that were: worse than twelve chosen ones, but not much.
  const double share =
      SigmaOf(plan, "accelerometer.bias.x") / SigmaOf(alone, "accelerometer.bias.x");
  EXPECT_GT(share, 0.9);
  EXPECT_LT(share, 1.5);
}

TEST(MakePlan, PlansForKnownAttitudes) {
  PlanOptions options = JointPlan(12);
  options.calibrate.attitudes.kind = AttitudeKind::kGiven;
  options.calibrate.gauge = Gauge::kFixture;
  options.attitude_sigma_rad.setConstant(1e-4);
  options.grid.attitudes = CubeAttitudes();
  const Plan plan = MustPlan({}, options);
  EXPECT_TRUE(plan.IsMet());
  // Full matrices of both, dip and heading.
  EXPECT_EQ(plan.sigmas.size(), 12U + 12U + 2U);
}

TEST(MakePlan, PlansForABlockOnItsSixFaces) {
  PlanOptions options = AccelerometerPlan(6);
  options.calibrate.attitudes.kind = AttitudeKind::kSixFace;
  options.calibrate.gauge = Gauge::kFixture;
  options.grid.attitudes = SixFaceAttitudes();
  const Plan plan = MustPlan({}, options);
  EXPECT_TRUE(plan.IsMet());
  EXPECT_EQ(plan.sigmas.size(), 12U);

  options.grid = {SpreadAttitudes(100), true};
  EXPECT_FALSE(MakePlan({}, options));
}

TEST(MakePlan, PredictsNoiseOfARestFromItsAllanDeviation) {
  PlanOptions options = AccelerometerPlan(12);
  TriadOptions& sensor = options.calibrate.triads[Triad::kAccelerometer];
  sensor.noise_sigma_raw.reset();
  sensor.allan = AllanNoise{Eigen::Vector3d::Constant(0.006), Eigen::Vector3d::Zero()};
  EXPECT_FALSE(MakePlan({}, options));  // of what length?
  options.rest_s = 4.0;                 // 0.006 / sqrt(4) = 0.003
  const Plan plan = MustPlan({}, options);
  EXPECT_EQ(plan.rest_s, 4.0);
  ASSERT_EQ(plan.noise.size(), 1U);
  EXPECT_EQ(plan.noise[0].triad, Triad::kAccelerometer);
  EXPECT_EQ(plan.noise[0].noise.source, NoiseSource::kAllan);
  EXPECT_NEAR(plan.noise[0].noise.sigma.z(), 0.003, 1e-9);
  EXPECT_NEAR(SigmaOf(plan, "accelerometer.bias.x"),
              SigmaOf(MustPlan({}, AccelerometerPlan(12)), "accelerometer.bias.x"),
              1e-9);
}

TEST(MakePlan, StatesBiasesInTrueUnitsWhateverTheRawUnit) {
  PlanOptions options = AccelerometerPlan(12);
  const Plan expected = MustPlan({}, options);
  options.units[Triad::kAccelerometer] = {"counts", 1.0, true};
  options.calibrate.triads[Triad::kAccelerometer].noise_sigma_raw =
      Eigen::Vector3d::Constant(400.0 * kAccelSigma);
  EXPECT_FALSE(MakePlan({}, options));  // no scale stated
  options.nominal[Triad::kAccelerometer] = {400.0 * Eigen::Matrix3d::Identity(),
                                            Eigen::Vector3d(1e4, -2e4, 0.0)};
  const Plan plan = MustPlan({}, options);
  EXPECT_TRUE(plan.IsMet());
  EXPECT_NEAR(
      SigmaOf(plan, "accelerometer.bias.x"), SigmaOf(expected, "accelerometer.bias.x"), 1e-6);
}

TEST(MakePlan, RefusesWhatItCannotPlanFor) {
  PlanOptions options = AccelerometerPlan(12);
  options.calibrate.triads[Triad::kAccelerometer].noise_sigma_raw.reset();
  const auto no_noise = MakePlan({}, options);
  ASSERT_FALSE(no_noise);
  EXPECT_NE(no_noise.error().message.find("noise is unknown"), std::string::npos);

  options = AccelerometerPlan(0);
  options.wanted["accelerometer.biass"] = 0.1;
  const auto no_name = MakePlan({}, options);
  ASSERT_FALSE(no_name);
  EXPECT_NE(no_name.error().message.find("accelerometer.scale_error"), std::string::npos);

  options = AccelerometerPlan(0);
  options.max_poses = 0;
  const auto problems = MakePlan({}, options);
  ASSERT_FALSE(problems);
  EXPECT_NE(problems.error().message.find("max_poses"), std::string::npos);
  EXPECT_NE(problems.error().message.find("number of poses"), std::string::npos);
}

TEST(MakePlan, GivesTheSameProgramForTheSameSeed) {
  PlanOptions options = JointPlan(12);
  options.grid = {SpreadAttitudes(200), true};
  const Plan first = MustPlan({}, options);
  const Plan second = MustPlan({}, options);
  for (std::size_t k = 0; k < first.program.poses.size(); ++k) {
    EXPECT_EQ(first.program.poses[k].world_from_body.coeffs(),
              second.program.poses[k].world_from_body.coeffs());
  }
}

TEST(MakePlan, SaysWhatEachPoseIsFor) {
  const Plan plan = MustPlan({}, JointPlan(12));
  ASSERT_EQ(plan.purposes.size(), plan.program.poses.size());
  for (const PosePurpose& purpose : plan.purposes) {
    EXPECT_FALSE(purpose.name.empty());
    EXPECT_GT(purpose.sigma_ratio, 1.0);
  }
}

// Five chamber settings, bias of third order, gains of first.
PlanOptions SoakPlan(int poses) {
  PlanOptions options = JointPlan(poses);
  options.grid.temperatures_degc = {-20.0, 0.0, 25.0, 45.0, 65.0};
  for (const Triad triad : {Triad::kAccelerometer, Triad::kMagnetometer}) {
    options.calibrate.triads[triad].thermal.bias_order = 3;
    options.calibrate.triads[triad].thermal.matrix_order = 1;
  }
  return options;
}

TEST(MakePlanOverTemperature, SeesEveryTermInAscendingTemperatures) {
  const auto plan = MakePlan({}, SoakPlan(30));
  ASSERT_TRUE(plan) << plan.error().message;
  EXPECT_TRUE(plan->IsMet());
  double before = -1000.0;
  int settings = 0;
  for (const ProgramPose& pose : plan->program.poses) {
    ASSERT_TRUE(pose.temperature_degc);
    EXPECT_GE(*pose.temperature_degc, before);
    settings += *pose.temperature_degc > before ? 1 : 0;
    before = *pose.temperature_degc;
  }
  EXPECT_GE(settings, 4);  // as many as a cubic has coefficients
  int thermal = 0;
  for (const PlannedSigma& sigma : plan->sigmas) {
    if (sigma.name.find(".thermal.") == std::string::npos) continue;
    EXPECT_TRUE(std::isfinite(sigma.after)) << sigma.name;
    ++thermal;
  }
  // Three powers of bias and one of gain for each: 9 + 6 lower triangular, 9 + 9.
  EXPECT_EQ(thermal, 33);
}

TEST(MakePlanOverTemperature, PredictsWhatACalibrationOfExactReadingsStates) {
  PlanOptions options = SoakPlan(30);
  options.criterion = PlanCriterion::kDeterminant;
  const auto plan = MakePlan({}, options);
  ASSERT_TRUE(plan) << plan.error().message;
  PoseSet poses = ExactReadings(IdealUnit(), AttitudesOf(plan->program));
  for (std::size_t k = 0; k < poses.poses.size(); ++k) {
    poses.poses[k].temperature_degc = plan->program.poses[k].temperature_degc;
  }
  const auto summary = Calibrate(poses, options.calibrate);
  ASSERT_TRUE(summary && summary->calibration.IsUsable());
  const NamedCovariance& stated = summary->calibration.covariance;
  ASSERT_EQ(plan->covariance.parameters, stated.parameters);
  for (Eigen::Index i = 0; i < stated.matrix.rows(); ++i) {
    // The same graph at the same point: rounding times its condition.
    EXPECT_NEAR(plan->covariance.matrix(i, i), stated.matrix(i, i), 1e-6 * stated.matrix(i, i))
        << stated.parameters[static_cast<std::size_t>(i)];
  }
}

TEST(MakePlanOverTemperature, NamesTheTermsThatTooFewTemperaturesLeaveOpen) {
  PlanOptions options = SoakPlan(30);
  options.grid.temperatures_degc = {0.0, 25.0, 50.0};
  options.criterion = PlanCriterion::kDeterminant;
  const auto plan = MakePlan({}, options);
  ASSERT_TRUE(plan) << plan.error().message;
  EXPECT_FALSE(plan->determined);
  ASSERT_FALSE(plan->weak_directions.empty());
  const WeakDirection& worst = plan->weak_directions.front();
  EXPECT_NE(worst.description.find("tau^3"), std::string::npos) << worst.description;
  EXPECT_NE(worst.advice.find("more temperatures (3 were seen)"), std::string::npos)
      << worst.advice;
}

TEST(MakePlanOverTemperature, RefusesTermsWithoutTemperatures) {
  PlanOptions options = SoakPlan(30);
  options.grid.temperatures_degc.clear();
  const auto plan = MakePlan({}, options);
  ASSERT_FALSE(plan);
  EXPECT_NE(plan.error().message.find("temperatures_degc"), std::string::npos);
  options.program = PoseProgram{{{Eigen::Quaterniond::Identity(), {}, ""}}};
  const auto judged = MakePlan({}, options);
  ASSERT_FALSE(judged);
  EXPECT_NE(judged.error().message.find("pose 1 of the program"), std::string::npos);
}

// ------------------------------------------------------------------------------------ gyroscope

constexpr double kGyroSigma = 9e-5;  // of a rest's mean, rad/s
constexpr double kRestS = 4.0;

PlanOptions NineAxisPlan(int poses) {
  PlanOptions options = JointPlan(poses);
  TriadOptions& gyroscope = options.calibrate.triads[Triad::kGyroscope];
  gyroscope.enabled = true;
  gyroscope.excess = ExcessNoise::kNone;
  gyroscope.noise_sigma_raw = Eigen::Vector3d::Constant(kGyroSigma);
  options.rest_s = kRestS;
  return options;
}

// What a recording of the program would be, exact.
PoseSet ExactRecording(const PlanOptions& options, const PoseProgram& program) {
  SyntheticUnit unit = IdealUnit();
  unit.models[Triad::kGyroscope] = TriadModel<double>();
  unit.units[Triad::kGyroscope] = trials::UnitOf(Triad::kGyroscope, false);
  PoseSet set = ExactReadings(unit, AttitudesOf(program));
  SyntheticTurns turns;
  turns.duration_s = options.turn_s;
  turns.gyroscope_sigma_radps = kGyroSigma * std::sqrt(kRestS * turns.rate_hz);
  AddTurns(unit, AttitudesOf(program), turns, nullptr, &set);
  return set;
}

// The turns of the recording start and stop smoothly, those of the plan have one rate: as the
// matrix sees the angle alone, and noise the time, both tell the same but for what noise does in
// between (a turn's middle moves its end), a percent.
TEST(MakePlan, PredictsTheCovarianceOfACalibrationWithAGyroscope) {
  for (const bool g_sensitivity : {false, true}) {
    PlanOptions options = NineAxisPlan(14);
    if (g_sensitivity) {
      options.calibrate.triads[Triad::kGyroscope].g_sensitivity = Wanted::kYes;
    }
    const Plan plan = MustPlan({}, options);
    EXPECT_TRUE(plan.IsMet());
    const auto summary = Calibrate(ExactRecording(options, plan.program), options.calibrate);
    ASSERT_TRUE(summary && summary->calibration.IsUsable());
    const NamedCovariance& stated = summary->calibration.covariance;
    ASSERT_EQ(plan.covariance.parameters, stated.parameters);
    for (Eigen::Index i = 0; i < stated.matrix.rows(); ++i) {
      const double planned = std::sqrt(plan.covariance.matrix(i, i));
      EXPECT_NEAR(planned, std::sqrt(stated.matrix(i, i)), 0.02 * planned)
          << stated.parameters[static_cast<std::size_t>(i)];
    }
    EXPECT_GT(SigmaOf(plan, "gyroscope.scale_error.x"), 0.0);
    if (g_sensitivity) {
      EXPECT_GT(SigmaOf(plan, "gyroscope.g_sensitivity.xy"), 0.0);
    }
  }
}

TEST(MakePlan, TakesPosesUntilTheGyroscopeIsKnownAsWellAsWanted) {
  const Plan few = MustPlan({}, NineAxisPlan(9));
  double reached = 0.0;
  for (const PlannedSigma& sigma : few.sigmas) {
    if (sigma.group == "gyroscope.scale_error") reached = std::max(reached, sigma.after);
  }
  PlanOptions options = NineAxisPlan(0);
  options.wanted["gyroscope.scale_error"] = 0.6 * reached;
  const Plan plan = MustPlan({}, options);
  EXPECT_TRUE(plan.IsMet());
  EXPECT_GT(plan.program.poses.size(), 9U);
  options.max_poses = 10;
  EXPECT_FALSE(MustPlan({}, options).IsMet());
}

// Least turning, which is what an operator without a gyroscope gets, shows its gains worse.
TEST(MakePlan, OrdersPosesSoThatTurnsShowTheGyroscope) {
  PlanOptions options = NineAxisPlan(16);
  const Plan plan = MustPlan({}, options);
  options.program = plan.program;
  options.program->poses = OrderForOperator(plan.program.poses, true);
  const Plan least_turning = MustPlan({}, options);
  double log_ratio = 0.0;
  int count = 0;
  for (const PlannedSigma& sigma : plan.sigmas) {
    if (sigma.group != "gyroscope.scale_error" && sigma.group != "gyroscope.misalignment_rad") {
      continue;
    }
    log_ratio += std::log(SigmaOf(least_turning, sigma.name) / sigma.after);
    ++count;
  }
  EXPECT_EQ(count, 9);
  EXPECT_GT(std::exp(log_ratio / count), 1.2);
}

TEST(MakePlan, AsksForTheRestThatTheNoiseOfAGyroscopeIsOf) {
  PlanOptions options = NineAxisPlan(12);
  options.rest_s = 0.0;
  const Result<Plan> plan = MakePlan({}, options);
  ASSERT_FALSE(plan);
  EXPECT_NE(plan.error().message.find("`plan: { rest_s: 5 }`"), std::string::npos);
}

}  // namespace plan_test
}  // namespace truetriad
