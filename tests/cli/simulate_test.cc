// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cli/command_line_run.h"
#include "truetriad/io/calibration_file.h"

namespace truetriad {
namespace simulate_test {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::StartsWith;

const std::string kScenarios = TRUETRIAD_SOURCE_DIR "/configs/scenarios/";
const std::string kDatasets = TRUETRIAD_SOURCE_DIR "/datasets/";
const std::string kExperiments = TRUETRIAD_SOURCE_DIR "/configs/experiments/";
const std::vector<std::string> kUnitFiles = {
    "recording.yaml", "recording.csv", "truth.yaml", "attitudes.csv", "poses.yaml"};

class SimulateVerb : public ::testing::Test {
 protected:
  Finished Simulate(const std::string& config,
                    const std::string& output,
                    const std::vector<std::string>& more = {}) {
    std::vector<std::string> arguments = {
        "simulate", "--config=" + config, "--output=" + folder_.Path(output)};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return RunTruetriad(arguments);
  }
  std::string Read(const std::string& name) { return TemporaryFolder::Read(folder_.Path(name)); }

  TemporaryFolder folder_;
};

/// From the scenario to the corrected log: what bends an axis is estimated, compared, exported,
/// taken out again and foretold of other readings.
TEST_F(SimulateVerb, GivesACubicTermThatEveryVerbKnows) {
  const Finished simulated =
      Simulate(kScenarios + "consumer-9dof.yaml",
               "unit",
               {"--set=sensors.accelerometer.cubic_ug_g3=[20000, -30000, 15000]"});
  ASSERT_EQ(simulated.exit_code, 0) << simulated.err;
  const std::string recording = "--input=" + folder_.Path("unit/recording.yaml");
  const std::string calibration = folder_.Path("result/calibration.yaml");
  const Finished calibrated = RunTruetriad({"calibrate",
                                            "--config=" + kExperiments + "joint.yaml",
                                            recording,
                                            "--set=sensors.accelerometer.cubic=auto",
                                            "--output=" + folder_.Path("result")});
  ASSERT_EQ(calibrated.exit_code, 0) << calibrated.out << calibrated.err;
  EXPECT_THAT(calibrated.out, AllOf(HasSubstr("cubic term"), HasSubstr("µg/g³")));
  const Finished compared =
      RunTruetriad({"compare", "--a=" + folder_.Path("unit/truth.yaml"), "--b=" + calibration});
  EXPECT_EQ(compared.exit_code, 0) << compared.err;
  EXPECT_THAT(compared.out, AllOf(StartsWith("AGREE"), HasSubstr("accelerometer.cubic.x")));
  const Finished evaluated = RunTruetriad({"evaluate", "--calibration=" + calibration, recording});
  EXPECT_EQ(evaluated.exit_code, 0) << evaluated.out << evaluated.err;
  const Finished exported = RunTruetriad({"export",
                                          "--calibration=" + calibration,
                                          "--to=kalibr-result",
                                          "--output=" + folder_.Path("kalibr.yaml")});
  EXPECT_THAT(exported.out + exported.err, HasSubstr("dropped: cubic term"));
}

/// `compare` prints AGREE when χ² of the differences has p >= 0.01; seeds are fixed.
TEST_F(SimulateVerb, GivesARecordingThatCalibratesToItsTruth) {
  const Finished run = Simulate(kScenarios + "consumer-9dof.yaml", "unit");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.err, IsEmpty());
  EXPECT_THAT(run.out, HasSubstr(folder_.Path("unit/recording.yaml")));
  for (const std::string recording : {"recording.yaml", "recording.csv"}) {
    const Finished calibrate = RunTruetriad({"calibrate",
                                             "--config=" + kExperiments + "joint.yaml",
                                             "--input=" + folder_.Path("unit/" + recording),
                                             "--output=" + folder_.Path("result")});
    EXPECT_EQ(calibrate.exit_code, 0) << calibrate.out << calibrate.err;
    const Finished compare = RunTruetriad({"compare",
                                           "--a=" + folder_.Path("unit/truth.yaml"),
                                           "--b=" + folder_.Path("result/calibration.yaml")});
    EXPECT_EQ(compare.exit_code, 0) << compare.err;
    EXPECT_THAT(compare.out, StartsWith("AGREE"));
  }
}

TEST_F(SimulateVerb, GivesAttitudesThatAFixtureCouldHaveStated) {
  ASSERT_EQ(Simulate(kScenarios + "consumer-9dof.yaml", "unit").exit_code, 0);
  const Finished run = RunTruetriad({"calibrate",
                                     "--config=" + kExperiments + "turntable.yaml",
                                     "--input=" + folder_.Path("unit/recording.csv"),
                                     "--output=" + folder_.Path("result"),
                                     "--set=attitudes.file=" + folder_.Path("unit/attitudes.csv")});
  EXPECT_EQ(run.exit_code, 0) << run.out << run.err;
  const Finished compare = RunTruetriad({"compare",
                                         "--a=" + folder_.Path("unit/truth.yaml"),
                                         "--b=" + folder_.Path("result/calibration.yaml")});
  EXPECT_THAT(compare.out, StartsWith("AGREE"));
}

/// A gyroscope alone on a table whose rate is known but not its axis, and the same beside the other
/// sensors: the body frame of the first is its own.
TEST_F(SimulateVerb, GivesATableOfKnownRateInUnknownAttitudes) {
  ASSERT_EQ(Simulate(kScenarios + "turntable-attitudes.yaml", "table").exit_code, 0);
  const std::string config = "--config=" + kExperiments + "rates-without-axis.yaml";
  const std::string recording = "--input=" + folder_.Path("table/recording.yaml");
  const std::string rates = "--set=rates.file=" + folder_.Path("table/rates.yaml");
  const Finished run =
      RunTruetriad({"calibrate", config, recording, rates, "--output=" + folder_.Path("result")});
  ASSERT_EQ(run.exit_code, 0) << run.out << run.err;
  EXPECT_THAT(run.out, HasSubstr("accel-x, led by the gyroscope"));
  const auto found = ReadCalibration(folder_.Path("result/calibration.yaml"));
  const auto truth = ReadCalibration(folder_.Path("table/truth.yaml"));
  ASSERT_TRUE(found && truth);
  // What no frame changes: S transpose(S), by five of its σ, twice a gain's.
  const TriadCalibration& gyroscope = *found->sensors[Triad::kGyroscope];
  const Eigen::Matrix3d& S = gyroscope.model.sensitivity;
  const Eigen::Matrix3d& T = truth->sensors[Triad::kGyroscope]->model.sensitivity;
  const double sigma = 2.0 * gyroscope.sensitivity_sigma.maxCoeff();
  EXPECT_LT((S * S.transpose() - T * T.transpose()).cwiseAbs().maxCoeff(), 5.0 * sigma);
  EXPECT_LT(sigma, 5e-4);

  const Finished missing = RunTruetriad({"calibrate",
                                         config,
                                         recording,
                                         rates + ",gauge=fixture",
                                         "--output=" + folder_.Path("fixture")});
  EXPECT_EQ(missing.exit_code, 2);
  EXPECT_THAT(missing.err, HasSubstr("known axes of rates"));
}

TEST_F(SimulateVerb, SaysThatARateHasNoAxis) {
  ASSERT_EQ(Simulate(kScenarios + "turntable-attitudes.yaml", "table").exit_code, 0);
  const std::string rates =
      folder_.Write("rates.yaml", "rates:\n  - { first: 100, last: 300, degps: 100 }\n");
  const Finished run = RunTruetriad({"calibrate",
                                     "--config=" + kExperiments + "rates-without-axis.yaml",
                                     "--input=" + folder_.Path("table/recording.yaml"),
                                     "--set=rates.file=" + rates + ",rates.axes=known",
                                     "--output=" + folder_.Path("result")});
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err, AllOf(HasSubstr("rates.yaml:2: "), HasSubstr("axes: unknown")));
}

/// Without its accelerometer the demo's magnetometer leads, at rest and in motion.
TEST_F(SimulateVerb, GivesMagnetometerAndGyroscopeThatDoWithoutAccelerometer) {
  ASSERT_EQ(
      Simulate(kScenarios + "consumer-9dof.yaml", "unit", {"--set=sensors.accelerometer=none"})
          .exit_code,
      0);
  const Finished run = RunTruetriad({"calibrate",
                                     "--config=" + kExperiments + "magnetometer-gyroscope.yaml",
                                     "--input=" + folder_.Path("unit/recording.yaml"),
                                     "--output=" + folder_.Path("result")});
  ASSERT_EQ(run.exit_code, 0) << run.out << run.err;
  const Finished compare = RunTruetriad({"compare",
                                         "--a=" + folder_.Path("unit/truth.yaml"),
                                         "--b=" + folder_.Path("result/calibration.yaml")});
  EXPECT_THAT(compare.out, StartsWith("AGREE"));
}

/// What is shipped is what the scenarios say; datasets/README.md has the commands.
TEST_F(SimulateVerb, GivesTheShippedRecordingsToTheByte) {
  for (const auto& [dataset, scenario] :
       {std::pair("demo", "consumer-9dof"), std::pair("counts", "mti-like-counts")}) {
    const Finished run = Simulate(kScenarios + scenario + ".yaml", dataset);
    ASSERT_EQ(run.exit_code, 0) << run.err;
    for (const std::string& file : kUnitFiles) {
      const std::string shipped = TemporaryFolder::Read(kDatasets + dataset + "/" + file);
      // Not compared by a macro: a difference would print megabytes.
      EXPECT_TRUE(shipped == Read(std::string(dataset) + "/" + file)) << dataset << "/" << file;
    }
  }
}

TEST_F(SimulateVerb, ShipsRawCountsThatCalibrateToTheirTruth) {
  const std::string experiment =
      folder_.Write("counts.yaml",
                    "experiment: 1\n"
                    "sensors: { accelerometer: { model: full, preset: " TRUETRIAD_SOURCE_DIR
                    "/configs/sensors/mti-like-counts.yaml } }\n");
  const Finished calibrate = RunTruetriad({"calibrate",
                                           "--config=" + experiment,
                                           "--input=" + kDatasets + "counts/recording.yaml",
                                           "--output=" + folder_.Path("result")});
  EXPECT_EQ(calibrate.exit_code, 0) << calibrate.out << calibrate.err;
  const Finished compare = RunTruetriad({"compare",
                                         "--a=" + kDatasets + "counts/truth.yaml",
                                         "--b=" + folder_.Path("result/calibration.yaml")});
  EXPECT_EQ(compare.exit_code, 0) << compare.err;
  EXPECT_THAT(compare.out, StartsWith("AGREE"));
}

TEST_F(SimulateVerb, GivesTheSameBytesWhateverTheThreads) {
  for (const std::string threads : {"1", "3"}) {
    const Finished run =
        Simulate(kScenarios + "fleet.yaml", "fleet" + threads, {"--jobs=" + threads});
    ASSERT_EQ(run.exit_code, 0) << run.err;
    EXPECT_THAT(run.err, IsEmpty());
  }
  std::string previous;
  for (const std::string unit : {"B0001", "B0002", "B0003", "B0004", "B0005"}) {
    for (const std::string& file : kUnitFiles) {
      const std::string text = Read("fleet1/" + unit + "/" + file);
      EXPECT_THAT(text.size(), ::testing::Gt(100U));
      EXPECT_EQ(text, Read("fleet3/" + unit + "/" + file)) << unit << " " << file;
    }
    const std::string truth = Read("fleet1/" + unit + "/truth.yaml");
    EXPECT_NE(truth, previous);
    previous = truth;
  }
}

TEST_F(SimulateVerb, DrawsAnotherUnitWithAnotherSeed) {
  ASSERT_EQ(Simulate(kScenarios + "fleet.yaml", "a", {"--set=count=1"}).exit_code, 0);
  ASSERT_EQ(Simulate(kScenarios + "fleet.yaml", "b", {"--set=count=1,seed=9"}).exit_code, 0);
  EXPECT_NE(Read("a/truth.yaml"), Read("b/truth.yaml"));
  EXPECT_NE(Read("a/recording.csv"), Read("b/recording.csv"));
}

TEST_F(SimulateVerb, RunsEveryShippedScenario) {
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(kScenarios)) {
    const std::string name = entry.path().stem().string();
    const Finished run = Simulate(entry.path().string(), name);
    EXPECT_EQ(run.exit_code, 0) << name << ": " << run.err;
    if (run.exit_code != 0 || name == "fleet") continue;
    const auto truth = ReadCalibration(folder_.Path(name + "/truth.yaml"));
    EXPECT_TRUE(truth) << truth.error().message;
    // Several sessions have a folder each.
    const std::string first = folder_.Path(name + "/session-1");
    const std::string folder = std::filesystem::exists(first) ? first : folder_.Path(name);
    const Finished inspect = RunTruetriad({"inspect", "--input=" + folder + "/recording.yaml"});
    // Tumbling has no rests to speak of, which `inspect` says with 3.
    EXPECT_THAT(inspect.exit_code, ::testing::AnyOf(0, 3)) << name << ": " << inspect.err;
    ++count;
  }
  EXPECT_GE(count, 9);
}

TEST_F(SimulateVerb, LeavesNothingBehindWhenTheScenarioIsWrong) {
  const std::string scenario = folder_.Write("wrong.yaml",
                                             "scenario: 1\n"
                                             "sensors:\n"
                                             "  accelerometer: { sampling: { rate_hz: 0 } }\n"
                                             "motion: [{ poses: { attitudes: six_faces } }]\n");
  const Finished run = Simulate(scenario, "out");
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.out, IsEmpty());
  EXPECT_THAT(run.err,
              AllOf(HasSubstr("wrong.yaml:3: sensors.accelerometer.sampling.rate_hz"),
                    HasSubstr("wrong.yaml:4: motion[0].poses.attitudes")));
  EXPECT_FALSE(std::filesystem::exists(folder_.Path("out")));
}

TEST_F(SimulateVerb, RefusesWhatNoDiskHasRoomFor) {
  // A rest of two years at 100 kHz, of 9999 units.
  const std::string scenario =
      folder_.Write("huge.yaml",
                    "scenario: 1\n"
                    "count: 9999\n"
                    "sensors: { accelerometer: { sampling: { rate_hz: 1.0e+5 } } }\n"
                    "motion: [{ poses: { attitudes: { spread: 1 }, rest_s: 7.0e+7 } }]\n");
  const Finished run = Simulate(scenario, "out");
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err, AllOf(HasSubstr("7e+16 rows"), HasSubstr("are free")));
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder_.Path("out")), {}), 0);
}

TEST_F(SimulateVerb, LeavesNothingBehindWhenItIsInterrupted) {
  // Two weeks of readings take a minute; the signal comes once they have been begun.
  const std::string output = folder_.Path("out");
  const Finished run = RunShell("{ '" TRUETRIAD_BINARY "' simulate --config='" + kScenarios +
                                "tactical-6dof.yaml' --output='" + output +
                                "' --set='motion=[{poses: {attitudes: cube, rest_s: 50000}}]' & "
                                "await '[ -n \"$(find \"" +
                                output +
                                "\" -type f)\" ]'; "
                                "kill -TERM $!; wait $!; echo $?; }");
  EXPECT_EQ(run.out, "143\n");
  EXPECT_TRUE(!std::filesystem::exists(output) || std::filesystem::is_empty(output));
}

TEST_F(SimulateVerb, GivesASoakThatCalibratesToItsTruth) {
  // settle_s in lags of the thermometer: ten, as shipped, and two, of which the poses at each
  // temperature tell.
  for (const auto& [settle, is_settled] : {std::pair("600", true), std::pair("120", false)}) {
    ASSERT_EQ(Simulate(kScenarios + "thermal-soak.yaml",
                       "soak",
                       {std::string("--set=temperature.settle_s=") + settle})
                  .exit_code,
              0);
    const Finished calibrate = RunTruetriad({"calibrate",
                                             "--config=" + kExperiments + "thermal-soak.yaml",
                                             "--input=" + folder_.Path("soak/recording.yaml"),
                                             "--set=poses.file=" + folder_.Path("soak/poses.yaml"),
                                             "--output=" + folder_.Path("found")});
    EXPECT_EQ(calibrate.exit_code, 0) << calibrate.out << calibrate.err;
    const Finished compare = RunTruetriad({"compare",
                                           "--a=" + folder_.Path("soak/truth.yaml"),
                                           "--b=" + folder_.Path("found/calibration.yaml")});
    const auto shared = HasSubstr("the bias differs between temperatures by");
    if (is_settled) {
      EXPECT_THAT(compare.out, StartsWith("AGREE"));
      EXPECT_THAT(calibrate.out, Not(shared));
    } else {
      EXPECT_THAT(calibrate.out, shared);
    }
  }
}

// Turns between rests at one temperature are found among those of all.
TEST_F(SimulateVerb, GivesASoakOfAGyroscopeWhoseTermsAreChosen) {
  ASSERT_EQ(Simulate(kScenarios + "thermal-soak.yaml", "soak").exit_code, 0);
  const Finished run = RunTruetriad(
      {"calibrate",
       "--config=" + kExperiments + "thermal-soak.yaml",
       "--input=" + folder_.Path("soak/recording.yaml"),
       "--set=poses.file=" + folder_.Path("soak/poses.yaml") +
           ",sensors.gyroscope.thermal={ bias_order: auto, matrix_order: auto, rate: auto }",
       "--output=" + folder_.Path("found")});
  ASSERT_EQ(run.exit_code, 0) << run.out << run.err;
  EXPECT_THAT(run.out, HasSubstr("Over temperature"));
  const auto found = ReadCalibration(folder_.Path("found/calibration.yaml"));
  ASSERT_TRUE(found) << found.error().message;
  // The unit's own: a parabola and gains, a straight line and gains.
  EXPECT_THAT(found->quality.rests.model_choice.front().description,
              StartsWith("accelerometer full, bias of order 2 in tau, matrix of order 1 "
                         "in tau, matrix diagonal in tau; gyroscope full, bias of order "
                         "1 in tau, matrix of order 1 in tau"));
  EXPECT_THAT(found->config_yaml, HasSubstr("bias_order: 2  # chosen by auto"));
  EXPECT_EQ(found->quality.rests.temperature_settings.size(), 10U);
  const Finished compare = RunTruetriad({"compare",
                                         "--a=" + folder_.Path("soak/truth.yaml"),
                                         "--b=" + folder_.Path("found/calibration.yaml")});
  EXPECT_THAT(compare.out, StartsWith("AGREE")) << compare.out;
}

TEST_F(SimulateVerb, GivesARateTableThatCalibratesToItsTruth) {
  // A bias that drifts is no truth to compare with.
  ASSERT_EQ(Simulate(kScenarios + "turntable-rates.yaml",
                     "table",
                     {"--set=sensors.gyroscope.noise.bias_instability_degph=0"})
                .exit_code,
            0);
  const Finished calibrate = RunTruetriad({"calibrate",
                                           "--config=" + kExperiments + "rate-table.yaml",
                                           "--input=" + folder_.Path("table/recording.yaml"),
                                           "--set=rates.file=" + folder_.Path("table/rates.yaml") +
                                               ",turns.file=" + folder_.Path("table/turns.yaml"),
                                           "--output=" + folder_.Path("found")});
  ASSERT_EQ(calibrate.exit_code, 0) << calibrate.out << calibrate.err;
  EXPECT_THAT(calibrate.out, HasSubstr("predicted only"));
  const Finished compare = RunTruetriad({"compare",
                                         "--a=" + folder_.Path("table/truth.yaml"),
                                         "--b=" + folder_.Path("found/calibration.yaml")});
  EXPECT_THAT(compare.out, StartsWith("AGREE")) << compare.out << compare.err;
  const auto found = ReadCalibration(folder_.Path("found/calibration.yaml"));
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_EQ(found->gauge, Gauge::kFixture);
  ASSERT_EQ(found->quality.rests.turns.size(), 1U);
  const TurnCheck& turn = found->quality.rests.turns.front();
  EXPECT_NEAR(turn.found_rad, turn.stated_rad, 4.0 * turn.found_sigma_rad);
}

TEST_F(SimulateVerb, GivesARateTableWhoseRampsAreNoRates) {
  ASSERT_EQ(Simulate(kScenarios + "turntable-rates.yaml", "table").exit_code, 0);
  std::string rates = Read("table/rates.yaml");
  const std::size_t at = rates.find("first: 151,");
  ASSERT_NE(at, std::string::npos) << rates;
  // A fifth of a second of the ramp.
  rates.replace(at, 11, "first: 141,");
  folder_.Write("rates.yaml", rates);
  const Finished run = RunTruetriad({"calibrate",
                                     "--config=" + kExperiments + "rate-table.yaml",
                                     "--input=" + folder_.Path("table/recording.yaml"),
                                     "--set=rates.file=" + folder_.Path("rates.yaml") +
                                         ",turns.file=" + folder_.Path("table/turns.yaml"),
                                     "--output=" + folder_.Path("found")});
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err,
              AllOf(HasSubstr("rates.yaml"),
                    HasSubstr("the first eighth of its time"),
                    HasSubstr("begin its interval later")));
  EXPECT_FALSE(std::filesystem::exists(folder_.Path("found")));
}

TEST_F(SimulateVerb, StatesRestsThatInspectTakesAsPoses) {
  ASSERT_EQ(Simulate(kScenarios + "thermal-soak.yaml", "soak").exit_code, 0);
  const Finished run = RunTruetriad({"inspect",
                                     "--input=" + folder_.Path("soak/recording.yaml"),
                                     "--poses=file:" + folder_.Path("soak/poses.yaml")});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  // Twelve attitudes at each of five temperatures.
  EXPECT_THAT(run.out, HasSubstr("60 poses by given row ranges"));
}

TEST_F(SimulateVerb, TruthOfASoakIsComparedInEveryTermOfItsCalibration) {
  // The thermometer follows at once: a late one would have the calibration about other
  // temperatures.
  ASSERT_EQ(Simulate(kScenarios + "thermal-soak.yaml",
                     "soak",
                     {"--set=temperature.element_lag_s=0,temperature.thermometer_lag_s=0"})
                .exit_code,
            0);
  const std::string experiment = folder_.Write(
      "soak.yaml",
      "experiment: 1\nreference: { gravity_mps2: 9.80665, temperature_degc: 25 }\nposes: { file: "
      "soak/poses.yaml }\n"
      "sensors: { accelerometer: { thermal: { bias_order: 2, matrix_order: 1 } } }\n");
  const Finished calibrated = RunTruetriad({"calibrate",
                                            "--config=" + experiment,
                                            "--input=" + folder_.Path("soak/recording.yaml"),
                                            "--output=" + folder_.Path("found")});
  ASSERT_EQ(calibrated.exit_code, 0) << calibrated.err;
  const auto found = ReadCalibration(folder_.Path("found/calibration.yaml"));
  ASSERT_TRUE(found) << found.error().message;
  // 12 at the reference, 6 of bias and 9 of gain over temperature.
  EXPECT_EQ(found->covariance.parameters.size(), 27U);
  const Finished compared = RunTruetriad({"compare",
                                          "--a=" + folder_.Path("soak/truth.yaml"),
                                          "--b=" + folder_.Path("found/calibration.yaml")});
  EXPECT_EQ(compared.exit_code, 0) << compared.err;
  EXPECT_THAT(compared.out, HasSubstr("AGREE")) << compared.out;
  for (const std::string& name : found->covariance.parameters) {
    EXPECT_THAT(compared.out, HasSubstr(name));
  }
}

TEST_F(SimulateVerb, LeavesNothingPartialWhenAFileCannotBeWritten) {
  // The folder of the third unit is taken by a file.
  std::filesystem::create_directories(folder_.Path("fleet"));
  folder_.Write("fleet/B0003", "in the way");
  const Finished run = Simulate(kScenarios + "fleet.yaml", "fleet");
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err, HasSubstr("B0003"));
  EXPECT_EQ(Read("fleet/B0003"), "in the way");
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder_.Path("fleet")), {}), 1);
}

TEST_F(SimulateVerb, ReplacesNeitherItsScenarioNorItsPoseProgram) {
  const std::string program = "program: 1\nposes: [{ attitude: [1, 0, 0, 0] }]\n";
  const std::string text =
      "scenario: 1\nsensors: { accelerometer: {} }\n"
      "motion: [{ poses: { attitudes: { file: poses.yaml } } }]\n";
  folder_.Write("poses.yaml", program);
  const Finished beside = Simulate(folder_.Write("scenario.yaml", text), ".");
  EXPECT_EQ(beside.exit_code, 1);
  EXPECT_THAT(beside.err, HasSubstr("poses.yaml: would be overwritten"));
  EXPECT_EQ(Read("poses.yaml"), program);
  const Finished over = Simulate(folder_.Write("truth.yaml", text), ".");
  EXPECT_EQ(over.exit_code, 1);
  EXPECT_THAT(over.err, HasSubstr("truth.yaml: would be overwritten"));
  EXPECT_EQ(Read("truth.yaml"), text);
}

TEST_F(SimulateVerb, RefusesThreadsThatAreNone) {
  const Finished run = Simulate(kScenarios + "fleet.yaml", "fleet", {"--jobs=-1"});
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_THAT(run.err, HasSubstr("--jobs=-1"));
}

}  // namespace simulate_test
}  // namespace truetriad
