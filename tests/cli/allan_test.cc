// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "allan/allan_file.h"
#include "cli/command_line_run.h"
#include "io/temporary_folder.h"
#include "math/random.h"

namespace truetriad {
namespace allan_test {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::StartsWith;

/// A gyroscope at rest for `rows` samples at 100 Hz: N = 0.02 deg/s/√Hz.
std::string RestingLog(int rows, bool with_time = true) {
  Random random(31);
  std::string text = with_time ? "time[s]," : "";
  text += "gyro_x[deg/s],gyro_y[deg/s],gyro_z[deg/s]\n";
  for (int i = 0; i < rows; ++i) {
    if (with_time) text += std::to_string(0.01 * i) + ",";
    const Eigen::Vector3d reading = 0.2 * random.Normal3();
    text += std::to_string(reading.x()) + "," + std::to_string(reading.y()) + "," +
            std::to_string(reading.z()) + "\n";
  }
  return text;
}

TEST(Allan, WritesTheSameNumbersAsTextYamlAndPlotAndTheSameBytesAgain) {
  const TemporaryFolder folder;
  const std::string log = folder.Write("log.csv", RestingLog(20000));
  const Finished run = RunTruetriad({"allan", "--input=" + log, "--output=" + folder.Path("out")});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.err, IsEmpty());
  EXPECT_THAT(run.out, HasSubstr("noise density N"));
  EXPECT_THAT(run.out, HasSubstr("deg/√h"));
  const auto result = ReadAllanFile(folder.Path("out/allan.yaml"));
  ASSERT_TRUE(result) << result.error().message;
  const Interval& density = *result->triads[0].axes[0].white_density;
  // 20000 samples give N to 0.5 %.
  EXPECT_NEAR(density.value, 0.02, 5 * 0.005 * 0.02);
  char printed[32];
  std::snprintf(printed, sizeof printed, "%.4g", density.value);
  EXPECT_THAT(run.out, HasSubstr(printed));
  const std::string plot = TemporaryFolder::Read(folder.Path("out/allan.svg"));
  EXPECT_THAT(plot, HasSubstr(std::string(">") + printed + " deg/s/√Hz"));

  const std::string yaml = TemporaryFolder::Read(folder.Path("out/allan.yaml"));
  const Finished again =
      RunTruetriad({"allan", "--input=" + log, "--output=" + folder.Path("again")});
  ASSERT_EQ(again.exit_code, 0);
  EXPECT_EQ(TemporaryFolder::Read(folder.Path("again/allan.yaml")), yaml);
  EXPECT_EQ(TemporaryFolder::Read(folder.Path("again/allan.svg")), plot);
}

TEST(Allan, ExitsWithThreeAndStatesNoCoefficientsWhenTheUnitMoved) {
  const TemporaryFolder folder;
  std::string text = RestingLog(20000);
  // Knocked at 100 s.
  const std::size_t line = text.find("\n100.000000,") + 1;
  text.replace(line, text.find('\n', line) - line, "100.000000,50,50,50");
  const std::string log = folder.Write("log.csv", text);
  const Finished run = RunTruetriad({"allan", "--input=" + log, "--output=" + folder.Path("out")});
  EXPECT_EQ(run.exit_code, 3) << run.err;
  EXPECT_THAT(run.out, StartsWith("NOT AT REST: gyroscope: the unit moved or was knocked"));
  EXPECT_THAT(run.out, Not(HasSubstr("noise density")));
  const std::string yaml = TemporaryFolder::Read(folder.Path("out/allan.yaml"));
  EXPECT_THAT(yaml, HasSubstr("status: not_at_rest"));
  EXPECT_THAT(yaml, Not(HasSubstr("noise_density:")));
  EXPECT_THAT(TemporaryFolder::Read(folder.Path("out/allan.svg")),
              HasSubstr("gyroscope x: NOT AT REST"));
}

TEST(Allan, NeedsARateForALogWithoutTime) {
  const TemporaryFolder folder;
  const std::string log = folder.Write("log.csv", RestingLog(2000, false));
  const Finished missing = RunTruetriad({"allan", "--input=" + log});
  EXPECT_EQ(missing.exit_code, 1);
  EXPECT_THAT(missing.err, HasSubstr("--rate_hz"));
  const Finished given = RunTruetriad({"allan", "--input=" + log, "--rate_hz=100"});
  EXPECT_EQ(given.exit_code, 0) << given.err;
  EXPECT_THAT(given.out, HasSubstr("gyroscope: 100 Hz, 20 s, 2000 samples"));
}

TEST(Allan, TakesTheRangeOfWhiteNoise) {
  const TemporaryFolder folder;
  const std::string log = folder.Write("log.csv", RestingLog(2000));
  const Finished run = RunTruetriad({"allan", "--input=" + log, "--white_range=0.1,1"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  for (const char* const wrong : {"0.1", "0.1,", "1,0.1", "a,b", "0.1,1,2", "-1,1"}) {
    const Finished refused =
        RunTruetriad({"allan", "--input=" + log, "--white_range=" + std::string(wrong)});
    EXPECT_EQ(refused.exit_code, 1) << wrong;
    EXPECT_THAT(refused.err, HasSubstr("expected")) << wrong;
  }
}

TEST(Allan, LeavesNothingBehindWhenTheLogIsTooShortOrBad) {
  const TemporaryFolder folder;
  const std::string output = "--output=" + folder.Path("out");
  const std::string brief = folder.Write("short.csv", RestingLog(50));
  EXPECT_EQ(RunTruetriad({"allan", "--input=" + brief, output}).exit_code, 3);
  const std::string bad = folder.Write("bad.csv", RestingLog(500) + "1,x,2,3\n");
  EXPECT_EQ(RunTruetriad({"allan", "--input=" + bad, output}).exit_code, 2);
  EXPECT_EQ(folder.FileCount(), 2U);
}

TEST(Allan, FindsOutBeforeItReadsThatNothingCanBeWritten) {
  const TemporaryFolder folder;
  const std::string file = folder.Write("file", "");
  // The log is not there either, but that is looked at later.
  const Finished run = RunTruetriad({"allan", "--input=none.csv", "--output=" + file + "/below"});
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err, HasSubstr(file + ": is a file; name a folder"));
}

/// Both sensors at rest for `rows` samples at 100 Hz, with a random walk that a rest of minutes
/// shows.
std::string RestingUnit(int rows) {
  Random random(32);
  std::string text =
      "time[s],accel_x[g],accel_y[g],accel_z[g],gyro_x[deg/s],gyro_y[deg/s],gyro_z[deg/s]\n";
  Eigen::Vector3d force_bias = Eigen::Vector3d::UnitZ(), rate_bias = Eigen::Vector3d::Zero();
  for (int i = 0; i < rows; ++i) {
    force_bias += 1e-4 * random.Normal3();
    rate_bias += 0.01 * random.Normal3();
    const Eigen::Vector3d force = force_bias + 0.001 * random.Normal3();
    const Eigen::Vector3d rate = rate_bias + 0.1 * random.Normal3();
    text += std::to_string(0.01 * i);
    for (const double value : force) text += "," + std::to_string(value);
    for (const double value : rate) text += "," + std::to_string(value);
    text += "\n";
  }
  return text;
}

TEST(Allan, WritesWhatKalibrReadsFromALogAlone) {
  const TemporaryFolder folder;
  const std::string log = folder.Write("log.csv", RestingUnit(20000));
  const Finished run =
      RunTruetriad({"allan", log, "--to=kalibr,openvins,ros2", "-o", folder.Path("out")});
  ASSERT_EQ(run.exit_code, 0) << run.out << run.err;
  EXPECT_THAT(run.out, HasSubstr("Noise:  " + folder.Path("out/imu.yaml")));
  EXPECT_THAT(TemporaryFolder::Read(folder.Path("out/kalibr_imu_chain.yaml")), HasSubstr("Tw:"));
  EXPECT_THAT(TemporaryFolder::Read(folder.Path("out/ros2.yaml")),
              HasSubstr("angular_velocity_covariance"));
  const std::string text = TemporaryFolder::Read(folder.Path("out/imu.yaml"));
  const auto number = [&text](const std::string& key) {
    const std::size_t at = text.find("\n" + key + ": ");
    EXPECT_NE(at, std::string::npos) << key << " is missing in\n" << text;
    return at == std::string::npos ? 0.0 : std::stod(text.substr(at + key.size() + 3));
  };
  EXPECT_THAT(text, HasSubstr("\nrostopic: /imu0\n"));
  EXPECT_NEAR(number("update_rate"), 100.0, 0.1);
  // N = σ / √rate to 1 %, K = step √rate to 30 % in 200 s, here 5 σ.
  EXPECT_NEAR(number("accelerometer_noise_density") / (9.80665 * 0.001 / 10.0), 1.0, 0.05);
  EXPECT_NEAR(number("accelerometer_random_walk") / (9.80665 * 1e-4 * 10.0), 1.0, 0.5);
  constexpr double kRadPerDegree = 0.017453292519943295;
  EXPECT_NEAR(number("gyroscope_noise_density") / (kRadPerDegree * 0.1 / 10.0), 1.0, 0.05);
  EXPECT_NEAR(number("gyroscope_random_walk") / (kRadPerDegree * 0.01 * 10.0), 1.0, 0.5);
}

TEST(Allan, OfAnotherUnitIsNotTakenWithoutAWord) {
  const TemporaryFolder folder;
  folder.Write("log.csv", RestingUnit(5000));
  const auto noise_of = [&](const std::string& device) {
    const std::string manifest = folder.Write(
        "recording.yaml",
        "recording: 1\n" + device +
            "streams:\n  accelerometer:\n    file: log.csv\n    time: {column: \"time[s]\", unit: "
            "s}\n    x: \"accel_x[g]\"\n    y: \"accel_y[g]\"\n    z: \"accel_z[g]\"\n    unit: "
            "g\n");
    const Finished allan = RunTruetriad({"allan", manifest, "-o", folder.Path("out")});
    EXPECT_EQ(allan.exit_code, 0) << allan.out << allan.err;
    const Finished run = RunTruetriad({"export",
                                       "--calibration=datasets/demo/truth.yaml",
                                       "--to=kalibr",
                                       "--allan=" + folder.Path("out/allan.yaml"),
                                       "-o",
                                       folder.Path("imu.yaml")});
    EXPECT_EQ(run.exit_code, 0) << run.err;
    return run.err;
  };
  EXPECT_THAT(noise_of("serial: B0002\n"),
              HasSubstr("is of unit `B0002`, but the calibration is of `A0001`; give those of one "
                        "unit; its noise is used nevertheless"));
  EXPECT_THAT(noise_of("serial: A0001\n"), Not(HasSubstr("is of unit")));
  EXPECT_THAT(noise_of("device: { firmware: px4, ids: { accelerometer: 17 } }\n"),
              Not(HasSubstr("device id")));
  EXPECT_THAT(
      TemporaryFolder::Read(folder.Path("out/allan.yaml")),
      HasSubstr("\nserial: \"\"\ndevice:\n  firmware: \"px4\"\n  ids: { accelerometer: 17 }\n"));
}

TEST(Allan, WritesNoNoiseToNowhereAndForNobody) {
  const TemporaryFolder folder;
  const std::string log = folder.Write("log.csv", RestingLog(1000));
  const Finished nowhere = RunTruetriad({"allan", log, "--to=kalibr"});
  EXPECT_EQ(nowhere.exit_code, 1);
  EXPECT_THAT(nowhere.err, HasSubstr("--output=DIR"));
  const Finished nobody = RunTruetriad({"allan", log, "--to=px4", "-o", folder.Path("out")});
  EXPECT_EQ(nobody.exit_code, 1);
  EXPECT_THAT(nobody.err, HasSubstr("`px4` is not a format for noise"));
  EXPECT_EQ(folder.FileCount(), 1U);
}

}  // namespace allan_test
}  // namespace truetriad
