// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cli/command_line_run.h"
#include "truetriad/io/pose_program_file.h"

namespace truetriad {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class PlanVerb : public ::testing::Test {
 protected:
  // An accelerometer of known noise with this `plan:` block.
  std::string Experiment(const std::string& plan, const std::string& noise = "{ sigma: 0.003 }") {
    return folder_.Write("plan.yaml",
                         "experiment: 1\nsensors: { accelerometer: { noise: " + noise +
                             " } }\nplan: " + plan + "\n");
  }

  TemporaryFolder folder_;
};

TEST_F(PlanVerb, WritesAProgramWithPicturesAndPredictsItsSigmas) {
  const Finished run = RunTruetriad({"plan",
                                     "--config=" + Experiment("{ poses: 12, rotations: hand }"),
                                     "--output=" + folder_.Path("out")});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.err, IsEmpty());
  EXPECT_THAT(run.out,
              AllOf(HasSubstr("GOOD PLAN"),
                    HasSubstr("accelerometer bias x"),
                    HasSubstr("x up, z 45 deg above level"),
                    HasSubstr("random ones")));
  const auto program = ReadPoseProgram(folder_.Path("out/program.yaml"));
  ASSERT_TRUE(program) << program.error().message;
  EXPECT_EQ(program->poses.size(), 12U);
  const std::string page = TemporaryFolder::Read(folder_.Path("out/program.html"));
  EXPECT_THAT(page, AllOf(HasSubstr("pose 12"), HasSubstr("<svg"), HasSubstr("</html>")));
}

TEST_F(PlanVerb, JudgesTheProgramThatItWroteAsItWasPredicted) {
  const std::string config = Experiment("{ poses: 12, rotations: hand, random: 0 }");
  const Finished made =
      RunTruetriad({"plan", "--config=" + config, "--output=" + folder_.Path("out")});
  const Finished judged =
      RunTruetriad({"plan", "--config=" + config, "--program=" + folder_.Path("out/program.yaml")});
  EXPECT_EQ(judged.exit_code, 0) << judged.err;
  const std::string predicted = made.out.substr(made.out.find("Predicted"));
  EXPECT_THAT(predicted, HasSubstr(judged.out.substr(judged.out.find("Predicted"))));
}

TEST_F(PlanVerb, ExitsWithThreeWhenAProgramCannotSeeEverything) {
  PoseProgram level;
  for (int k = 0; k < 12; ++k) {
    const Eigen::Quaterniond x_up(Eigen::AngleAxisd(-1.5707963267948966, Eigen::Vector3d::UnitY()));
    level.poses.push_back(
        {x_up * Eigen::AngleAxisd(0.5 * k, Eigen::Vector3d::UnitZ()), {}, "z level"});
  }
  const std::string program = folder_.Write("level.yaml", PoseProgramToYaml(level));
  const Finished run =
      RunTruetriad({"plan", "--config=" + Experiment("{ poses: 12 }"), "--program=" + program});
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_THAT(run.out,
              AllOf(HasSubstr("NOT ENOUGH"), HasSubstr("scale z"), HasSubstr("add poses")));
}

TEST_F(PlanVerb, ExitsWithThreeWhenWantedSigmasAreOutOfReach) {
  const Finished run = RunTruetriad(
      {"plan",
       "--config=" + Experiment("{ wanted: { accelerometer.bias: 1.0e-5 }, max_poses: 15 }")});
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_THAT(run.out, AllOf(HasSubstr("NOT AS GOOD AS WANTED"), HasSubstr("FAIL")));
}

TEST_F(PlanVerb, RefusesWhatItCannotPlanFor) {
  const Finished no_noise =
      RunTruetriad({"plan", "--config=" + Experiment("{ poses: 12 }", "{ excess: none }")});
  EXPECT_EQ(no_noise.exit_code, 2);
  EXPECT_THAT(no_noise.err, HasSubstr("noise is not stated"));

  const Finished no_gain =
      RunTruetriad({"plan",
                    "--config=" + Experiment("{ poses: 12, nominal: { accelerometer: { "
                                             "unit: counts } } }")});
  EXPECT_EQ(no_gain.exit_code, 2);
  EXPECT_THAT(no_gain.err, HasSubstr("sensitivity: 400"));

  const Finished no_plan = RunTruetriad(
      {"plan", "--config=" + folder_.Write("experiment.yaml", kAccelerometerExperiment)});
  EXPECT_EQ(no_plan.exit_code, 1);
  EXPECT_THAT(no_plan.err, HasSubstr("plan:"));

  const Finished no_count = RunTruetriad({"plan", "--config=" + Experiment("{ rotations: hand }")});
  EXPECT_EQ(no_count.exit_code, 1);
  EXPECT_THAT(no_count.err, HasSubstr("how many poses"));
}

// The same file plans, and then calibrates.
TEST_F(PlanVerb, CompletesARecordingThatTheSameFileCalibrates) {
  const std::string config = "--config=configs/plans/complete-recording.yaml";
  const Finished plan = RunTruetriad({"plan", config});
  EXPECT_EQ(plan.exit_code, 0) << plan.err;
  EXPECT_THAT(plan.out, AllOf(HasSubstr("beside the"), HasSubstr("before")));
  const Finished calibrated =
      RunTruetriad({"calibrate", config, "--output=" + folder_.Path("out")});
  EXPECT_EQ(calibrated.exit_code, 0) << calibrated.err;
}

}  // namespace
}  // namespace truetriad
