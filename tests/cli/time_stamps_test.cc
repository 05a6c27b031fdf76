// SPDX-License-Identifier: Apache-2.0
//
// A host that stamps samples when they arrive, several at a time: simulate, inspect, calibrate.

#include <algorithm>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cli/command_line_run.h"
#include "support/finding_matchers.h"
#include "support/log_writer.h"
#include "truetriad/io/calibration_file.h"

namespace truetriad {
namespace time_stamps_test {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ContainsRegex;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

const std::string kConfigs = TRUETRIAD_SOURCE_DIR "/configs/";

// The times in the first column become those of the last row that arrives with it.
std::string StampedOnArrival(const std::string& csv) {
  std::istringstream lines(csv);
  std::string comment, header;
  std::getline(lines, comment);
  std::getline(lines, header);
  std::vector<std::string> rows;
  for (std::string row; std::getline(lines, row);) rows.push_back(row);
  std::string text = comment + "\n" + header + "\n";
  std::size_t size = 5;
  for (std::size_t begin = 0; begin < rows.size();) {
    const std::size_t end = std::min(begin + size, rows.size());
    const std::string stamp = rows[end - 1].substr(0, rows[end - 1].find(','));
    for (; begin < end; ++begin) text += stamp + rows[begin].substr(rows[begin].find(',')) + "\n";
    size = size == 11 ? 5 : size + 3;
  }
  return text;
}

class StampedByAHost : public ::testing::Test {
 protected:
  StampedByAHost() {
    const Finished run = RunTruetriad({"simulate",
                                       "--config=" + kConfigs + "scenarios/tumble-by-hand.yaml",
                                       "--output=" + folder_.Path("run")});
    EXPECT_EQ(run.exit_code, 0) << run.err;
    for (const std::string sensor : {"accelerometer", "gyroscope", "magnetometer"}) {
      const std::string name = "run/" + sensor + ".csv";
      folder_.Write(name, StampedOnArrival(TemporaryFolder::Read(folder_.Path(name))));
    }
  }
  Finished Calibrate(const std::string& time) {
    return RunTruetriad({"calibrate",
                         "--config=" + kConfigs + "experiments/tumble.yaml",
                         "--input=" + folder_.Path("run/recording.yaml"),
                         "--output=" + folder_.Path("found"),
                         "--report=false",
                         "--set=time=" + time});
  }
  Calibration Found() {
    const auto read = ReadCalibration(folder_.Path("found/calibration.yaml"));
    EXPECT_TRUE(read) << read.error().message;
    return read ? *read : Calibration();
  }
  TemporaryFolder folder_;
};

TEST_F(StampedByAHost, IsCalibratedAtEvenTimesAndSaysSo) {
  const Finished inspection =
      RunTruetriad({"inspect", "--input=" + folder_.Path("run/recording.yaml")});
  EXPECT_THAT(inspection.out, ContainsRegex("gyroscope .* in bursts"));
  EXPECT_THAT(inspection.out, ContainsRegex("treated\\s+as\\s+evenly\\s+spaced\\s+instead"));

  const Finished run = Calibrate("auto");
  EXPECT_EQ(run.exit_code, 0) << run.out << run.err;
  const Calibration found = Found();
  EXPECT_THAT(found.findings,
              Contains(AllOf(HasCode(FindingCode::kEvenTimes), IsAbout(Triad::kGyroscope))));
  EXPECT_THAT(found.config_yaml, HasSubstr("time: auto"));
  const Finished compare = RunTruetriad({"compare",
                                         "--a=" + folder_.Path("run/truth.yaml"),
                                         "--b=" + folder_.Path("found/calibration.yaml")});
  EXPECT_THAT(compare.out, StartsWith("AGREE"));
}

TEST_F(StampedByAHost, IsTakenAsStampedIfToldTo) {
  EXPECT_EQ(Calibrate("as_stamped").exit_code, 3);
  const Calibration found = Found();
  EXPECT_THAT(found.findings, Contains(HasCode(FindingCode::kUnevenTimes)));
  EXPECT_THAT(found.findings, Not(Contains(HasCode(FindingCode::kEvenTimes))));
  EXPECT_THAT(found.config_yaml, HasSubstr("time: as_stamped"));
}

// Without a gyroscope no turn is broken by it, and yet it may be another unit from there on.
TEST(TimeStamps, ThatBeginAnewSayWhereALogWasPutTogether) {
  const TemporaryFolder folder;
  const std::string first = LogText({.rests = 12, .magnetometer = false});
  const std::string second = LogText({.rests = 12, .magnetometer = false, .seed = 2});
  const std::string log = folder.Write("log.csv", first + second.substr(second.find("\n0") + 1));
  const Finished inspect = RunTruetriad({"inspect", log});
  EXPECT_THAT(inspect.out, HasSubstr("pieces of recordings are joined at"));
  const Finished calibrate = RunTruetriad({"calibrate", log});
  EXPECT_THAT(calibrate.out, HasSubstr("[warning, joined-recording]"));
}

}  // namespace time_stamps_test
}  // namespace truetriad
