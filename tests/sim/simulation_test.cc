// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <map>

#include <gtest/gtest.h>

#include "io/temporary_folder.h"
#include "sim/scenario_samples.h"
#include "truetriad/calibrate/calibrate.h"
#include "truetriad/data/pose_collection.h"
#include "truetriad/io/recording.h"
#include "truetriad/sim/scenario.h"

namespace truetriad {
namespace simulation_test {

constexpr Triad kAccel = Triad::kAccelerometer;
constexpr Triad kGyro = Triad::kGyroscope;
constexpr Triad kMag = Triad::kMagnetometer;

/// All kinds of noise and trouble.
Scenario RoughScenario() {
  Scenario scenario = QuietScenario();
  for (auto& sensor : scenario.sensors) {
    sensor->spread = {.bias = 0.1, .scale = 0.01, .misalignment_rad = 0.01};
    sensor->noise.density.setConstant(0.002);
    sensor->noise.instability_sigma.setConstant(0.001);
    sensor->noise.random_walk.setConstant(1e-5);
  }
  scenario.sensors[kMag]->sampling.rate_hz = 25.0;
  scenario.sensors[kMag]->sampling.dropout = 0.1;
  scenario.temperature.profile = {TemperatureRamp{.to_degc = 40.0, .rate_degcps = 0.1}};
  scenario.temperature.thermometer_noise_degc = 0.1;
  scenario.count = 3;
  return scenario;
}

/// Poses by the rows of the true rests.
PoseSelection TrueRests(const Simulation& simulation, double rate_hz) {
  PoseSelection selection;
  selection.kind = PoseSelectionKind::kRanges;
  for (const TrueRest& rest : simulation.rests()) {
    const auto first = static_cast<std::int64_t>(std::ceil(rest.start_s * rate_hz - 1e-6));
    const auto last = static_cast<std::int64_t>(std::ceil(rest.end_s * rate_hz - 1e-6)) - 1;
    selection.ranges.push_back({first, last, {}, {}});
  }
  return selection;
}

TEST(Simulation, WithoutNoiseCalibratesToTheTruth) {
  const Scenario scenario = QuietScenario();
  const auto simulation = Simulate(scenario);
  Result<PoseSet> poses = CollectPoses(*simulation, TrueRests(*simulation, 100.0));
  ASSERT_TRUE(poses) << poses.error().message;
  ASSERT_EQ(poses->poses.size(), 24U);
  CalibrateOptions options;
  options.triads[kAccel].enabled = options.triads[kMag].enabled = true;
  for (const Triad triad : {kAccel, kMag}) {
    options.triads[triad].noise_sigma_raw = Eigen::Vector3d::Constant(1e-3);
    options.triads[triad].excess = ExcessNoise::kNone;
  }
  options.reference.field_ut = {scenario.world.field_ut, 0.0};
  const auto summary = Calibrate(*poses, options);
  ASSERT_TRUE(summary) << summary.error().message;
  const Calibration truth = TruthOf(scenario, 0);
  EXPECT_EQ(truth.gauge, Gauge::kAccelX);
  for (const Triad triad : {kAccel, kMag}) {
    ASSERT_TRUE(summary->calibration.sensors[triad]);
    const TriadModel<double>& found = summary->calibration.sensors[triad]->model;
    const TriadModel<double>& real = truth.sensors[triad]->model;
    // Rounding of readings of 50 uT times a condition number of about 1e3.
    EXPECT_LT((found.sensitivity - real.sensitivity).cwiseAbs().maxCoeff(), 1e-9);
    EXPECT_LT((found.bias - real.bias).cwiseAbs().maxCoeff(), 1e-9);
  }
}

TEST(Simulation, TruthListsEveryTermOfAUnitInTheOrderOfACalibration) {
  Scenario scenario = RoughScenario();
  for (auto& sensor : scenario.sensors) sensor.reset();
  SimulatedTriad& gyroscope = scenario.sensors[kGyro].emplace();
  gyroscope.unit = *ParseTriadUnit(kGyro, "rad/s");
  gyroscope.g_sensitivity = Eigen::Matrix3d::Zero();
  gyroscope.spread.axis_terms[AxisTerm::kAsymmetry] = 1e-4;
  ThermalTerms& thermal = gyroscope.thermal.emplace();
  thermal.bias = {Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  thermal.sensitivity = {Eigen::Matrix3d::Zero()};
  thermal.rate.items.fill(Eigen::Vector3d::Zero());
  const NamedCovariance covariance = TruthOf(scenario, 0).covariance;
  std::vector<std::string> groups;
  for (const std::string& name : covariance.parameters) {
    const std::string group = name.substr(0, name.rfind('.'));
    if (groups.empty() || groups.back() != group) groups.push_back(group);
  }
  EXPECT_EQ(groups,
            (std::vector<std::string>{"gyroscope.bias",
                                      "gyroscope.sensitivity",
                                      "gyroscope.thermal.bias.1",
                                      "gyroscope.thermal.bias.2",
                                      "gyroscope.thermal.rate.linear",
                                      "gyroscope.thermal.rate.quadratic",
                                      "gyroscope.thermal.rate.cross",
                                      "gyroscope.thermal.sensitivity.1",
                                      "gyroscope.asymmetry",
                                      "gyroscope.g_sensitivity"}));
  ASSERT_EQ(covariance.parameters.size(), 48U);
  EXPECT_EQ(covariance.parameters[40], "gyroscope.g_sensitivity.xy");
  EXPECT_TRUE(covariance.matrix.isZero(0.0));
  EXPECT_EQ(covariance.matrix.rows(), 48);
}

TEST(Simulation, FailsWithTheReadingThatIsBeyondAllNumbers) {
  Scenario scenario = StillScenario(1.0);
  Knock knock;
  knock.when.offset_s = 0.5;
  knock.duration_s = 0.04;  // At its peak with a sample at 100 Hz; gains are up to 1.02.
  knock.peak_mps2.setConstant(1.79e308);
  scenario.disturbances = {knock};
  const auto simulation = Simulate(scenario);
  std::vector<SampleBlock> blocks;
  const Result<bool> more = simulation->Next(&blocks);
  ASSERT_FALSE(more);
  EXPECT_NE(more.error().message.find("the accelerometer reads "), std::string::npos);
  EXPECT_NE(more.error().message.find("inf"), std::string::npos) << more.error().message;
}

TEST(Simulation, IsTheSameForTheSameSeedAndAnotherForAnotherUnit) {
  const Scenario scenario = RoughScenario();
  const Samples once = SamplesOf(scenario, kGyro, 1);
  const Samples again = SamplesOf(scenario, kGyro, 1);
  EXPECT_EQ(once.readings, again.readings);
  EXPECT_EQ(once.temperature_degc, again.temperature_degc);
  EXPECT_NE(once.readings, SamplesOf(scenario, kGyro, 2).readings);
  Scenario reseeded = scenario;
  ++reseeded.seed;
  EXPECT_NE(once.readings, SamplesOf(reseeded, kGyro, 1).readings);
  EXPECT_EQ(DrawUnit(scenario, 1).serial, "SIM0002");
}

TEST(Simulation, OneNoiseSwitchedOffLeavesTheDrawsOfTheOthers) {
  Scenario scenario = RoughScenario();
  for (auto& sensor : scenario.sensors) sensor->resolution_raw = 1e-9;
  const Samples all = SamplesOf(scenario, kAccel);
  scenario.sensors[kAccel]->noise.random_walk.setZero();
  scenario.sensors[kMag].reset();
  scenario.temperature.thermometer_noise_degc = 0.0;
  const Samples fewer = SamplesOf(scenario, kAccel);
  ASSERT_EQ(all.readings.size(), fewer.readings.size());
  // What is left is the random walk: zero at first, then 1e-5 * sqrt(t) with t up to 125 s.
  EXPECT_EQ(all.readings[0], fewer.readings[0]);
  for (std::size_t i = 0; i < all.readings.size(); ++i) {
    ASSERT_LT((all.readings[i] - fewer.readings[i]).norm(), 1e-3);
  }
}

/// Of a recording read to its end: what its wandering biases were on average, by truth and by the
/// readings, which are those of a unit without wander and the wander.
void ExpectTruthToStateTheMeanWander(const Scenario& wandering, bool over_rests) {
  Scenario steady = wandering;
  for (auto& sensor : steady.sensors) sensor->noise = {};
  const auto simulation = Simulate(wandering);
  std::vector<SampleBlock> blocks;
  while (*simulation->Next(&blocks)) {
  }
  for (const Triad triad : kTriads) {
    const Samples with = SamplesOf(wandering, triad), without = SamplesOf(steady, triad);
    ASSERT_EQ(with.readings.size(), without.readings.size());
    std::vector<Eigen::Vector3d> means;
    if (over_rests) {
      // All sensors have every row.
      for (const PoseRange& rest : simulation->rest_rows()) {
        Eigen::Vector3d sum = Eigen::Vector3d::Zero();
        for (std::int64_t row = rest.first; row <= rest.last; ++row) {
          const auto i = static_cast<std::size_t>(row);
          sum += with.readings[i] - without.readings[i];
        }
        means.emplace_back(sum / static_cast<double>(rest.last + 1 - rest.first));
      }
    } else {
      for (std::size_t i = 0; i < with.readings.size(); ++i)
        means.emplace_back(with.readings[i] - without.readings[i]);
    }
    Eigen::Vector3d expected = Eigen::Vector3d::Zero();
    for (const Eigen::Vector3d& mean : means) expected += mean / static_cast<double>(means.size());
    const Eigen::Vector3d stated = TruthOf(wandering, 0, *simulation).sensors[triad]->model.bias -
                                   TruthOf(wandering, 0).sensors[triad]->model.bias;
    EXPECT_GT(stated.norm(), 1e-5) << "nothing wandered: the test shows nothing";
    // Readings of 50 uT and 4e-16 of them, over thousands of sums.
    EXPECT_LT((stated - expected).cwiseAbs().maxCoeff(), 1e-11);
  }
}

TEST(Simulation, TruthStatesTheBiasesThatARecordingHadOnAverage) {
  Scenario scenario = QuietScenario();
  for (auto& sensor : scenario.sensors) {
    sensor->noise.instability_sigma.setConstant(0.001);
    sensor->noise.random_walk.setConstant(1e-4);
  }
  ExpectTruthToStateTheMeanWander(scenario, true);

  // Without rests it is that of all the minutes that were recorded, not of the rest they begin
  // with.
  scenario.motion = {TumbleStep{}};
  scenario.first_rest_s = 5.0;
  ExpectTruthToStateTheMeanWander(scenario, false);
}

TEST(Simulation, SharedRowsAreReadBackFromTheFileToTheBit) {
  const Scenario scenario = RoughScenario();
  const TemporaryFolder folder;
  const auto simulation = Simulate(scenario);
  EXPECT_TRUE(simulation->format().one_file);
  const Result<std::string> path =
      WriteRecording(*simulation, simulation->format(), folder.Path("out"));
  ASSERT_TRUE(path) << path.error().message;
  for (const std::string& opened : {*path, folder.Path("out/recording.csv")}) {
    auto recording = OpenRecording(opened);
    ASSERT_TRUE(recording) << recording.error().message;
    PerTriad<Samples> read;
    std::vector<SampleBlock> blocks;
    while (*(*recording)->Next(&blocks)) {
      for (const SampleBlock& block : blocks) {
        for (std::size_t i = 0; i < block.x.size(); ++i) {
          read[block.triad].time_ns.push_back(block.time_ns[i]);
          read[block.triad].readings.emplace_back(block.x[i], block.y[i], block.z[i]);
          read[block.triad].temperature_degc.push_back(block.temperature_degc[i]);
        }
      }
    }
    for (const Triad triad : kTriads) {
      const Samples samples = SamplesOf(scenario, triad);
      EXPECT_EQ(read[triad].time_ns, samples.time_ns) << TriadName(triad);
      EXPECT_EQ(read[triad].readings, samples.readings) << TriadName(triad);
      EXPECT_EQ(read[triad].temperature_degc, samples.temperature_degc) << TriadName(triad);
      EXPECT_EQ((*recording)->counts(triad).samples, simulation->counts(triad).samples);
      EXPECT_EQ((*recording)->counts(triad).dropped_empty, simulation->counts(triad).dropped_empty);
    }
  }
}

TEST(Simulation, SensorsWithClocksOfTheirOwnGetFilesOfTheirOwn) {
  Scenario scenario = RoughScenario();
  scenario.sensors[kMag]->sampling.rate_hz = 30.0;
  scenario.sensors[kGyro]->sampling.clock_offset_s = 0.0123;
  scenario.sensors[kGyro]->sampling.jitter_s = 1e-4;
  const TemporaryFolder folder;
  scenario.serial = "A 1";
  const auto simulation = Simulate(scenario, 1);
  EXPECT_FALSE(simulation->format().one_file);
  const Result<std::string> path =
      WriteRecording(*simulation, simulation->format(), folder.Path("out"));
  ASSERT_TRUE(path) << path.error().message;
  auto recording = OpenRecording(*path);
  ASSERT_TRUE(recording) << recording.error().message;
  EXPECT_EQ((*recording)->info().serial, "A 10002");
  std::vector<SampleBlock> blocks;
  Samples read;
  while (*(*recording)->Next(&blocks)) {
    for (const SampleBlock& block : blocks) {
      if (block.triad != kGyro) continue;
      for (std::size_t i = 0; i < block.x.size(); ++i) {
        read.time_ns.push_back(block.time_ns[i]);
        read.readings.emplace_back(block.x[i], block.y[i], block.z[i]);
      }
    }
  }
  const Samples samples = SamplesOf(scenario, kGyro, 1);
  EXPECT_EQ(read.time_ns, samples.time_ns);
  EXPECT_EQ(read.readings, samples.readings);
}

TEST(Sampling, JitterAndOffsetChangeTheReportedTimesAlone) {
  Scenario scenario = StillScenario(200.0);
  for (auto& sensor : scenario.sensors) {
    sensor->sampling.jitter_s = 1e-3;
    sensor->sampling.clock_offset_s = -0.5;
  }
  const Samples samples = SamplesOf(scenario, kAccel);
  double sum = 0.0;
  double squares = 0.0;
  const auto count = static_cast<double>(samples.time_ns.size());
  for (std::size_t i = 0; i < samples.time_ns.size(); ++i) {
    const double error_s =
        static_cast<double>(samples.time_ns[i]) * 1e-9 - 0.01 * static_cast<double>(i) + 0.5;
    sum += error_s / count;
    squares += error_s * error_s / count;
  }
  ASSERT_EQ(samples.time_ns.size(), 20'000U);
  EXPECT_NEAR(sum, 0.0, 4.0 * 1e-3 / std::sqrt(count));
  EXPECT_NEAR(std::sqrt(squares), 1e-3, 4.0 * 1e-3 / std::sqrt(2.0 * count));
}

TEST(Sampling, DropoutLosesItsShareOfTheSamples) {
  Scenario scenario = StillScenario(200.0);
  scenario.sensors[kGyro]->sampling.dropout = 0.2;
  const double count = 20'000.0;
  EXPECT_EQ(SamplesOf(scenario, kAccel).readings.size(), 20'000U);
  EXPECT_NEAR(static_cast<double>(SamplesOf(scenario, kGyro).readings.size()),
              0.8 * count,
              4.0 * std::sqrt(count * 0.8 * 0.2));
}

TEST(Sampling, StatesTheRowsOfRestsWhateverDropsOut) {
  Scenario scenario = QuietScenario();
  for (auto& sensor : scenario.sensors) sensor->sampling.dropout = 0.6;
  scenario.motion.push_back(TumbleStep{.duration_s = 5.0});
  const auto simulation = Simulate(scenario);
  std::map<std::int64_t, double> rates_radps;
  std::vector<SampleBlock> blocks;
  while (*simulation->Next(&blocks)) {
    for (const SampleBlock& block : blocks) {
      if (block.triad != kGyro) continue;
      for (std::size_t i = 0; i < block.row.size(); ++i) {
        rates_radps[block.row[i]] =
            Eigen::Vector3d(block.x[i], block.y[i], block.z[i]).lpNorm<Eigen::Infinity>();
      }
    }
  }
  const std::vector<PoseRange> rests = simulation->rest_rows();
  ASSERT_EQ(rests.size(), 24U);
  EXPECT_EQ(rests[3].id.substr(0, 1), "4");
  std::size_t still = 0, covered = 0;
  for (const auto& [row, rate_radps] : rates_radps) {
    const bool in_rest = std::any_of(rests.begin(), rests.end(), [row = row](const auto& rest) {
      return rest.first <= row && row <= rest.last;
    });
    covered += in_rest ? 1 : 0;
    still += rate_radps < 1e-9 ? 1 : 0;
    EXPECT_TRUE(!in_rest || rate_radps < 1e-9) << "row " << row;
  }
  // Nothing that is still is left out but one interval a rest.
  EXPECT_LE(still - covered, 24U);
}

TEST(Temperature, TermsFollowTheElementAndItsPlay) {
  Scenario scenario = StillScenario(1000.0);
  scenario.temperature.start_degc = 20.0;
  scenario.temperature.profile = {TemperatureRamp{.to_degc = 30.0, .rate_degcps = 0.1},
                                  TemperatureHold{200.0},
                                  TemperatureRamp{.to_degc = 20.0, .rate_degcps = 0.1}};
  scenario.temperature.hysteresis_degc = 0.5;
  ThermalTerms thermal;
  thermal.reference_degc = 20.0;
  thermal.bias = {Eigen::Vector3d(1.0, 0.0, 0.0)};
  thermal.rate[RateTerm::kLinear] = Eigen::Vector3d(0.0, 1.0, 0.0);
  scenario.sensors[kGyro]->thermal = thermal;
  const Samples samples = SamplesOf(scenario, kGyro);
  const auto at = [&samples](double time_s) {
    return samples.readings[static_cast<std::size_t>(std::lround(time_s * 100.0))];
  };
  EXPECT_NEAR(at(50.0).x(), 5.0 - 0.5, 1e-9);  // Half a degree behind on the way up …
  EXPECT_NEAR(at(50.0).y(), 0.1, 1e-12);
  EXPECT_NEAR(at(200.0).x(), 10.0 - 0.5, 1e-9);
  EXPECT_EQ(at(200.0).y(), 0.0);
  EXPECT_NEAR(at(305.0).x(), 9.5, 1e-9);        // … nothing while the play is used up …
  EXPECT_NEAR(at(350.0).x(), 5.0 + 0.5, 1e-9);  // … and half a degree behind on the way down.
  EXPECT_NEAR(samples.temperature_degc[5000], 25.0, 1e-12);
  EXPECT_NEAR(TruthOf(scenario, 0).sensors[kGyro]->thermal->range_degc[1], 30.0, 1e-12);
}

TEST(Temperature, SoaksRepeatTheMotionAndWaitForTheChamber) {
  Scenario scenario = QuietScenario();
  std::get<PosesStep>(scenario.motion[0]).poses.resize(3);
  scenario.temperature.start_degc = 20.0;
  scenario.temperature.soak_degc = {20.0, 50.0, -10.0};
  scenario.temperature.element_lag_s = 5.0;
  const auto simulation = Simulate(scenario);
  ASSERT_EQ(simulation->rests().size(), 9U);
  const std::array<double, 3> wanted = {20.0, 50.0, -10.0};
  for (std::size_t k = 0; k < 9; ++k) {
    // A ramp of 0.05 degC/s leaves the element 0.25 degC behind, less exp(-60 / 5) = 6e-6 of it.
    EXPECT_NEAR(simulation->rests()[k].element_degc, wanted[k / 3], 2e-6) << k;
  }
  // 9 rests of 4 s, 8 moves of 1.2 s, ramps of 30 and 60 degC, two waits of 60 s.
  EXPECT_NEAR(simulation->duration_s(), 36.0 + 9.6 + 600.0 + 1200.0 + 120.0, 1e-9);
}

TEST(Disturbances, ShowWhereTheyHappenAndNowhereElse) {
  Scenario scenario = QuietScenario();
  const Samples quiet_accel = SamplesOf(scenario, kAccel);
  const Samples quiet_mag = SamplesOf(scenario, kMag);
  const double second_rest_s = Simulate(scenario)->rests()[1].start_s;
  scenario.disturbances = {Knock{{2, 1.0}, 0.1, Eigen::Vector3d(5.0, 0.0, 0.0)},
                           MagnetPassing{{2, 2.0}, 1.0, Eigen::Vector3d(0.0, 0.0, 30.0)}};
  const Samples accel = SamplesOf(scenario, kAccel);
  const Samples mag = SamplesOf(scenario, kMag);
  double most_force = 0.0;
  double most_field = 0.0;
  for (std::size_t i = 0; i < accel.readings.size(); ++i) {
    const double time_s = static_cast<double>(accel.time_ns[i]) * 1e-9 - second_rest_s;
    const double force = (accel.readings[i] - quiet_accel.readings[i]).norm();
    const double field = (mag.readings[i] - quiet_mag.readings[i]).norm();
    EXPECT_EQ(force > 0.0, time_s > 1.0 + 1e-9 && time_s < 1.1 - 1e-9) << time_s;
    EXPECT_TRUE(field == 0.0 || (time_s > 2.0 && time_s < 3.0)) << time_s;
    most_force = std::max(most_force, force);
    most_field = std::max(most_field, field);
  }
  EXPECT_NEAR(most_force, 5.0 * 1.02, 0.1);  // The gain of the x axis.
  EXPECT_NEAR(most_field, 30.0, 3.0);
}

TEST(Disturbances, StuckSamplesRepeatAndUnsettledPosesCreep) {
  Scenario scenario = QuietScenario();
  for (auto& sensor : scenario.sensors) sensor->noise.density.setConstant(1e-3);
  scenario.disturbances = {StuckSamples{kGyro, {std::nullopt, 1.0}, 0.5},
                           UnsettledPose{2, Eigen::Vector3d(0.1, 0.0, 0.0), 0.2}};
  const Samples gyro = SamplesOf(scenario, kGyro);
  for (std::size_t i = 100; i < 150; ++i) EXPECT_EQ(gyro.readings[i], gyro.readings[99]);
  EXPECT_NE(gyro.readings[150], gyro.readings[99]);

  const auto simulation = Simulate(scenario);
  const TrueRest& rest = simulation->rests()[1];
  const Eigen::Quaterniond begin = simulation->WorldFromBody(rest.start_s);
  const Eigen::Quaterniond end = simulation->WorldFromBody(rest.end_s);
  EXPECT_NEAR(begin.angularDistance(rest.intended_world_from_body), 0.1, 1e-7);
  EXPECT_LT(end.angularDistance(rest.intended_world_from_body), 1e-6);
}

TEST(DrawUnit, SpreadsAsStatedAndTruthSaysWhichFrameItIsIn) {
  Scenario scenario = QuietScenario();
  scenario.count = 2000;
  scenario.sensors[kAccel]->spread = {.bias = 0.1, .scale = 0.01, .misalignment_rad = 0.02};
  const TriadModel<double>& nominal = scenario.sensors[kAccel]->nominal;
  double bias = 0.0;
  double scale = 0.0;
  double misalignment = 0.0;
  for (int index = 0; index < scenario.count; ++index) {
    const TriadModel<double> model = DrawUnit(scenario, index).triads[kAccel]->model;
    bias += std::pow((model.bias.x() - nominal.bias.x()) / 1.02, 2) / scenario.count;
    scale += std::pow(model.sensitivity(2, 2) / 1.01 - 1.0, 2) / scenario.count;
    misalignment += std::pow(model.sensitivity(0, 1) / model.sensitivity(0, 0), 2) / scenario.count;
  }
  // Four sigma of a standard deviation: 4 / sqrt(2 n).
  const double relative = 4.0 / std::sqrt(2.0 * scenario.count);
  EXPECT_NEAR(std::sqrt(bias), 0.1, 0.1 * relative);
  EXPECT_NEAR(std::sqrt(scale), 0.01, 0.01 * relative);
  EXPECT_NEAR(std::sqrt(misalignment), 0.02, 0.02 * relative);
  EXPECT_EQ(TruthOf(scenario, 0).gauge, Gauge::kFixture);
  EXPECT_EQ(TruthOf(scenario, 0).outcome, Outcome::kConverged);
}

}  // namespace simulation_test
}  // namespace truetriad
