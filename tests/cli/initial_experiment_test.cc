// SPDX-License-Identifier: Apache-2.0
//
// A log and nothing else.
#include <array>
#include <cmath>
#include <filesystem>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include "cli/command_line_run.h"
#include "support/log_writer.h"
#include "truetriad/io/calibration_file.h"

namespace truetriad {
namespace initial_experiment_test {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::StartsWith;

class LogAlone : public ::testing::Test {
 protected:
  bool Has(const std::string& name) const { return std::filesystem::exists(folder_.Path(name)); }

  const TemporaryFolder folder_;
  const std::string log_ = folder_.Write("log.csv", LogText({.rests = 16}));
  const std::string result_ = log_ + ".truetriad/calibration.yaml";
};

TEST_F(LogAlone, IsCalibratedIntoAFolderBesideIt) {
  const Finished run = RunTruetriad({"calibrate", log_});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out,
              AllOf(StartsWith("NO LIMITS SET"), HasSubstr(log_ + ".truetriad/experiment.yaml")));
  const YAML::Node result = YAML::LoadFile(result_);
  for (const char* sensor : {"accelerometer", "magnetometer"}) {
    EXPECT_TRUE(result["sensors"][sensor]) << sensor;
  }
  EXPECT_TRUE(Has("log.csv.truetriad/report.html"));
}

TEST_F(LogAlone, LeavesTheExperimentThatItUsed) {
  ASSERT_EQ(RunTruetriad({"calibrate", log_, "--set=gauge=accel-z"}).exit_code, 0);
  const std::string experiment = log_ + ".truetriad/experiment.yaml";
  const std::string again = folder_.Path("again");
  const Finished run =
      RunTruetriad({"calibrate", "-c", experiment, "-o", again, "--set=gauge=accel-z"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  const Finished same = RunTruetriad({"compare", result_, again + "/calibration.yaml"});
  EXPECT_THAT(same.out, HasSubstr("largest difference 0 σ"));
}

TEST_F(LogAlone, IsWhatInitWritesAnExperimentFor) {
  const Finished init =
      RunShell("'" TRUETRIAD_BINARY "' init log.csv >unit.yaml", folder_.Path("."));
  EXPECT_EQ(init.exit_code, 0) << init.err;
  const std::string experiment = folder_.Path("unit.yaml");
  const Finished check = RunTruetriad({"check", experiment});
  EXPECT_EQ(check.out, experiment + ": valid; calibrates accelerometer, magnetometer\n");
  EXPECT_EQ(RunTruetriad({"calibrate", "-c", experiment, "-o", folder_.Path("o")}).exit_code, 0);
}

TEST_F(LogAlone, OfFacesThatATableNamesIsCalibratedByThem) {
  std::ostringstream table;
  table << "accel_x[m/s^2],accel_y[m/s^2],accel_z[m/s^2],face\n";
  const std::array<std::string, 6> faces = {"+x", "-x", "+y", "-y", "+z", "-z"};
  for (int row = 0; row < 18; ++row) {
    const int face = row % 6, up = face / 2;
    for (int axis = 0; axis < 3; ++axis) {
      const double force = axis == up ? (face % 2 == 0 ? 9.8 : -9.8) : 0.02 * std::sin(face + axis);
      table << 0.1 * axis + force + 1e-3 * std::sin(37.0 * row * row + 11.0 * axis) << ',';
    }
    table << faces.at(static_cast<std::size_t>(face)) << '\n';
  }
  const Finished run = RunTruetriad({"calibrate", folder_.Write("six.csv", table.str())});
  EXPECT_EQ(run.exit_code, 0) << run.out << run.err;
  EXPECT_THAT(run.out, HasSubstr("body frame   fixture"));
}

TEST_F(LogAlone, CarriesTheTagsOfItsRunToTheResult) {
  const Finished run = RunTruetriad(
      {"calibrate", log_, "--tag=lot=L17", "--tag=operator=O. \"B\", 2nd", "--tag=part=IMU-7"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("operator     O. \"B\", 2nd"));
  const auto calibration = ReadCalibration(result_);
  ASSERT_TRUE(calibration) << calibration.error().message;
  EXPECT_EQ(calibration->tags.lot, "L17");
  EXPECT_EQ(calibration->tags.operator_name, "O. \"B\", 2nd");
  EXPECT_EQ(calibration->tags.part, "IMU-7");
  const Finished unknown = RunTruetriad({"calibrate", log_, "--tag=lote=L17"});
  EXPECT_EQ(unknown.exit_code, 1);
  EXPECT_THAT(unknown.err, HasSubstr("did you mean `lot`?"));
}

TEST_F(LogAlone, TakesTagsFromTheManifestUnlessToldOtherwise) {
  const std::string manifest = folder_.Write("recording.yaml",
                                             "recording: 1\nserial: A7\n"
                                             "device: { revision: C }\n"
                                             "run: { lot: L3, station: S2 }\n"
                                             "streams:\n"
                                             "  accelerometer: { file: log.csv, time: { column: 0, "
                                             "unit: s }, x: 1, y: 2, z: 3, unit: m/s^2 }\n");
  const std::string out = folder_.Path("tagged");
  const Finished run = RunTruetriad({"calibrate", manifest, "-o", out, "--tag=station=S9"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  const auto calibration = ReadCalibration(out + "/calibration.yaml");
  ASSERT_TRUE(calibration) << calibration.error().message;
  EXPECT_EQ(calibration->serial, "A7");
  EXPECT_EQ(calibration->tags.revision, "C");
  EXPECT_EQ(calibration->tags.lot, "L3");
  EXPECT_EQ(calibration->tags.station, "S9");
}

TEST_F(LogAlone, StatesGravityAsThatOfAnywhere) {
  const Finished run = RunTruetriad({"calibrate", log_});
  EXPECT_THAT(run.out, HasSubstr("known with σ 0.02, which the σ of all gains include"));
}

TEST_F(LogAlone, LeavesNothingWhereItIsNotOne) {
  const std::string broken = folder_.Write("broken.csv", "time[s],accel_x[m/s^2]\n0,nonsense\n");
  const Finished run = RunTruetriad({"calibrate", broken});
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.out, IsEmpty());
  EXPECT_FALSE(Has("broken.csv.truetriad"));
}

TEST_F(LogAlone, OfAUnitThatNeverRestsIsTakenForMotion) {
  const std::string recording = folder_.Path("tumble");
  ASSERT_EQ(
      RunTruetriad(
          {"simulate", TRUETRIAD_SOURCE_DIR "/configs/scenarios/tumble.yaml", "-o", recording})
          .exit_code,
      0);
  const Finished run = RunTruetriad({"calibrate", recording + "/recording.yaml"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("tracked through the motion"));
}

TEST_F(LogAlone, CannotBeAnExperimentNorAResult) {
  const std::string experiment = folder_.Write("unit.yaml", kAccelerometerExperiment);
  EXPECT_THAT(RunTruetriad({"calibrate", experiment}).err,
              HasSubstr("is an experiment, not a recording; give it with --config"));
  ASSERT_EQ(RunTruetriad({"calibrate", log_}).exit_code, 0);
  EXPECT_THAT(RunTruetriad({"inspect", result_}).err, HasSubstr("is a result of truetriad"));
}

TEST_F(LogAlone, TakesFlagsInEveryForm) {
  const std::string out = folder_.Path("-out");
  const Finished run = RunTruetriad({"calibrate",
                                     "--set=robust.loss=none",
                                     "--set",
                                     "gauge=accel-z",
                                     "--set=sensors.accelerometer.time_offset_s=-0,"
                                     "reference.gravity_mps2=9.81",
                                     "-o",
                                     out,
                                     "--",
                                     log_});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  const YAML::Node result = YAML::LoadFile(out + "/calibration.yaml");
  EXPECT_EQ(result["config"]["robust"]["loss"].as<std::string>(), "none");
  EXPECT_EQ(result["gauge"].as<std::string>(), "accel-z");
  EXPECT_EQ(result["reference"]["gravity_mps2"].as<double>(), 9.81);
  const Finished hyphen =
      RunShell("'" TRUETRIAD_BINARY "' calibrate log.csv -o -strange", folder_.Path("."));
  EXPECT_EQ(hyphen.exit_code, 0) << hyphen.err;
  EXPECT_TRUE(Has("-strange/calibration.yaml"));
}

// Four rests of a scenario with a gyroscope are too few; its moves between them are not.
TEST(InitialExperimentOfFewRests, LeavesOpenThatTheMotionIsFollowed) {
  const TemporaryFolder folder;
  ASSERT_EQ(RunTruetriad({"simulate",
                          "-c",
                          "configs/scenarios/consumer-9dof.yaml",
                          "-o",
                          folder.Path("few"),
                          "--set=motion=[{poses: {attitudes: {spread: 4}, rest_s: 3, move_s: 1.2, "
                          "tilt_sigma_deg: 5}}]"})
                .exit_code,
            0);
  const Finished run =
      RunTruetriad({"calibrate", folder.Path("few/recording.csv"), "-o", folder.Path("result")});
  EXPECT_EQ(run.exit_code, 0) << run.out;
  EXPECT_THAT(run.out, HasSubstr("since it gives no result otherwise"));
  EXPECT_THAT(RunTruetriad({"init", folder.Path("few/recording.csv")}).out,
              Not(HasSubstr("motion:")));
}

TEST(InitialExperimentOfALog, IsWrittenWithPathsAsSeenFromThere) {
  const TemporaryFolder folder;
  const std::string file = folder.Path("sub/unit.yaml");
  std::filesystem::create_directories(folder.Path("sub"));
  std::filesystem::copy_file(TRUETRIAD_SOURCE_DIR "/datasets/demo/recording.csv",
                             folder.Path("log.csv"));
  ASSERT_EQ(RunTruetriad({"init", folder.Path("log.csv"), "-o", file}).exit_code, 0);
  EXPECT_THAT(TemporaryFolder::Read(file), HasSubstr("input: \"../log.csv\""));
  EXPECT_EQ(RunTruetriad({"calibrate", "-c", file, "-o", folder.Path("result")}).exit_code, 0);
}

// What somebody wrote into it is not lost.
TEST(InitialExperimentOfALog, LeavesTheOneOfBeforeAsPrevious) {
  const TemporaryFolder folder;
  const std::vector<std::string> call = {
      "calibrate", "datasets/demo/recording.csv", "-o", folder.Path("unit")};
  ASSERT_EQ(RunTruetriad(call).exit_code, 0);
  ASSERT_EQ(RunTruetriad(call).exit_code, 0);
  EXPECT_FALSE(std::filesystem::exists(folder.Path("unit/experiment.previous.yaml")));
  folder.Write("unit/experiment.yaml", "experiment: 1 # mine");
  ASSERT_EQ(RunTruetriad(call).exit_code, 0);
  EXPECT_EQ(TemporaryFolder::Read(folder.Path("unit/experiment.previous.yaml")),
            "experiment: 1 # mine");
}

}  // namespace initial_experiment_test
}  // namespace truetriad
