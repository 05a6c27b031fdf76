// SPDX-License-Identifier: Apache-2.0
//
// A unit that is tumbled by hand, as a user would calibrate it: simulate, calibrate, compare.

#include <sstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cli/command_line_run.h"

namespace truetriad {
namespace motion_test {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

const std::string kConfigs = TRUETRIAD_SOURCE_DIR "/configs/";

class TumbledByHand : public ::testing::Test {
 protected:
  TumbledByHand() {
    const Finished run = RunTruetriad({"simulate",
                                       "--config=" + kConfigs + "scenarios/tumble-by-hand.yaml",
                                       "--output=" + folder_.Path("tumble")});
    EXPECT_EQ(run.exit_code, 0) << run.err;
  }
  Finished Calibrate(const std::string& input, const std::string& set) {
    return RunTruetriad({"calibrate",
                         "--config=" + kConfigs + "experiments/tumble.yaml",
                         "--input=" + folder_.Path(input),
                         "--output=" + folder_.Path("found"),
                         "--report=false",
                         "--set=" + set});
  }
  TemporaryFolder folder_;
};

TEST_F(TumbledByHand, IsCalibratedWithoutAnyRest) {
  const Finished run = Calibrate("tumble/recording.yaml", "poses.motion.spacing_s=0.1");
  EXPECT_EQ(run.exit_code, 0) << run.out << run.err;
  EXPECT_THAT(run.out,
              AllOf(HasSubstr("tracked through the motion: a chain of 1251 attitudes"),
                    HasSubstr("correlated-residuals"),
                    HasSubstr("Noise is the σ of the mean at one attitude"),
                    Not(HasSubstr("rest noise")),
                    Not(HasSubstr("add poses"))));
  const Finished compare = RunTruetriad({"compare",
                                         "--a=" + folder_.Path("tumble/truth.yaml"),
                                         "--b=" + folder_.Path("found/calibration.yaml")});
  EXPECT_THAT(compare.out, StartsWith("AGREE"));
}

// The first turns are outliers then.
TEST_F(TumbledByHand, MayBeginWithAStuckGyroscope) {
  for (const int stuck : {10, 30, 60}) {
    std::istringstream lines(TemporaryFolder::Read(folder_.Path("tumble/gyroscope.csv")));
    std::string text, line, held;
    for (int row = 0; std::getline(lines, line);) {
      if (line.find_first_of("0123456789") == 0 && row++ < stuck) {
        const std::size_t comma = line.find(',');
        if (held.empty()) held = line.substr(comma);
        line = line.substr(0, comma) + held;
      }
      text += line + '\n';
    }
    folder_.Write("tumble/gyroscope.csv", text);
    const Finished run =
        Calibrate("tumble/recording.yaml", "sensors.magnetometer.time_offset_s=-0.1");
    EXPECT_EQ(run.exit_code, 0) << stuck << run.err;
  }
}

TEST_F(TumbledByHand, NeedsAGyroscopeAndTimes) {
  const Finished run = Calibrate("tumble/accelerometer.csv", "poses.motion.spacing_s=0.1");
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err, HasSubstr("accelerometer or magnetometer"));
  const Finished thermal =
      Calibrate("tumble/recording.yaml", "sensors.accelerometer.thermal.bias_order=1");
  EXPECT_EQ(thermal.exit_code, 2);
  EXPECT_THAT(thermal.err, HasSubstr("temperature terms need rests"));
}

}  // namespace motion_test
}  // namespace truetriad
