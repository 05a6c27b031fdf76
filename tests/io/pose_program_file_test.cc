// SPDX-License-Identifier: Apache-2.0
#include "io/pose_program_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "io/temporary_folder.h"

namespace truetriad {
namespace pose_program_file_test {

using ::testing::AllOf;
using ::testing::HasSubstr;

class PoseProgramFile : public ::testing::Test {
 protected:
  Result<PoseProgram> Read(const std::string& text) {
    return ReadPoseProgram(folder_.Write("poses.yaml", text));
  }
  std::string ErrorOf(const std::string& text) {
    const Result<PoseProgram> program = Read(text);
    return program ? "" : program.error().message;
  }

  TemporaryFolder folder_;
};

TEST_F(PoseProgramFile, ReadsBackToTheSameBits) {
  PoseProgram program;
  for (int i = 0; i < 50; ++i) {
    ProgramPose pose;
    const Eigen::Vector3d axis(0.3, -0.1 * i, 0.7);
    pose.world_from_body = Eigen::AngleAxisd(0.1 * i, axis.normalized());
    if (i % 2 == 0) pose.temperature_degc = -40.0 + i / 3.0;
    if (i % 3 == 0) pose.label = "z \"up\", x: to the north # " + std::to_string(i);
    program.poses.push_back(pose);
  }
  const Result<PoseProgram> read = Read(PoseProgramToYaml(program));
  ASSERT_TRUE(read) << read.error().message;
  ASSERT_EQ(read->poses.size(), program.poses.size());
  for (std::size_t i = 0; i < program.poses.size(); ++i) {
    EXPECT_EQ(read->poses[i].world_from_body.coeffs(), program.poses[i].world_from_body.coeffs());
    EXPECT_EQ(read->poses[i].temperature_degc, program.poses[i].temperature_degc);
    EXPECT_EQ(read->poses[i].label, program.poses[i].label);
  }
}

TEST_F(PoseProgramFile, TakesQuaternionsAsPeopleWriteThem) {
  const Result<PoseProgram> program =
      Read("program: 1\nposes:\n  - attitude: [0.7071, 0, 0.7071, 0]\n");
  ASSERT_TRUE(program) << program.error().message;
  EXPECT_NEAR(program->poses[0].world_from_body.norm(), 1.0, 1e-15);
  EXPECT_FALSE(program->poses[0].temperature_degc);
  EXPECT_EQ(program->poses[0].label, "");
}

TEST_F(PoseProgramFile, SaysWhatIsWrongWithItsLine) {
  EXPECT_THAT(ErrorOf("program: 1\nposes: []\n"), HasSubstr("poses.yaml:2: poses: has no poses"));
  EXPECT_THAT(ErrorOf("program: 2\nposes: [{attitude: [1, 0, 0, 0]}]\n"),
              HasSubstr("poses.yaml:1: program: version 2 is not supported"));
  EXPECT_THAT(ErrorOf("poses: [{attitude: [1, 0, 0, 0]}]\n"), HasSubstr("program: is missing"));
  EXPECT_THAT(ErrorOf("program: 1\nposes: 3\n"), HasSubstr("poses: expected a list"));
  EXPECT_THAT(ErrorOf("program: 1\n"
                      "poses:\n"
                      "  - { attitude: [90, 0, 0, 0] }\n"
                      "  - { attitude: [1, 0, 0] }\n"
                      "  - { label: up }\n"
                      "  - { attitude: [1, 0, 0, 0], temperature_degc: -300 }\n"
                      "  - { attitude: [1, 0, 0, 0], temperature: 20 }\n"
                      "  - { attitude: [0, 0, 0, 0] }\n"),
              AllOf(HasSubstr(":3: poses[0].attitude: is not a rotation"),
                    HasSubstr(":4: poses[1].attitude: has 3 numbers; expected four"),
                    HasSubstr(":5: poses[2].attitude: is missing"),
                    HasSubstr(":6: poses[3].temperature_degc: `-300` is out of range"),
                    HasSubstr(":7: poses[4].temperature: is not a known key"),
                    HasSubstr(":8: poses[5].attitude: is not a rotation")));
}

}  // namespace pose_program_file_test
}  // namespace truetriad
