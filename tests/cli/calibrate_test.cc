// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <ostream>
#include <set>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include "cli/command_line_run.h"
#include "support/log_writer.h"

namespace truetriad {
namespace calibrate_test {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

class CalibrateVerb : public ::testing::Test {
 protected:
  Finished Calibrate(const std::string& log_text, const std::vector<std::string>& more = {}) {
    log_ = folder_.Write("log.csv", log_text);
    const std::string config = folder_.Write("experiment.yaml", kAccelerometerExperiment);
    std::vector<std::string> arguments = {
        "calibrate", "--config=" + config, "--input=" + log_, "--output=" + folder_.Path("result")};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return RunTruetriad(arguments);
  }
  YAML::Node Written() const { return YAML::LoadFile(folder_.Path("result/calibration.yaml")); }
  bool HasReport() const { return std::filesystem::exists(folder_.Path("result/report.html")); }

  TemporaryFolder folder_;
  std::string log_;
};

const LogOptions kEnough{.rests = 16, .magnetometer = false};

TEST_F(CalibrateVerb, FindsTheUnitThatMadeTheLog) {
  const Finished run = Calibrate(LogText(kEnough));
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.err, IsEmpty());
  EXPECT_THAT(run.out,
              AllOf(HasSubstr("NO LIMITS SET"),
                    HasSubstr(folder_.Path("result/calibration.yaml")),
                    HasSubstr(folder_.Path("result/report.html"))));
  EXPECT_TRUE(HasReport());
  const YAML::Node written = Written();
  EXPECT_EQ(written["device"]["serial"].as<std::string>(), "T1");
  EXPECT_EQ(written["inputs"][0]["file"].as<std::string>(), log_);
  const YAML::Node sensor = written["sensors"]["accelerometer"];
  for (int i = 0; i < 3; ++i) {
    const double bias = sensor["bias"][i].as<double>();
    const double sigma = sensor["sigma"]["bias"][i].as<double>();
    // 5 sigma: by chance once in two million; the seed is fixed.
    EXPECT_NEAR(bias, LoggedAccelerometer().bias[i], 5.0 * sigma);
    // The mean of 2 s at 50 Hz with 0.02 m/s^2 a sample has 0.002; 16 poses cannot be much worse.
    EXPECT_LT(sigma, 0.004);
  }
}

TEST_F(CalibrateVerb, WritesTheSameBytesForTheSameInput) {
  const std::string folder = "SOURCE_DATE_EPOCH=1700000000 '" TRUETRIAD_BINARY "' calibrate ";
  const std::string log = folder_.Write("log.csv", LogText(kEnough));
  const std::string config = folder_.Write("experiment.yaml", kAccelerometerExperiment);
  for (const char* output : {"a", "b"}) {
    const Finished run = RunShell(folder + "--config='" + config + "' --input='" + log +
                                  "' --output='" + folder_.Path(output) + "'");
    EXPECT_EQ(run.exit_code, 0) << run.err;
  }
  for (const char* file : {"/calibration.yaml", "/report.html"}) {
    const std::string text = TemporaryFolder::Read(folder_.Path("a") + file);
    EXPECT_FALSE(text.empty());
    EXPECT_EQ(text, TemporaryFolder::Read(folder_.Path("b") + file));
  }
}

/// An Allan result in milli-g: density 0.3 mg/sqrt(Hz), floor 0.664 * 0.1 mg.
std::string AllanText(const std::string& unit) {
  std::string text =
      "format: truetriad/allan/1\nsource: rest.csv\nserial: T1\ninputs: []\n"
      "sensors:\n  accelerometer:\n    unit: \"" +
      unit +
      "\"\n    rate_hz: 50\n    samples: 360000\n    duration_s: 7200\n    filled_samples: 0\n"
      "    breaks: 0\n    warnings: []\n    axes:\n";
  for (const char* axis : {"x", "y", "z"}) {
    text +=
        std::string("      ") + axis +
        ":\n        noise_density: { value: 0.3, low: 0.29, high: 0.31, unit: \"" + unit +
        "/sqrt(Hz)\" }\n        bias_instability: { value: 0.1, low: 0.09, high: 0.11, unit: \"" +
        unit +
        "\", minimum: { value: 0.0664, low: 0.06, high: 0.073 }, tau_s: 50, at_end: false }\n"
        "        points: []\n";
  }
  return text;
}

TEST_F(CalibrateVerb, WeighsPosesByAnAllanResultInTheRecordingsUnit) {
  const std::string allan = folder_.Write("allan.yaml", AllanText("mg"));
  const Finished run =
      Calibrate(LogText(kEnough), {"--set=sensors.accelerometer.noise={ allan: allan.yaml }"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("from an Allan deviation"));
  const YAML::Node noise = Written()["sensors"]["accelerometer"]["noise"];
  EXPECT_EQ(noise["source"].as<std::string>(), "allan");
  // Rests of 2.5 s, of which detection keeps 1.5 s to all.
  const double mg = 9.80665e-3;
  EXPECT_GT(noise["sigma"][0].as<double>(), mg * std::hypot(0.3 / std::sqrt(2.6), 0.0664));
  EXPECT_LT(noise["sigma"][0].as<double>(), mg * std::hypot(0.3 / std::sqrt(1.5), 0.0665));
  // The experiment inside the result still says where the noise came from.
  EXPECT_THAT(TemporaryFolder::Read(folder_.Path("result/calibration.yaml")),
              HasSubstr("allan: \"allan.yaml\""));
}

TEST_F(CalibrateVerb, RefusesAnAllanResultInCountsForARecordingInUnits) {
  const std::string allan = folder_.Write("allan.yaml", AllanText("counts"));
  const Finished run =
      Calibrate(LogText(kEnough), {"--set=sensors.accelerometer.noise={ allan: allan.yaml }"});
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err, AllOf(HasSubstr(allan), HasSubstr("counts cannot be converted")));
}

TEST_F(CalibrateVerb, RefusesTheAllanResultOfAUnitThatWasNotAtRest) {
  const std::string text =
      "format: truetriad/allan/1\nsource: rest.csv\nserial: T1\ninputs: []\n"
      "sensors:\n  accelerometer:\n    unit: \"mg\"\n    status: not_at_rest\n"
      "    disturbance: \"the unit moved\"\n    rate_hz: 50\n    samples: 360000\n"
      "    duration_s: 7200\n    filled_samples: 0\n    breaks: 0\n    warnings: []\n"
      "    axes: { x: { points: [] }, y: { points: [] }, z: { points: [] } }\n";
  const std::string allan = folder_.Write("allan.yaml", text);
  const Finished run =
      Calibrate(LogText(kEnough), {"--set=sensors.accelerometer.noise={ allan: allan.yaml }"});
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(
      run.err,
      AllOf(HasSubstr(allan), HasSubstr("was not at rest (the unit moved)"), HasSubstr("sigma")));
}

TEST_F(CalibrateVerb, LeavesOutTheReportWhenAsked) {
  EXPECT_EQ(Calibrate(LogText(kEnough), {"--report=false"}).exit_code, 0);
  EXPECT_FALSE(HasReport());
}

TEST_F(CalibrateVerb, LetsSetReplaceSeveralValuesWithCommasInside) {
  const Finished run =
      Calibrate(LogText(kEnough),
                {"--set=reference.gravity_mps2={value: 9.81, sigma: 0.001},gauge=accel-z,"
                 "sensors.accelerometer.noise.sigma=[0.01, 0.01, 0.02]"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  const YAML::Node config = Written()["config"];
  EXPECT_EQ(config["reference"]["gravity_mps2"]["sigma"].as<double>(), 0.001);
  EXPECT_EQ(config["gauge"].as<std::string>(), "accel-z");
  EXPECT_EQ(config["sensors"]["accelerometer"]["noise"]["sigma"][2].as<double>(), 0.02);
}

TEST_F(CalibrateVerb, TakesTheLogOfTheExperimentRelativeToIt) {
  folder_.Write("log.csv", LogText(kEnough));
  const std::string config =
      folder_.Write("experiment.yaml", std::string(kAccelerometerExperiment) + "input: log.csv\n");
  const Finished run =
      RunTruetriad({"calibrate", "--config=" + config, "--output=" + folder_.Path("result")});
  EXPECT_EQ(run.exit_code, 0) << run.err;
}

TEST_F(CalibrateVerb, ReadsAPoseTableForWhatItIs) {
  std::string table = "accel_x[m/s^2],accel_y[m/s^2],accel_z[m/s^2]\n";
  // One sample in the middle of each rest.
  const std::vector<LogRow> rows = LogRows(kEnough);
  for (std::size_t i = 60; i < rows.size(); i += 175) {
    table += std::to_string(rows[i][1]) + "," + std::to_string(rows[i][2]) + "," +
             std::to_string(rows[i][3]) + "\n";
  }
  const Finished run = Calibrate(table);
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(Written()["quality"]["poses"].as<int>(), 16);
}

TEST_F(CalibrateVerb, TakesPosesFromAPoseColumnWithoutBeingTold) {
  std::string text = "time[s],accel_x[m/s^2],accel_y[m/s^2],accel_z[m/s^2],pose\n";
  std::vector<LogRow> rows = LogRows(kEnough);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    rows[i].push_back(i % 175 < 125 ? static_cast<double>(i / 175 + 1) : 0.0);
  }
  const std::string log = folder_.Write("log.csv", LogText(text, rows));
  const Finished run = RunTruetriad({"inspect", "--input=" + log});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("16 poses by pose column"));
}

TEST_F(CalibrateVerb, HoldsTheMatrixOfABiasModelAtOneInTheLogsUnit) {
  constexpr double kMgPerMps2 = 1000.0 / 9.80665;
  LogOptions log = kEnough;
  log.accelerometer.sensitivity.setIdentity();
  log.accel_raw_per_mps2 = kMgPerMps2;
  const Finished run =
      Calibrate(LogText("time[s],accel_x[mg],accel_y[mg],accel_z[mg]\n", LogRows(log)),
                {"--set=sensors.accelerometer.model=bias"});
  EXPECT_EQ(run.exit_code, 0) << run.out;
  const YAML::Node sensor = Written()["sensors"]["accelerometer"];
  EXPECT_DOUBLE_EQ(sensor["sensitivity"][0][0].as<double>(), kMgPerMps2);
  // 16 means of 2 s have 0.002 m/s^2 each; 5 of them are far more than their bias can have.
  EXPECT_NEAR(sensor["bias"][1].as<double>(), -0.2 * kMgPerMps2, 0.01 * kMgPerMps2);
}

TEST_F(CalibrateVerb, ChoosesTheModelAndResolvesToTheChoice) {
  const Finished run = Calibrate(LogText({.rests = 24, .magnetometer = false}),
                                 {"--set=sensors.accelerometer.model=auto"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out,
              AllOf(HasSubstr("Choice of the model"), HasSubstr("Chosen: accelerometer full.")));
  const YAML::Node first = Written();
  EXPECT_TRUE(first["quality"]["model_choice"][0]["chosen"].as<bool>());
  EXPECT_EQ(first["config"]["sensors"]["accelerometer"]["model"].as<std::string>(), "full");
  EXPECT_EQ(first["config"]["sensors"]["accelerometer"]["quadratic"].as<std::string>(), "false");
  const Finished again = RunTruetriad({"calibrate",
                                       "--config=" + folder_.Path("result/calibration.yaml"),
                                       "--input=" + log_,
                                       "--output=" + folder_.Path("again")});
  EXPECT_EQ(again.exit_code, 0) << again.err;
  const YAML::Node second = YAML::LoadFile(folder_.Path("again/calibration.yaml"));
  EXPECT_EQ(YAML::Dump(second["sensors"]), YAML::Dump(first["sensors"]));
  EXPECT_FALSE(second["quality"]["model_choice"]);
}

TEST_F(CalibrateVerb, WarnsOfEmptyFieldsAndStuckStretchesButGoesOn) {
  std::vector<LogRow> rows = LogRows({.rests = 24, .magnetometer = false});
  for (std::size_t i = 500; i < 700; ++i) rows[i] = {rows[i][0], 1.0, 2.0, 9.0};
  rows[20][1] = std::nan("");
  const Finished run = Calibrate(LogText(LogHeader(kEnough), rows));
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("stuck"));
}

TEST_F(CalibrateVerb, SaysWithItsExitCodeThatALimitIsExceeded) {
  const Finished run = Calibrate(LogText(kEnough), {"--set=limits.accelerometer.bias=0.01"});
  EXPECT_EQ(run.exit_code, 4) << run.err;
  EXPECT_THAT(run.out, HasSubstr("limit"));
  EXPECT_FALSE(Written()["status"]["within_limits"].as<bool>());
  EXPECT_TRUE(Written()["sensors"].IsDefined());
}

TEST_F(CalibrateVerb, JudgesByTheLimitsOfADataSheetWhatTheUnitHas) {
  const Finished run =
      Calibrate(LogText(kEnough),
                {"--set=limits.preset=" TRUETRIAD_SOURCE_DIR "/configs/limits/icm-42688-p.yaml"});
  EXPECT_EQ(run.exit_code, 4) << run.err;  // Gains are off by 2 %, where 0.5 % are stated.
  std::vector<std::string> judged;
  for (const auto& limit : Written()["quality"]["limits"]) {
    judged.push_back(limit["name"].as<std::string>());
  }
  EXPECT_THAT(
      judged,
      testing::UnorderedElementsAre(
          "accelerometer.bias", "accelerometer.scale_error", "accelerometer.misalignment_rad"));
}

TEST_F(CalibrateVerb, RunsEveryShippedExperiment) {
  int experiments = 0;
  for (const auto& entry :
       std::filesystem::directory_iterator(TRUETRIAD_SOURCE_DIR "/configs/experiments")) {
    if (entry.path().extension() != ".yaml") continue;
    // Their recordings are to be simulated first, which simulate_test.cc, sessions_test.cc,
    // motion_test.cc and sweep_test.cc do.
    const std::set<std::string> simulated = {
        "thermal-soak", "thermal-sweep", "rate-table", "rates-without-axis", "sessions", "tumble"};
    if (simulated.contains(entry.path().stem().string())) continue;
    ++experiments;
    const Finished run = RunTruetriad({"calibrate",
                                       "--config=" + entry.path().string(),
                                       "--output=" + folder_.Path(entry.path().stem())});
    EXPECT_EQ(run.exit_code, 0) << entry.path() << '\n' << run.out << run.err;
  }
  EXPECT_GE(experiments, 5);
}

struct TooLittle {
  std::string name;
  LogOptions log;
  std::string message;

  friend std::ostream& operator<<(std::ostream& out, const TooLittle& little) {
    return out << little.name;
  }
};

class NotEnoughData : public CalibrateVerb, public ::testing::WithParamInterface<TooLittle> {};

TEST_P(NotEnoughData, WritesWhyButNoNumbersToUse) {
  const Finished run = Calibrate(LogText(GetParam().log));
  EXPECT_EQ(run.exit_code, 3) << run.err;
  EXPECT_THAT(run.out, AllOf(HasSubstr("NO RESULT"), HasSubstr(GetParam().message)));
  EXPECT_TRUE(HasReport());
  const YAML::Node written = Written();
  EXPECT_NE(written["status"]["outcome"].as<std::string>(), "converged");
  EXPECT_THAT(written["status"]["messages"][0].as<std::string>(), Not(IsEmpty()));
  EXPECT_TRUE(written["quality"].IsDefined());
  EXPECT_FALSE(written["sensors"].IsDefined());
  EXPECT_FALSE(written["covariance"].IsDefined());
}

TEST_P(NotEnoughData, GivesAFileThatNothingElseTakes) {
  EXPECT_EQ(Calibrate(LogText(GetParam().log)).exit_code, 3);
  const std::string calibration = "--calibration=" + folder_.Path("result/calibration.yaml");
  const Finished apply = RunTruetriad(
      {"apply", calibration, "--input=" + log_, "--output=" + folder_.Path("corrected.csv")});
  EXPECT_EQ(apply.exit_code, 2);
  EXPECT_THAT(apply.err, HasSubstr("not usable"));
  EXPECT_FALSE(std::filesystem::exists(folder_.Path("corrected.csv")));
  const std::string good = folder_.Write("good.csv", LogText(kEnough));
  EXPECT_EQ(RunTruetriad({"evaluate", calibration, "--input=" + good}).exit_code, 2);
  EXPECT_EQ(
      RunTruetriad({"report", calibration, "--output=" + folder_.Path("again.html")}).exit_code, 0);
}

INSTANTIATE_TEST_SUITE_P(
    Each,
    NotEnoughData,
    ::testing::Values(
        TooLittle{"NoRests", {.rests = 40, .rest_s = 0.0, .magnetometer = false}, "no rest found"},
        TooLittle{"FewerPosesThanParameters", {.rests = 6, .magnetometer = false}, "6 poses"},
        TooLittle{"PosesInOnePlane",
                  {.rests = 24, .in_one_plane = true, .magnetometer = false},
                  "plane"}),
    [](const auto& test) { return test.param.name; });

TEST_F(CalibrateVerb, KeepsAUsableResultBesideOneThatIsNot) {
  EXPECT_EQ(Calibrate(LogText(kEnough)).exit_code, 0);
  const std::string first = TemporaryFolder::Read(folder_.Path("result/calibration.yaml"));
  const std::string few = LogText({.rests = 6, .magnetometer = false});
  const Finished refused = Calibrate(few);
  EXPECT_EQ(refused.exit_code, 3);
  EXPECT_THAT(refused.err, HasSubstr("calibration.yaml to calibration.previous.yaml"));
  EXPECT_NE(TemporaryFolder::Read(folder_.Path("result/calibration.yaml")), first);
  // It is as it was, but not the last word about the unit.
  const auto previous = [&] {
    return YAML::Load(TemporaryFolder::Read(folder_.Path("result/calibration.previous.yaml")));
  };
  const YAML::Node before = YAML::Load(first);
  EXPECT_EQ(YAML::Dump(previous()["sensors"]), YAML::Dump(before["sensors"]));
  EXPECT_EQ(previous()["verdict"].as<std::string>(), "FAIL");
  EXPECT_EQ(previous()["decisions"].size(), 1U);
  // The refused one is replaced: the usable one stays.
  EXPECT_EQ(Calibrate(few).exit_code, 3);
  EXPECT_EQ(YAML::Dump(previous()["sensors"]), YAML::Dump(before["sensors"]));
  EXPECT_EQ(previous()["decisions"].size(), 1U);
}

TEST_F(CalibrateVerb, KeepsWhatAPersonDecidedAboutTheSameRecording) {
  ASSERT_EQ(Calibrate(LogText()).exit_code, 0);
  const std::string file = folder_.Path("result/calibration.yaml");
  const std::string decision =
      "decisions: [{ verdict: FAIL, who: R. Roe, why: bent, created: 2026-11-25T10:00:00Z }]\n";
  std::string text = TemporaryFolder::Read(file);
  const std::size_t verdict = text.find("\nverdict: ");
  text.erase(verdict, text.find('\n', verdict + 1) - verdict);
  folder_.Write("result/calibration.yaml", text + decision);
  const Finished again = Calibrate(LogText(), {"--to=px4"});
  EXPECT_EQ(again.exit_code, 4);
  EXPECT_THAT(again.out, HasSubstr("FAIL by R. Roe"));
  EXPECT_FALSE(std::filesystem::exists(folder_.Path("result/px4.params")));
  // Also where a log without a result came in between.
  EXPECT_EQ(Calibrate(LogText({.rests = 6, .magnetometer = false})).exit_code, 3);
  EXPECT_EQ(Calibrate(LogText(), {"--to=px4"}).exit_code, 4);
  LogOptions other;
  other.seed = 7;
  EXPECT_EQ(Calibrate(LogText(other)).exit_code, 0);
}

TEST_F(CalibrateVerb, KeepsTheResultOfAUnitBesideOneOfNoUnit) {
  const std::string log = LogText(kEnough);
  EXPECT_EQ(Calibrate(log).exit_code, 0);
  const std::string first = TemporaryFolder::Read(folder_.Path("result/calibration.yaml"));
  const Finished unnamed = Calibrate(log, {R"(--set=device.serial="")"});
  EXPECT_EQ(unnamed.exit_code, 0);
  EXPECT_THAT(unnamed.err, HasSubstr("calibration.yaml to calibration.previous.yaml"));
  EXPECT_EQ(TemporaryFolder::Read(folder_.Path("result/calibration.previous.yaml")), first);
  // That of no unit is replaced.
  EXPECT_EQ(Calibrate(log, {R"(--set=device.serial="")"}).exit_code, 0);
  EXPECT_EQ(TemporaryFolder::Read(folder_.Path("result/calibration.previous.yaml")), first);
}

TEST_F(CalibrateVerb, LeavesEarlierResultsAsTheyAreWhereItFails) {
  const std::string log = LogText(kEnough);
  EXPECT_EQ(Calibrate(log).exit_code, 0);
  const auto before = FilesIn(folder_.Path("result"));
  EXPECT_EQ(Calibrate("time[s],accel_x[m/s^2]\n0,1\n").exit_code, 2);
  EXPECT_EQ(Calibrate(log, {"--set=model=diagonal"}).exit_code, 2);
  EXPECT_EQ(Calibrate(log, {"--solver=best"}).exit_code, 1);
  EXPECT_EQ(Calibrate(log, {"--set=device.serial=T2"}).exit_code, 2);
  EXPECT_EQ(FilesIn(folder_.Path("result")), before);
  // Where the last of its files cannot be written, neither are the others, whatever they would
  // replace.
  std::filesystem::remove(folder_.Path("result/calibration.json"));
  std::filesystem::create_directories(folder_.Path("result/calibration.json/folder"));
  const auto without = FilesIn(folder_.Path("result"));
  EXPECT_EQ(Calibrate(log).exit_code, 2);
  EXPECT_EQ(Calibrate(LogText({.rests = 6, .magnetometer = false})).exit_code, 2);
  EXPECT_EQ(FilesIn(folder_.Path("result")), without);
}

TEST_F(CalibrateVerb, LeavesNoPageOfAnEarlierRunBesideAResultWithoutOne) {
  EXPECT_EQ(Calibrate(LogText(kEnough)).exit_code, 0);
  EXPECT_TRUE(HasReport());
  EXPECT_EQ(Calibrate(LogText(kEnough), {"--report=false"}).exit_code, 0);
  EXPECT_FALSE(HasReport());
  EXPECT_TRUE(std::filesystem::exists(folder_.Path("result/report.previous.html")));
}

TEST_F(CalibrateVerb, ReplacesAnotherUnitsResultsOnlyWhereItIsTold) {
  EXPECT_EQ(Calibrate(LogText(kEnough)).exit_code, 0);
  const std::vector<std::string> other = {"--set=device.serial=T2"};
  const Finished refused = Calibrate(LogText(kEnough), other);
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, AllOf(HasSubstr("T1"), HasSubstr("T2"), HasSubstr("--overwrite")));
  EXPECT_EQ(Written()["device"]["serial"].as<std::string>(), "T1");
  EXPECT_EQ(Calibrate(LogText(kEnough), {other[0], "--overwrite"}).exit_code, 0);
  EXPECT_EQ(Written()["device"]["serial"].as<std::string>(), "T2");
  // The same unit, and one without a number, as before.
  EXPECT_EQ(Calibrate(LogText(kEnough), other).exit_code, 0);
  EXPECT_EQ(Calibrate(LogText(kEnough), {"--set=device.serial=\"\""}).exit_code, 0);
}

TEST(Serials, ThatDifferAreAnErrorOfEveryVerb) {
  const TemporaryFolder folder;
  const std::string demo = "--input=datasets/demo/recording.yaml";
  const std::string config = "--config=configs/experiments/accelerometer-only.yaml";
  const std::string result = folder.Path("other");
  const auto expect_error = [](const Finished& run) {
    EXPECT_EQ(run.exit_code, 2) << run.out;
    EXPECT_THAT(run.err, AllOf(HasSubstr("A0001"), HasSubstr("T2")));
  };
  expect_error(RunTruetriad(
      {"calibrate", config, demo, "--output=" + folder.Path("a"), "--set=device.serial=T2"}));
  // The log itself names no unit.
  const Finished other = RunTruetriad({"calibrate",
                                       config,
                                       "--input=datasets/demo/recording.csv",
                                       "--output=" + result,
                                       "--set=device.serial=T2"});
  ASSERT_EQ(other.exit_code, 0) << other.err;
  const std::string calibration = "--calibration=" + result + "/calibration.yaml";
  expect_error(RunTruetriad({"evaluate", calibration, demo}));
  expect_error(RunTruetriad({"apply", calibration, demo, "--output=" + folder.Path("x.csv")}));
  EXPECT_EQ(RunTruetriad({"calibrate", config, demo, "--output=" + folder.Path("a")}).exit_code, 0);
  expect_error(RunTruetriad({"compare",
                             "--a=" + folder.Path("a") + "/calibration.yaml",
                             "--b=" + result + "/calibration.yaml"}));
}

TEST_F(CalibrateVerb, LeavesOutWhatItIsToldTo) {
  // Rests of 2.5 s and moves of 1 s at 50 Hz: the second rest is from 3.5 to 6 s.
  const auto run = [this](const std::string& set) {
    return Calibrate(LogText(kEnough), {"--set=" + set});
  };
  const auto poses = [this] { return Written()["quality"]["poses"].as<int>(); };
  const auto value = [this](const std::string& name) {
    for (const YAML::Node& finding : Written()["status"]["findings"]) {
      if (finding["code"].as<std::string>() != "excluded" || !finding["values"][name]) continue;
      return finding["values"][name]["value"].as<double>();
    }
    return 0.0;
  };
  EXPECT_EQ(run("exclude=[{from_s: 3.505, to_s: 6.005}]").exit_code, 0);
  EXPECT_EQ(poses(), kEnough.rests - 1);
  EXPECT_EQ(value("readings"), 125.0);
  for (const YAML::Node& finding : Written()["status"]["findings"]) {
    EXPECT_NE(finding["code"].as<std::string>(), "time-gaps");
  }
  // To the end, in more seconds than a time of a log can be.
  const std::string last_s = std::to_string(3.5 * (kEnough.rests - 1) - 0.5);
  EXPECT_EQ(run("exclude=[{from_s: " + last_s + ", to_s: 1e12}]").exit_code, 0);
  EXPECT_EQ(poses(), kEnough.rests - 1);
  EXPECT_EQ(run("exclude_poses=[2, 5]").exit_code, 0);
  EXPECT_EQ(poses(), kEnough.rests - 2);
  EXPECT_EQ(value("poses"), 2.0);
  for (const std::string set : {"exclude=[{from_s: 1000, to_s: 1001}]", "exclude_poses=[40]"}) {
    const Finished bad = run(set);
    EXPECT_EQ(bad.exit_code, 2);
    EXPECT_THAT(bad.err, HasSubstr("exclude"));
  }
}

}  // namespace calibrate_test
}  // namespace truetriad
