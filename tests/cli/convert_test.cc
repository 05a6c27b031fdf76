// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cli/command_line_run.h"
#include "io/recording_samples.h"

namespace truetriad {
namespace convert_test {

namespace fs = std::filesystem;

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::StartsWith;

const std::string kShared = TRUETRIAD_SHARED_DATASETS;
const std::string kProgramFolder = fs::path(TRUETRIAD_BINARY).parent_path().string();

bool HasConverter(const std::string& format) {
  return fs::exists(kProgramFolder + "/truetriad-convert-" + format);
}

#define SKIP_WITHOUT(format)                                                                      \
  if (!HasConverter(format)) {                                                                    \
    GTEST_SKIP() << "truetriad-convert-" << (format) << " was not built: its library is missing"; \
  }

class Convert : public ::testing::Test {
 protected:
  Finished Run(const std::string& format,
               const std::string& input,
               std::vector<std::string> more = {}) {
    more.insert(more.begin(),
                {"convert", "--from=" + format, "--input=" + input, "--output=" + out_});
    return RunTruetriad(more);
  }

  /// Writes a log with `messages` samples at 100 Hz; with the raw readings where truth is not
  /// empty.
  std::string MakeLog(const std::string& format, int messages, const std::string& truth = "") {
    const std::string path = folder_.Path("made." + format);
    const Finished run = RunShell("tools/bench/make_log.py " + format + " " + path + " " +
                                  std::to_string(messages) + " " + truth);
    EXPECT_EQ(run.exit_code, 0) << run.err;
    return path;
  }

  /// What an independent reader says about `out_`: nothing when it agrees with the log.
  std::string Disagreement(const std::string& format,
                           const std::string& log,
                           const std::string& instance = "0") {
    const Finished run = RunShell("tests/convert/check_conversion.py " + format + " '" + log +
                                  "' '" + out_ + "' " + instance);
    counts_ = run.out;
    return run.exit_code == 0 ? "" : run.out + run.err;
  }

  std::string Manifest() { return TemporaryFolder::Read(out_ + "/recording.yaml"); }

  RecordingSamples Samples() {
    Result<RecordingSamples> recording = ReadRecording(out_ + "/recording.yaml");
    EXPECT_TRUE(recording) << recording.error().message;
    return recording ? std::move(*recording) : RecordingSamples();
  }

  /// With every `unknown` of the manifest completed by hand.
  RecordingSamples SamplesAsIfRaw() {
    std::string manifest = Manifest();
    constexpr std::string_view kUnknown = ": unknown";
    for (std::size_t at = manifest.find(kUnknown); at != std::string::npos;
         at = manifest.find(kUnknown)) {
      manifest.replace(at, kUnknown.size(), ": none");
    }
    std::ofstream(out_ + "/recording.yaml") << manifest;
    return Samples();
  }

  /// Neither the folder nor a temporary one is left.
  void ExpectNothingWritten() {
    for (const auto& entry : fs::directory_iterator(folder_.Path("."))) {
      EXPECT_THAT(entry.path().filename().string(), Not(HasSubstr("out"))) << entry.path();
    }
  }

  TemporaryFolder folder_;
  std::string out_ = folder_.Path("out");
  std::string counts_;
};

/// A recording of the collection, and what its README says it holds.
struct RealLog {
  std::string format;
  std::string file;
  std::vector<std::string> counts;  ///< "accelerometer 1820"
  std::string arguments = "--list=false";
  std::string instance = "0";

  friend std::ostream& operator<<(std::ostream& out, const RealLog& log) { return out << log.file; }
};

class ConvertRealLog : public Convert, public ::testing::WithParamInterface<RealLog> {};

TEST_P(ConvertRealLog, GivesWhatAnIndependentReaderFinds) {
  const RealLog& log = GetParam();
  SKIP_WITHOUT(log.format);
  const std::string path = kShared + "/" + log.file;
  if (!fs::exists(path)) GTEST_SKIP() << "there is no " << path;
  const Finished run = Run(log.format, path, {log.arguments});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, StartsWith(out_ + "/recording.yaml\n"));  // Further instances follow.
  EXPECT_EQ(Disagreement(log.format, path, log.instance), "");
  for (const std::string& count : log.counts) EXPECT_THAT(counts_, HasSubstr(count + " "));
  // Few of these logs hold rests, and one constants: it must be understood, no more.
  const Finished inspect = RunTruetriad({"inspect", "--input=" + out_ + "/recording.yaml"});
  EXPECT_TRUE(inspect.exit_code == 0 || inspect.exit_code == 3 ||
              inspect.err.find("stuck") != std::string::npos)
      << inspect.err;
}

INSTANTIATE_TEST_SUITE_P(
    Each,
    ConvertRealLog,
    ::testing::Values(RealLog{"dataflash",
                              "e-dataflash-ardupilot/pymavlink_test.BIN",
                              {"accelerometer 45", "gyroscope 45", "magnetometer 8"}},
                      RealLog{"dataflash",
                              "e-dataflash-ardupilot/backend_log_80k.bin",
                              {"accelerometer 10", "gyroscope 10", "magnetometer 4"}},
                      RealLog{"dataflash",
                              "e-dataflash-ardupilot/backend_log_80k.bin",
                              {"accelerometer 10", "gyroscope 10", "magnetometer 4"},
                              "--instance=1",
                              "1"},
                      RealLog{"dataflash",
                              "e-dataflash-ardupilot/copter364_fmuv5.bin",
                              {"accelerometer 1820", "gyroscope 1820", "magnetometer 728"}},
                      RealLog{"dataflash",
                              "e-dataflash-ardupilot/copter364_fmuv5.bin",
                              {"accelerometer 1820", "gyroscope 1820", "magnetometer 728"},
                              "--instance=1",
                              "1"},
                      RealLog{"ros1",
                              "e-rosbag1/phidgets_imu_upside_down.bag",
                              {"accelerometer 13964", "gyroscope 13964", "magnetometer 6974"}},
                      RealLog{"ros1",
                              "e-rosbag1/robot_localization_test1.bag",
                              {"accelerometer 11865", "gyroscope 11865"}},
                      RealLog{"ros2-db3",
                              "e-rosbag2-format/test_bag_sqlite3.db3",
                              {"accelerometer 2", "gyroscope 2", "magnetometer 2"}},
                      RealLog{"ros2-db3",
                              "e-rosbag2-format/plotjuggler_rosbag2_test_0.db3",
                              {"accelerometer 1565", "gyroscope 1565"}}));

TEST_F(Convert, SaysWhichTopicsABagWithoutAnImuHas) {
  SKIP_WITHOUT("ros1");
  const std::string path = kShared + "/e-rosbag1/no_imu_lz4.bag";
  if (!fs::exists(path)) GTEST_SKIP() << "there is no " << path;
  const Finished run = Run("ros1", path);
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err,
              AllOf(HasSubstr("no sensor_msgs/Imu"), HasSubstr("/turtle1/pose (turtlesim/Pose)")));
  ExpectNothingWritten();
  // Its lz4 chunks were read all the same: the counts are those of the bag's own index.
  const Finished list = RunTruetriad({"convert", "--from=ros1", "--input=" + path, "--list"});
  EXPECT_EQ(list.exit_code, 0);
  EXPECT_THAT(list.out, AllOf(HasSubstr("2688"), HasSubstr("1351"), HasSubstr("/tf_static")));
}

TEST_F(Convert, CountsMagnetometerRowsWithoutNumbers) {
  SKIP_WITHOUT("ros1");
  const std::string path = kShared + "/e-rosbag1/phidgets_imu_upside_down.bag";
  if (!fs::exists(path)) GTEST_SKIP() << "there is no " << path;
  const Finished run = Run("ros1", path);
  EXPECT_THAT(run.err, HasSubstr("magnetometer: 6974 samples"));
  EXPECT_THAT(run.err, HasSubstr("6990 rows skipped"));
}

class ConvertMadeLog : public Convert, public ::testing::WithParamInterface<std::string> {};

TEST_P(ConvertMadeLog, GivesWhatWasWritten) {
  SKIP_WITHOUT(GetParam());
  const std::string log = MakeLog(GetParam(), 3000);
  const Finished run = Run(GetParam(), log);
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(Disagreement(GetParam(), log), "");
  EXPECT_THAT(counts_, AllOf(HasSubstr("accelerometer 3000 "), HasSubstr("magnetometer 300 ")));
  EXPECT_EQ(RunTruetriad({"inspect", "--input=" + out_ + "/recording.yaml"}).exit_code, 3);
}

/// What lies before the cut is there, and the loss is counted.
TEST_P(ConvertMadeLog, YieldsWhatIsWholeOfACutLog) {
  SKIP_WITHOUT(GetParam());
  const std::string log = MakeLog(GetParam(), 3000);
  fs::resize_file(log, fs::file_size(log) * 6 / 10);
  const Finished run = Run(GetParam(), log);
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.err, AnyOf(HasSubstr("not part of a complete message"), HasSubstr("damaged")));
  const RecordingSamples samples = Samples();
  const auto count = samples.streams[Triad::kAccelerometer].x.size();
  EXPECT_GT(count, 1000U);
  EXPECT_LT(count, 2999U);
}

TEST_P(ConvertMadeLog, PassesOverADamagedStretch) {
  SKIP_WITHOUT(GetParam());
  const std::string log = MakeLog(GetParam(), 3000);
  {
    std::fstream file(log, std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(static_cast<std::streamoff>(fs::file_size(log) / 2));
    file << std::string(9000, 'x');
  }
  const Finished run = Run(GetParam(), log);
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.err,
              AnyOf(HasSubstr("not part of a complete message"),
                    HasSubstr("damaged"),
                    HasSubstr("left out")));
  const RecordingSamples samples = Samples();
  const StreamSamples& stream = samples.streams[Triad::kAccelerometer];
  EXPECT_LT(stream.x.size(), 3000U);
  // There is something on both sides, to the last row.
  EXPECT_GT(stream.x.size(), 1000U);
  EXPECT_EQ(stream.time_ns.back() - stream.time_ns.front(), 29'990'000'000);
}

TEST_P(ConvertMadeLog, RefusesAFileOfAnotherKind) {
  SKIP_WITHOUT(GetParam());
  const std::string text = folder_.Write("log.txt", "time[s],accel_x[m/s^2]\n1,2\n");
  for (const std::string& input : {text, folder_.Path("missing"), folder_.Path(".")}) {
    const Finished run = Run(GetParam(), input);
    EXPECT_EQ(run.exit_code, 2) << input;
    EXPECT_THAT(run.err, HasSubstr(input));
    ExpectNothingWritten();
  }
}

INSTANTIATE_TEST_SUITE_P(Each, ConvertMadeLog, ::testing::Values("dataflash", "ros1", "ros2-db3"));

/// Raw, corrected by the equations of ArduPilot in the generator, written as float, undone here.
/// From IMU, and from ACC and GYR with the temperature of the last IMU.
class ConvertCorrectedLog : public Convert, public ::testing::WithParamInterface<std::string> {};

TEST_P(ConvertCorrectedLog, UndoesWhatArduPilotApplied) {
  const std::string truth = folder_.Path("truth.csv");
  ASSERT_EQ(Run("dataflash", MakeLog(GetParam(), 3000, truth)).exit_code, 0);
  EXPECT_EQ(fs::exists(out_ + "/gyroscope.csv"), GetParam() == "dataflash-raw");
  const RecordingSamples samples = Samples();
  std::ifstream file(truth);
  std::size_t row = 0;
  for (std::string line; std::getline(file, line); ++row) {
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream numbers(line);
    std::int64_t time_ns = 0;
    std::vector<double> raw(9);
    numbers >> time_ns;
    for (double& value : raw) numbers >> value;
    const auto expect =
        [&](Triad triad, std::size_t at, std::size_t column, double unit, double near) {
          const StreamSamples& stream = samples.streams[triad];
          ASSERT_EQ(stream.time_ns[at], time_ns);
          EXPECT_NEAR(stream.x[at], unit * raw[column], near) << row;
          EXPECT_NEAR(stream.y[at], unit * raw[column + 1], near) << row;
          EXPECT_NEAR(stream.z[at], unit * raw[column + 2], near) << row;
        };
    // Float keeps 24 bits of a reading below 16, of parameters below 4, and of the coefficients,
    // which act on 25 degC; six such roundings add up at most.
    expect(Triad::kAccelerometer, row, 0, 1.0, 6.0 * 16.0 * std::ldexp(1.0, -24));
    expect(Triad::kGyroscope, row, 3, 1.0, 6.0 * 0.1 * std::ldexp(1.0, -24));
    // Whole milligauss: half of one on each axis, through an inverse whose rows sum to below 1.1.
    if (row % 10 == 0) expect(Triad::kMagnetometer, row / 10, 6, 10.0, 0.5 * 1.1);
  }
  EXPECT_EQ(row, 3000U);
}

INSTANTIATE_TEST_SUITE_P(Each,
                         ConvertCorrectedLog,
                         ::testing::Values("dataflash", "dataflash-raw", "dataflash-2014"));

TEST_F(Convert, ReadsWhatArduCopterLoggedIn2014) {
  const std::string log = MakeLog("dataflash-2014", 3000);
  const Finished run = Run("dataflash", log);
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(Disagreement("dataflash", log), "");
  EXPECT_THAT(counts_, AllOf(HasSubstr("accelerometer 3000 "), HasSubstr("magnetometer 300 ")));
  // What is exported of it is for its order of correction.
  EXPECT_THAT(Manifest(),
              AllOf(Not(HasSubstr("temperature")),
                    Not(HasSubstr("unknown")),
                    HasSubstr("firmware: \"ardupilot-3.2\"")));
  // Other firmware of that time may have subtracted offsets first.
  std::string bytes = TemporaryFolder::Read(log);
  bytes.replace(bytes.find("ArduCopter V3.1.5"), 17, "ArduCopter V3.3-d");
  const Finished other = Run("dataflash", folder_.Write("other.bin", bytes));
  EXPECT_EQ(other.exit_code, 0) << other.err;
  EXPECT_THAT(other.err, HasSubstr("Copter or Plane up to 3.2"));
  EXPECT_THAT(Manifest(),
              AllOf(HasSubstr("accelerometer: unknown"), Not(HasSubstr("magnetometer: unknown"))));
}

/// No release that logs milliseconds knows a compass matrix; of an unnamed firmware it is only
/// known that its log has none, as long as nothing of the log is lost.
TEST_F(Convert, RefusesToGuessACompassMatrixThatDamageMayHaveTaken) {
  const std::string whole = TemporaryFolder::Read(MakeLog("dataflash-2014", 300));
  std::string damaged = whole;
  const std::size_t at = damaged.find("COMPASS_OFS_Z");
  ASSERT_NE(at, std::string::npos);
  damaged.replace(at - 3, 2, "??");
  std::string elsewhere = whole;  // Among the rows.
  elsewhere.insert(elsewhere.find("\xa3\x95", elsewhere.size() / 2), "????");
  for (const bool is_named : {true, false}) {
    std::string bytes = elsewhere;
    if (!is_named) bytes.replace(bytes.find("ArduCopter V3.1.5"), 17, "MyCopter   V3.1.5");
    const Finished run = Run("dataflash", folder_.Write("log.bin", bytes));
    EXPECT_EQ(run.exit_code, 0) << run.err;
    EXPECT_EQ(Manifest().find("magnetometer: unknown") == std::string::npos, is_named) << run.err;
  }
  EXPECT_EQ(Run("dataflash", folder_.Write("log.bin", damaged)).exit_code, 0);
  EXPECT_THAT(Manifest(), HasSubstr("magnetometer: unknown"));
}

/// The parameters of a real log, its first rows, and the equations of its firmware by hand.
TEST_F(Convert, UndoesWhatArduPilotAppliedInARealLog) {
  const std::string path = kShared + "/e-dataflash-ardupilot/copter364_fmuv5.bin";
  if (!fs::exists(path)) GTEST_SKIP() << "there is no " << path;
  ASSERT_EQ(Run("dataflash", path).exit_code, 0);
  const RecordingSamples samples = Samples();
  const StreamSamples& acceleration = samples.streams[Triad::kAccelerometer];
  constexpr double kRounding = 1e-14;
  EXPECT_NEAR(acceleration.x[0],
              0.15701234340667725 / 0.9992505311965942 - 0.012538268230855465,
              kRounding);
  EXPECT_NEAR(
      acceleration.z[0], -9.823831558227539 / 0.9821330904960632 - 0.09003657102584839, kRounding);
  EXPECT_NEAR(samples.streams[Triad::kGyroscope].x[0],
              0.00533122755587101 + 0.03825864940881729,
              kRounding);
  const StreamSamples& field = samples.streams[Triad::kMagnetometer];
  const double x = field.x[0] + 44.10712432861328;
  const double y = field.y[0] + 42.90705490112305;
  const double z = field.z[0] + 95.14116668701172;
  constexpr double kMilligauss = 1e-10;
  EXPECT_NEAR(0.9998705983161926 * x + 0.03489530086517334 * y - 0.03836125135421753 * z,
              175.0,
              kMilligauss);
  EXPECT_NEAR(0.03489530086517334 * x + 0.9810066223144531 * y - 0.04599056765437126 * z,
              -30.0,
              kMilligauss);
  EXPECT_NEAR(-0.03836125135421753 * x - 0.04599056765437126 * y + 1.0269798040390015 * z,
              468.0,
              kMilligauss);
}

TEST_F(Convert, RefusesToGuessWhatFirmwareAppliedWithoutItsParameters) {
  const std::string log = MakeLog("dataflash", 300);
  std::string bytes = TemporaryFolder::Read(log);
  const std::size_t at = bytes.find("INS_ACCSCAL_Y");
  ASSERT_NE(at, std::string::npos);
  bytes[at] = 'X';
  const Finished run = Run("dataflash", folder_.Write("changed.bin", bytes));
  EXPECT_EQ(run.exit_code, 0);
  EXPECT_THAT(run.err,
              AllOf(HasSubstr("the log has no parameter INS_ACCSCAL_Y"), HasSubstr("by hand")));
  EXPECT_THAT(Manifest(), HasSubstr("accelerometer: unknown"));
  const Finished inspect = RunTruetriad({"inspect", "--input=" + out_ + "/recording.yaml"});
  EXPECT_EQ(inspect.exit_code, 2);
  EXPECT_THAT(inspect.err, HasSubstr("applied.accelerometer: the corrections"));
}

/// The CSV of a corrected log, opened without its manifest, must not pass for raw.
TEST_F(Convert, WritesFilesThatAreRefusedWithoutTheirManifest) {
  ASSERT_EQ(Run("dataflash", MakeLog("dataflash", 300)).exit_code, 0);
  EXPECT_EQ(RunTruetriad({"inspect", "--input=" + out_ + "/imu.csv"}).exit_code, 2);
}

TEST_F(Convert, AsksWhichOfSeveralTopics) {
  SKIP_WITHOUT("ros2-db3");
  const std::string log = MakeLog("ros2-db3", 300);
  ASSERT_EQ(
      RunShell("python3 -c \"import sqlite3; d = sqlite3.connect(\\\"" + log +
               "\\\"); d.execute(\\\"INSERT INTO topics VALUES (3, \\\\\\\"/other\\\\\\\", "
               "\\\\\\\"sensor_msgs/msg/Imu\\\\\\\", \\\\\\\"cdr\\\\\\\", 0)\\\"); "
               "d.execute(\\\"UPDATE messages SET topic_id = 3 WHERE id = 7\\\"); d.commit()\"")
          .exit_code,
      0);
  const Finished run = Run("ros2-db3", log);
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_THAT(run.err, AllOf(HasSubstr("/imu, /other"), HasSubstr("--topic=")));
  ExpectNothingWritten();
  EXPECT_EQ(Run("ros2-db3", log, {"--topic=/imu,/mag"}).exit_code, 0);
}

TEST_F(Convert, ReadsMatricesStructsAndColumnsOfAMatFile) {
  SKIP_WITHOUT("mat");
  for (const std::string version : {"5", "5z", "7.3"}) {
    const std::string file = folder_.Path(version + ".mat");
    ASSERT_EQ(RunShell("'" + kProgramFolder + "/tests/convert/truetriad_make_mat' " + version +
                       " '" + file + "' 500")
                  .exit_code,
              0);
    const Finished run = Run("mat",
                             file,
                             {"--columns=time=t,accelerometer=imu.acc,gyroscope=imu.gyr,"
                              "magnetometer=data:2-4",
                              "--units=s,m/s^2,rad/s,counts"});
    ASSERT_EQ(run.exit_code, 0) << run.err;
    const RecordingSamples samples = Samples();
    for (std::size_t i = 0; i < 500; ++i) {
      const double x = static_cast<double>(i);
      const StreamSamples& acceleration = samples.streams[Triad::kAccelerometer];
      EXPECT_EQ(acceleration.time_ns[i], static_cast<std::int64_t>(i) * 10'000'000);
      EXPECT_EQ(acceleration.y[i], -x);
      EXPECT_EQ(acceleration.z[i], x + 0.5);
      EXPECT_EQ(samples.streams[Triad::kGyroscope].x[i], 0.25 * x);
      EXPECT_EQ(samples.streams[Triad::kMagnetometer].z[i], x + 2.0);
    }
    // Names that can only mean one thing need not be said; units always.
    EXPECT_THAT(Run("mat", file, {"--units=s,m/s^2,rad/s"}).err,
                HasSubstr("accelerometer: taken from imu.acc"));
    // Of two files with the same names, which is which must be said.
    const std::string other = folder_.Path(version + "-other.mat");
    fs::copy_file(file, other);
    const Finished two = Run("mat",
                             file,
                             {other,
                              "--columns=time=t,accelerometer=" + version +
                                  "/imu.acc,gyroscope=" + version + "-other/imu.gyr",
                              "--units=s,m/s^2,rad/s"});
    ASSERT_EQ(two.exit_code, 0) << two.err;
    EXPECT_EQ(Samples().streams[Triad::kGyroscope].x[499], 0.25 * 499.0);
    const Finished without_units = Run("mat", file);
    EXPECT_EQ(without_units.exit_code, 1);
    EXPECT_THAT(without_units.err, HasSubstr("the unit of the accelerometer is missing"));
  }
}

// The library would fill up with zeros.
TEST_F(Convert, LeavesOutTheVariableInWhichAMatFileIsCut) {
  SKIP_WITHOUT("mat");
  const std::string file = folder_.Path("whole.mat"), cut = folder_.Path("cut.mat");
  ASSERT_EQ(
      RunShell("'" + kProgramFolder + "/tests/convert/truetriad_make_mat' 5 '" + file + "' 500")
          .exit_code,
      0);
  const auto size = fs::file_size(file);
  int converted = 0;
  for (const double share : {0.3, 0.5, 0.7, 0.9, 0.99}) {
    fs::copy_file(file, cut, fs::copy_options::overwrite_existing);
    fs::resize_file(cut, static_cast<std::uintmax_t>(share * static_cast<double>(size)));
    fs::remove_all(out_);
    const Finished run =
        Run("mat",
            cut,
            {"--columns=time=t,accelerometer=imu.acc,magnetometer=data:2-4", "--units=s,m/s^2,uT"});
    if (run.exit_code != 0) continue;
    ++converted;
    const RecordingSamples samples = Samples();
    for (const Triad triad : {Triad::kAccelerometer, Triad::kMagnetometer}) {
      const StreamSamples& stream = samples.streams[triad];
      if (stream.z.empty()) continue;
      EXPECT_EQ(stream.z.size(), 500u) << share;
      EXPECT_NE(stream.z.back(), 0.0) << share;
    }
  }
  EXPECT_LT(converted, 5);
}

TEST_F(Convert, TakesOneUnitASensor) {
  const std::string file =
      folder_.Write("unit.json", R"({"t": [0, 1], "acc": [[1, 2, 3], [4, 5, 6]]})");
  for (const std::string units : {"--units=s,g,m/s^2", "--units=s,ms,g"}) {
    const Finished run = Run("json", file, {units});
    EXPECT_EQ(run.exit_code, 1);
    EXPECT_THAT(run.err, HasSubstr("are both units of the"));
  }
}

TEST_F(Convert, RefusesJsonThatSaysTwoThings) {
  const std::string units = "--units=s,m/s^2,degC";
  const std::string twice =
      folder_.Write("twice.json", R"({"t": [0, 1], "t": [0, 2], "acc": [[1, 2, 3], [4, 5, 6]]})");
  Finished run = Run("json", twice, {units});
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err, HasSubstr("`t` occurs twice"));
  const std::string shorter = folder_.Write(
      "shorter.json", R"({"t": [0, 1], "acc": [[1, 2, 3], [4, 5, 6]], "temp": [20]})");
  run = Run("json", shorter, {units});
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err, HasSubstr("temperature temp has 1 values for 2 readings"));
  run = Run("json", folder_.Write("empty.json", ""), {units});
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err, HasSubstr("is empty"));
}

TEST_F(Convert, JoinsOneFileAFace) {
  const std::vector<std::string> faces = {"x_up", "x_down", "y_up", "y_down", "z_up", "z_down"};
  fs::create_directory(folder_.Path("faces"));
  for (std::size_t face = 0; face < faces.size(); ++face) {
    std::string text = "time[s],accel_x[m/s^2],accel_y[m/s^2],accel_z[m/s^2]\n";
    for (int i = 0; i < 20; ++i) {
      text +=
          std::to_string(0.1 * i) + "," + std::to_string(face) + "," + std::to_string(i) + ",3\n";
    }
    folder_.Write("faces/" + faces[face] + ".csv", text);
  }
  const Finished run = Run("six-face", folder_.Path("faces"));
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const RecordingSamples samples = Samples();
  EXPECT_EQ(samples.streams[Triad::kAccelerometer].x.size(), 120U);
  EXPECT_EQ(samples.streams[Triad::kAccelerometer].x[59], 2.0);
  const auto poses = ManifestPoseSelection(out_ + "/recording.yaml");
  ASSERT_TRUE(poses && *poses);
  ASSERT_EQ((*poses)->ranges.size(), 6U);
  EXPECT_EQ((*poses)->ranges[3].first, 60);
  EXPECT_EQ((*poses)->ranges[3].last, 79);
  EXPECT_EQ((*poses)->ranges[3].face_up, "-y");
}

TEST_F(Convert, JoinsTheFilesOfGnssInsSim) {
  fs::create_directory(folder_.Path("sim"));
  folder_.Write("sim/time.csv", "time (sec)\n0.00\n0.01\n0.02\n");
  folder_.Write("sim/accel-0.csv",
                "accel_x (m/s^2),accel_y (m/s^2),accel_z (m/s^2)\n1,2,3\n4,5,6\n7,8,9\n");
  folder_.Write("sim/gyro-0.csv",
                "gyro_x (deg/s),gyro_y (deg/s),gyro_z (deg/s)\n1,2,3\n4,5,6\n7,8,1e1\n");
  ASSERT_EQ(Run("gnss-ins-sim", folder_.Path("sim")).exit_code, 0);
  const RecordingSamples samples = Samples();
  EXPECT_EQ(samples.info.Find(Triad::kGyroscope)->unit.name, "deg/s");
  EXPECT_THAT(samples.streams[Triad::kGyroscope].z, ::testing::ElementsAre(3.0, 6.0, 10.0));
  EXPECT_THAT(samples.streams[Triad::kAccelerometer].time_ns,
              ::testing::ElementsAre(0, 10'000'000, 20'000'000));
  folder_.Write("sim/time.csv", "time (sec)\n0.00\n0.01\n");
  const Finished run = Run("gnss-ins-sim", folder_.Path("sim"));
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err, HasSubstr("has more rows than"));
}

/// A table of a known layout: what is written, and how one triad of it reads.
struct KnownTable {
  std::string mapping;
  std::string text;
  Triad triad;
  std::string unit;

  friend std::ostream& operator<<(std::ostream& out, const KnownTable& table) {
    return out << table.mapping;
  }
};

class ConvertKnownTable : public Convert, public ::testing::WithParamInterface<KnownTable> {};

TEST_P(ConvertKnownTable, ReadsItsColumns) {
  const std::string log = folder_.Write("log.csv", GetParam().text);
  const bool is_pair = GetParam().mapping == "imu-tk";
  const Finished run = Run(GetParam().mapping, is_pair ? log + "," + log : log);
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const RecordingSamples samples = Samples();
  const StreamSamples& stream = samples.streams[GetParam().triad];
  EXPECT_EQ(samples.info.Find(GetParam().triad)->unit.name, GetParam().unit);
  EXPECT_THAT(stream.time_ns, ::testing::ElementsAre(1'000'000'000, 2'000'000'000));
  EXPECT_THAT(stream.x, ::testing::ElementsAre(4.0, 14.0));
  EXPECT_THAT(stream.y, ::testing::ElementsAre(5.0, 15.0));
  EXPECT_THAT(stream.z, ::testing::ElementsAre(6.0, 16.0));
}

INSTANTIATE_TEST_SUITE_P(
    Each,
    ConvertKnownTable,
    ::testing::Values(
        KnownTable{"euroc",
                   "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],"
                   "a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]\n"
                   "1000000000,1,2,3,4,5,6\n2000000000,11,12,13,14,15,16\n",
                   Triad::kAccelerometer,
                   "m/s^2"},
        KnownTable{"kalibr-csv",
                   "timestamp,omega_x,omega_y,omega_z,alpha_x,alpha_y,alpha_z\n"
                   "1000000000,4,5,6,1,2,3\n2000000000,14,15,16,11,12,13\n",
                   Triad::kGyroscope,
                   "rad/s"},
        KnownTable{"imu-tk", "   1.0   4 5 6\n   2.0   14 15 16\n", Triad::kGyroscope, "counts"},
        KnownTable{"blackbox",
                   "loopIteration, time (us), gyroADC[0] (deg/s), gyroADC[1] (deg/s), gyroADC[2] "
                   "(deg/s), accSmooth[0] (m/s/s), accSmooth[1] (m/s/s), accSmooth[2] (m/s/s), "
                   "flightModeFlags (flags)\n"
                   "0, 1000000, 1, 2, 3, 4, 5, 6, ANGLE\n64, 2000000, 1, 2, 3, 14, 15, 16, ANGLE\n",
                   Triad::kAccelerometer,
                   "m/s^2"},
        KnownTable{"blackbox",
                   "loopIteration, time (us), gyroADC[0], gyroADC[1], gyroADC[2], accSmooth[0], "
                   "accSmooth[1], accSmooth[2], magADC[0], magADC[1], magADC[2]\n"
                   "0, 1000000, 1, 2, 3, 1, 1, 1, 4, 5, 6\n64, 2000000, 1, 2, 3, 1, 1, 1, 14, 15, "
                   "16\n",
                   Triad::kMagnetometer,
                   "counts"}));

TEST_F(Convert, RefusesATableOfAnotherLayout) {
  const std::string log = folder_.Write("log.csv", "t,ax,ay,az\n1,2,3,4\n");
  for (const std::string mapping : {"euroc", "kalibr-csv", "blackbox"}) {
    const Finished run = Run(mapping, log);
    EXPECT_EQ(run.exit_code, 2) << mapping;
    EXPECT_THAT(run.err, HasSubstr(log));
    ExpectNothingWritten();
  }
  EXPECT_EQ(Run("imu-tk", log).exit_code, 1);  // One file where two are needed.
}

TEST_F(Convert, TakesAMappingOfTheUsersOwn) {
  const std::string log = folder_.Write("log.csv", "ms,ax,ay,az\n1000,4,5,6\n2000,14,15,16\n");
  const std::string mapping = folder_.Write(
      "mine.yaml",
      "mapping: 1\nabout: my logger\ninputs: [log.csv]\nstreams:\n"
      "  - accelerometer: {time: {column: ms, unit: ms}, x: ax, y: ay, z: az, unit: mg}\n");
  ASSERT_EQ(Run(mapping, log).exit_code, 0);
  EXPECT_THAT(Samples().streams[Triad::kAccelerometer].x, ::testing::ElementsAre(4.0, 14.0));
  const std::string wrong = folder_.Write("wrong.yaml", "mapping: 1\nabuot: my logger\n");
  const Finished run = Run(wrong, log);
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err, HasSubstr("abuot"));
}

TEST_F(Convert, TakesAMappingWithTemperatureAndOneWithoutTime) {
  const std::string log = folder_.Write("log.csv", "T,n,ax,ay,az\n290,7,4,5,6\n291,8,14,15,16\n");
  const auto mapping = [&](const std::string& stream) {
    return folder_.Write(
        "mine.yaml",
        "mapping: 1\nabout: mine\ninputs: [log.csv]\nstreams:\n  - accelerometer: {" + stream +
            ", x: ax, y: ay, z: az}\n");
  };
  ASSERT_EQ(Run(mapping("time: {column: n, unit: s}, unit: counts, si_per_count: 0.01, "
                        "temperature: {column: T, unit: K}"),
                log)
                .exit_code,
            0);
  const RecordingSamples warm = Samples();
  EXPECT_EQ(warm.streams[Triad::kAccelerometer].time_ns[1], 8'000'000'000);
  EXPECT_THAT(Manifest(),
              AllOf(HasSubstr("temperature: {column: \"T\", unit: K}"), HasSubstr("si_per_count")));
  ASSERT_EQ(Run(mapping("time: {column: n, unit: samples, rate_hz: 4}, unit: g"), log).exit_code,
            0);
  EXPECT_EQ(Samples().streams[Triad::kAccelerometer].time_ns[0], 1'750'000'000);
  ASSERT_EQ(Run(mapping("unit: m/s^2"), log).exit_code, 0);
  const Finished run = RunTruetriad({"inspect", out_ + "/recording.yaml"});
  EXPECT_THAT(run.out, HasSubstr("2 poses by every row"));
  EXPECT_EQ(Run(mapping("temperature: {column: V, unit: K}, unit: m/s^2"), log).exit_code, 2);
}

TEST_F(Convert, ReadsArraysAndRecordsOfJson) {
  const std::string units = "--units=s,m/s^2,uT";
  // Records, with what Python writes for no number.
  const std::string records = folder_.Write(
      "records.json",
      R"({"unit": "NaN 7", "rows": [{"t": 0, "imu": {"acc": [1, 2, 3]}, "mag": [4, 5, 6]},
          {"t": 0.5, "imu": {"acc": [1, 2, NaN]}}, {"t": 1, "imu": {"acc": [7, 8, 9.25]}}]})");
  Finished run = Run("json", records, {units});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.err, HasSubstr("accelerometer: 2 samples over 1.000 s; 1 row skipped"));
  EXPECT_THAT(Samples().streams[Triad::kAccelerometer].z, ::testing::ElementsAre(3.0, 9.25));
  EXPECT_THAT(Samples().streams[Triad::kMagnetometer].y, ::testing::ElementsAre(5.0));
  // One object a line.
  const std::string lines = folder_.Write(
      "lines.json", "{\"t\": 0, \"acc\": [1, 2, 3]}\n{\"t\": 1, \"acc\": [4, 5, 6]}\n");
  ASSERT_EQ(Run("json", lines, {units}).exit_code, 0);
  EXPECT_THAT(Samples().streams[Triad::kAccelerometer].x, ::testing::ElementsAre(1.0, 4.0));
  const std::string cut = folder_.Write("cut.json", "{\"t\": [0, 1],\n \"acc\": [[1, 2, 3], [4,");
  run = Run("json", cut, {units});
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err, HasSubstr(cut + ":2: is not valid JSON from here on"));
}

TEST_F(Convert, WithoutATimeKeepsRowsTogether) {
  const std::string file = folder_.Write(
      "unit.json",
      R"({"grav": [[1, 2, 3], [null, 2, 3], [4, 5, 6]], "mag": [1, 2, 3, 4, 5, 6, 7, null, 9, null],
          "few": [[1, 2, 3]]})");
  const std::string columns = "--columns=accelerometer=grav,magnetometer=mag:xyz";
  const std::string units = "--units=m/s^2,uT";
  Finished run = Run("json", file, {columns, units});
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_THAT(run.err, HasSubstr("time=none if each row is the reading of one rest"));
  ExpectNothingWritten();
  run = Run("json", file, {columns + ",time=none", units});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(TemporaryFolder::Read(out_ + "/recording.csv"),
            "accel_x,accel_y,accel_z,mag_x,mag_y,mag_z\n1,2,3,1,2,3\n,,,4,5,6\n4,5,6,,,\n");
  EXPECT_THAT(Manifest(), HasSubstr("poses: every_row"));
  run = Run("json",
            file,
            {"--columns=time=none,accelerometer=grav,gyroscope=few", "--units=m/s^2,rad/s"});
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err, HasSubstr("the gyroscope has 1 rows, but the accelerometer has 3"));
}

TEST_F(Convert, JoinsVariablesWithATimeEach) {
  const std::string file = folder_.Write("own.json",
                                         R"({"ta": [0, 0.5], "acc": [[1, 2, 3], [4, 5, 6]],
          "tg": [0, 0.25, 0.5], "gyr": [[1, 2, 3], [NaN, 5, 6], [7, 8, 9]], "mag": [[1, 2, 3]]})");
  const std::string units = "--units=s,m/s^2,rad/s,uT";
  const Finished run =
      Run("json",
          file,
          {"--columns=accelerometer=acc@ta,gyroscope=gyr@tg,magnetometer=mag@10Hz", units});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  RecordingSamples samples = Samples();
  EXPECT_EQ(samples.streams[Triad::kAccelerometer].time_ns,
            (std::vector<std::int64_t>{0, 500'000'000}));
  EXPECT_EQ(samples.streams[Triad::kGyroscope].time_ns,
            (std::vector<std::int64_t>{0, 500'000'000}));  // The row with NaN is none.
  EXPECT_EQ(samples.streams[Triad::kMagnetometer].x, (std::vector<double>{1.0}));
  const Finished mixed = Run("json", file, {"--columns=time=tg,accelerometer=acc", units});
  EXPECT_EQ(mixed.exit_code, 2);
  EXPECT_THAT(mixed.err, HasSubstr("accelerometer=acc@t_acc"));
  EXPECT_EQ(Run("json", file, {"--columns=accelerometer=acc@ta", "--units=m/s^2"}).exit_code, 1);
  EXPECT_EQ(Run("json", file, {"--columns=time=none,accelerometer=acc@ta", units}).exit_code, 1);
  const Finished partly =
      Run("json", file, {"--columns=accelerometer=acc@ta,gyroscope=gyr", units});
  EXPECT_EQ(partly.exit_code, 1);
  EXPECT_THAT(partly.err, HasSubstr("which variables are the time"));
}

TEST_F(Convert, ReadsJsonListsOfALineEachWithNaN) {
  const std::string rows = "[0, 1, 2, 3]\n[0.5, NaN, 2, 3]\n[1, -1, Infinity, 3]\n[1.5, 4, 5, 6]\n";
  std::string whole = "[" + rows.substr(0, rows.size() - 1) + "]";
  std::replace(whole.begin(), whole.end(), '\n', ',');
  for (const std::string& text : {rows, whole}) {
    const Finished run = Run("json",
                             folder_.Write("rows.json", text),
                             {"--columns=time=data:1,accelerometer=data:2-4", "--units=s,m/s^2"});
    ASSERT_EQ(run.exit_code, 0) << run.err;
    RecordingSamples samples = Samples();
    EXPECT_EQ(samples.streams[Triad::kAccelerometer].time_ns,
              (std::vector<std::int64_t>{0, 1'500'000'000}));
    EXPECT_EQ(samples.streams[Triad::kAccelerometer].z, (std::vector<double>{3.0, 6.0}));
  }
}

TEST_F(Convert, JoinsSeveralFilesWithATimeEach) {
  const std::string acc =
      folder_.Write("acc.json", R"({"t": [0, 1], "data": [[1, 2, 3], [4, 5, 6]]})");
  const std::string gyr =
      folder_.Write("gyr.json", R"({"t": [0, 1, 2], "data": [[1, 2, 3], [4, 5, 6], [7, 8, 9]]})");
  const std::string units = "--units=s,m/s^2,rad/s";
  const Finished run = Run("json",
                           acc + "," + gyr,
                           {"--columns=time=t,accelerometer=acc/data,gyroscope=gyr/data", units});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(Samples().streams[Triad::kAccelerometer].time_ns.size(), 2u);
  EXPECT_EQ(Samples().streams[Triad::kGyroscope].time_ns.size(), 3u);
  const Finished vague =
      Run("json", acc, {gyr, "--columns=time=t,accelerometer=data,gyroscope=gyr/data", units});
  EXPECT_EQ(vague.exit_code, 1);
  EXPECT_THAT(vague.err, HasSubstr("several files have a variable `data`; name the file, too"));
}

/// A file of VectorNav sentences, each with the checksum that a reader of Python gives it: two
/// digits, or four where the text begins with "crc:". What begins with "=" is written as it is.
std::string VectorNavLog(TemporaryFolder* folder, const std::vector<std::string>& sentences) {
  std::string script =
      "import binascii, functools, sys\n"
      "for text in sys.stdin.read().splitlines():\n"
      "    if text[0] == '=':\n"
      "        print(text[1:], end='\\r\\n')\n"
      "        continue\n"
      "    long, text = text.startswith('crc:'), text.removeprefix('crc:')\n"
      "    xor = functools.reduce(lambda a, b: a ^ b, text.encode())\n"
      "    check = f'{binascii.crc_hqx(text.encode(), 0):04X}' if long else f'{xor:02X}'\n"
      "    print(f'${text}*{check}', end='\\r\\n')\n";
  std::string text;
  for (const std::string& sentence : sentences) text += sentence + '\n';
  const std::string program = folder->Write("sentences.py", script);
  const std::string plain = folder->Write("plain.txt", text);
  const std::string log = folder->Path("vectornav.txt");
  const Finished run = RunShell("python3 '" + program + "' < '" + plain + "' > '" + log + "'");
  EXPECT_EQ(run.exit_code, 0) << run.err;
  return log;
}

TEST_F(Convert, ReadsVectorNavSentencesAndKeepsThePlaceOfBadOnes) {
  SKIP_WITHOUT("vectornav");
  const std::string log = VectorNavLog(
      &folder_,
      {// Of a unit, with the checksum that it wrote.
       "=$VNIMU,-00.0350,+00.4222,-00.6643,-00.015,+00.019,+09.948,+00.002066,-00.008442,-00."
       "044656,"
       "+20.7,+084.322*66",
       "crc:VNIMU,+00.1,+00.2,+00.3,+01.5,-02.5,+09.75,+00.01,-00.02,+00.03,+21.5,+101.3",
       "VNYPR,+001.0,+002.0,+003.0",  // No readings, no place in time.
       "=$VNIMU,-00.0350,+00.4223,-00.6643,-00.015,+00.019,+09.948,+00.002066,-00.008442,-00."
       "044656,"
       "+20.7,+084.322*66",
       "VNIMU,1,2,3",
       "=$VNIMU,+00.1,+0",
       "=!!!",
       "VNIMU,-00.5,+00.25,-00.125,+00.5,+00.25,+00.125,+01,+02,+03,+22.0,+101.3"});
  const Finished listed = Run("vectornav", log, {"--list"});
  EXPECT_THAT(listed.out, AllOf(HasSubstr("VNIMU             3          3"), HasSubstr("VNYPR")));
  const Finished run = Run("vectornav", log, {"--columns=time=40Hz"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.err, HasSubstr("4 bad sentences"));
  EXPECT_THAT(
      Manifest(),
      AllOf(HasSubstr("applied: none"), HasSubstr("bad sentences: \"4\""), HasSubstr("unit: G")));
  RecordingSamples samples = Samples();
  const StreamSamples& field = samples.streams[Triad::kMagnetometer];
  EXPECT_EQ(field.time_ns, (std::vector<std::int64_t>{0, 25'000'000, 150'000'000}));
  EXPECT_EQ(field.x, (std::vector<double>{-0.035, 0.1, -0.5}));
  EXPECT_EQ(samples.streams[Triad::kAccelerometer].z, (std::vector<double>{9.948, 9.75, 0.125}));
  EXPECT_EQ(samples.streams[Triad::kGyroscope].y, (std::vector<double>{-0.008442, -0.02, 2.0}));
  EXPECT_EQ(samples.streams[Triad::kGyroscope].temperature_degc,
            (std::vector<double>{20.7, 21.5, 22.0}));
}

TEST_F(Convert, SaysThatAVectorNavUnitHasCompensatedWhatItWrote) {
  SKIP_WITHOUT("vectornav");
  const std::string log = VectorNavLog(
      &folder_,
      {"=$VNYMR,-078.104,+005.642,+023.096,+00.0125,+00.1252,-00.1042,+00.878,-03.762,-08.854,"
       "-00.010387,-00.028062,-00.061305*68",
       "VNACC,+01,+02,+03"});
  const Finished untimed = Run("vectornav", log, {"--topic=VNYMR"});
  EXPECT_EQ(untimed.exit_code, 1);
  EXPECT_THAT(untimed.err, HasSubstr("--columns=time=40Hz"));
  const Finished vague = Run("vectornav", log, {"--columns=time=40Hz"});
  EXPECT_EQ(vague.exit_code, 1);
  EXPECT_THAT(vague.err, HasSubstr("the accelerometer is in VNACC and in VNYMR"));
  ExpectNothingWritten();
  const Finished run = Run("vectornav", log, {"--columns=time=40Hz", "--topic=VNYMR"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.err, HasSubstr("registers 23, 25 and 84"));
  EXPECT_THAT(Manifest(), HasSubstr("accelerometer: unknown"));
  const Finished other = Run("vectornav", folder_.Write("text.txt", "1,2\n3,4\n"));
  EXPECT_EQ(other.exit_code, 2);
  EXPECT_THAT(other.err, HasSubstr("no intact VectorNav sentence"));
}

TEST_F(Convert, ReadsVectorNavSentencesWithWhatRegister30Appends) {
  SKIP_WITHOUT("vectornav");
  const std::string log = VectorNavLog(&folder_,
                                       {// Of the unit's manual.
                                        "=$VNYPR,+010.071,+000.278,-002.026,T1162704*2F",
                                        "=$VNYPR,+010.071,+000.278,-002.026,S0000*1F",
                                        "VNGYR,+01.0,+02.0,+03.0,S04CB,T1162704",
                                        "crc:VNGYR,+02.0,+02.0,+03.0,T1162705",
                                        "VNGYR,+03.0,+02.0,+03.0,S04cB",
                                        "VNGYR,+04.0,+02.0,+03.0,T1,S04CB",  // Never in this order.
                                        "VNGYR,+05.0,+02.0,+03.0,S04CB,T1,7",  // A number too many.
                                        "VNGYR,+06.0,+02.0,S0000",             // A number too few.
                                        "VNGYR,+07.0,+02.0,+03.0"});
  const Finished run = Run("vectornav", log, {"--columns=time=100Hz"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.err,
              AllOf(HasSubstr("3 bad sentences"),
                    HasSubstr("3 sentences end with a status or counter (register 30)")));
  RecordingSamples samples = SamplesAsIfRaw();
  EXPECT_EQ(samples.streams[Triad::kGyroscope].x, (std::vector<double>{1, 2, 3, 7}));
  EXPECT_EQ(samples.streams[Triad::kGyroscope].time_ns,
            (std::vector<std::int64_t>{0, 10'000'000, 20'000'000, 60'000'000}));
}

TEST_F(Convert, BelievesVectorNavSentencesWithoutChecksumOnlyWhereNoneHasOne) {
  SKIP_WITHOUT("vectornav");
  const std::vector<std::string> sentences = {
      "=$VNACC,+00.1,+00.2,+09.8", "=$VNACC,+00.2,+00", "=$VNACC,+00.3,+00.2,+09.8*XX"};
  const Finished run =
      Run("vectornav", VectorNavLog(&folder_, sentences), {"--columns=time=100Hz"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.err, HasSubstr("have no checksums; damage goes unnoticed"));
  EXPECT_THAT(Manifest(), HasSubstr("checksums: \"none\""));
  RecordingSamples samples = SamplesAsIfRaw();
  EXPECT_EQ(samples.streams[Triad::kAccelerometer].x, (std::vector<double>{0.1, 0.3}));
  EXPECT_EQ(samples.streams[Triad::kAccelerometer].time_ns,
            (std::vector<std::int64_t>{0, 20'000'000}));
  std::vector<std::string> one_checked = sentences;
  one_checked.push_back("VNACC,+00.4,+00.2,+09.8");
  ASSERT_EQ(
      Run("vectornav", VectorNavLog(&folder_, one_checked), {"--columns=time=100Hz"}).exit_code, 0);
  EXPECT_EQ(SamplesAsIfRaw().streams[Triad::kAccelerometer].x, (std::vector<double>{0.4}));
}

TEST_F(Convert, GivesAnUnreadableVectorNavLineToTheKindWhoseTurnItIs) {
  SKIP_WITHOUT("vectornav");
  std::vector<std::string> sentences;
  for (int i = 0; i < 50; ++i) {
    const std::string number = std::to_string(i);
    sentences.push_back("VNACC," + number + ",2,3");
    sentences.push_back(i == 20 ? "=$VN" : "VNGYR," + number + ",2,3");
    sentences.push_back(i == 30 ? "=?" : "VNYPR,1,2,3");
  }
  const Finished run =
      Run("vectornav", VectorNavLog(&folder_, sentences), {"--columns=time=100Hz"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(
      run.err,
      AllOf(HasSubstr("2 bad sentences"), Not(HasSubstr("may have held samples of any kind"))));
  RecordingSamples samples = SamplesAsIfRaw();
  for (const Triad triad : {Triad::kAccelerometer, Triad::kGyroscope}) {
    const StreamSamples& stream = samples.streams[triad];
    ASSERT_EQ(stream.x.size(), triad == Triad::kGyroscope ? 49U : 50U);
    for (std::size_t i = 0; i < stream.x.size(); ++i)
      EXPECT_EQ(stream.time_ns[i], static_cast<std::int64_t>(stream.x[i]) * 10'000'000);
  }
  // Without turns nobody knows.
  sentences = {"VNACC,0,2,3", "=?", "VNGYR,1,2,3", "VNACC,1,2,3", "VNACC,2,2,3", "VNGYR,2,2,3"};
  const Finished mixed =
      Run("vectornav", VectorNavLog(&folder_, sentences), {"--columns=time=100Hz"});
  ASSERT_EQ(mixed.exit_code, 0) << mixed.err;
  EXPECT_THAT(mixed.err, HasSubstr("1 unreadable line may have held samples of any kind"));
}

TEST_F(Convert, SaysHowToDecodeABlackboxLog) {
  const Finished run = Run("bbl", "LOG00037.BFL");
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_THAT(run.err, HasSubstr("blackbox_decode --unit-rotation rad/s --unit-acceleration m/s2"));
  const std::string log = folder_.Write(
      "LOG00001.BBL", "H Product:Blackbox flight data recorder by Nicholas Sherlock\n");
  for (const Finished& given :
       {Run("blackbox", log), RunTruetriad({"inspect", "--input=" + log})}) {
    EXPECT_EQ(given.exit_code, 2);
    EXPECT_THAT(given.err,
                HasSubstr("is a Betaflight blackbox log, not CSV; decode it with Betaflight's own "
                          "blackbox_decode --unit-rotation rad/s --unit-acceleration m/s2 LOG.BBL, "
                          "then truetriad convert --from=blackbox --input=LOG.01.csv"));
    EXPECT_THAT(given.err, Not(HasSubstr("--from=bbl")));
  }
  ExpectNothingWritten();
}

TEST_F(Convert, SaysWhatAConverterThatIsNotThereNeeds) {
  const Finished run =
      RunShell("PATH= '" TRUETRIAD_BINARY "' convert --from=ulog --input=a.ulg --output=" + out_);
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_THAT(run.err, HasSubstr("needs Node.js"));
  const Finished unknown = Run("dataflsh", "a.bin");
  EXPECT_EQ(unknown.exit_code, 1);
  EXPECT_THAT(unknown.err, HasSubstr("did you mean `dataflash`?"));
}

TEST_F(Convert, ReplacesARecordingAndNothingElse) {
  const std::string log = MakeLog("dataflash", 300);
  ASSERT_EQ(Run("dataflash", log).exit_code, 0);
  std::ofstream(out_ + "/notes.txt") << "mine";
  ASSERT_EQ(Run("dataflash", log).exit_code, 0);
  EXPECT_EQ(TemporaryFolder::Read(out_ + "/notes.txt"), "mine");
  EXPECT_TRUE(fs::exists(out_ + "/imu.csv"));
}

}  // namespace convert_test
}  // namespace truetriad
