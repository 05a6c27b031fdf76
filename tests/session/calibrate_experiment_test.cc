// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "io/temporary_folder.h"
#include "truetriad/config/experiment.h"
#include "truetriad/io/calibration_file.h"
#include "truetriad/session/session.h"

namespace truetriad {
namespace calibrate_experiment_test {

// A log is read once: what was seen of it to make the experiment is what is calibrated, unless the
// experiment asks for more.
TEST(InitialExperimentOfALog, IsCalibratedFromWhatWasRead) {
  const TemporaryFolder folder;
  const std::string log = folder.Path("log.csv");
  std::filesystem::copy_file(TRUETRIAD_SOURCE_DIR "/datasets/demo/recording.csv", log);
  Result<FirstLook> look = InitialExperiment({log}, "");
  ASSERT_TRUE(look) << look.error().message;
  const auto experiment = [&](const std::vector<std::string>& overrides) {
    Result<Experiment> read = ReadExperimentText(look->experiment_yaml, "e.yaml", overrides);
    EXPECT_TRUE(read) << read.error().message;
    read->inputs = {log};
    return *std::move(read);
  };
  const Result<Calibration> again = CalibrateExperiment(experiment({}));
  ASSERT_TRUE(again) << again.error().message;
  std::filesystem::remove(log);
  Result<Calibration> once = CalibrateExperiment(experiment({}), {}, look->loaded);
  ASSERT_TRUE(once) << once.error().message;
  once->created = again->created;
  EXPECT_EQ(CalibrationToYaml(*once), CalibrationToYaml(*again));
  EXPECT_FALSE(CalibrateExperiment(experiment({"poses=every_row"}), {}, look->loaded));
}

// By which a fleet knows a recording again.
TEST(ReadingsOf, AreTheSameHoweverALogIsWritten) {
  const TemporaryFolder folder;
  const std::string demo = TRUETRIAD_SOURCE_DIR "/datasets/demo/recording.csv";
  std::string text = TemporaryFolder::Read(demo);
  const auto of = [&](const std::string& log, std::optional<std::int64_t> most = std::nullopt) {
    std::string digests;
    for (const SensorReadings& one :
         ReadingsOf(log, most).value_or(std::vector<SensorReadings>())) {
      digests += one.sensor + one.digest;
    }
    return digests;
  };
  const std::string readings = of(demo), first = of(demo, 64);
  EXPECT_NE(readings, "");
  EXPECT_NE(readings, first);
  const std::string commented = folder.Write("commented.csv", "# Another word.\n" + text);
  EXPECT_EQ(of(commented), readings);
  EXPECT_EQ(of(commented, 64), first);
  const std::size_t end_of_time = text.find(',', text.rfind('\n', text.size() - 2));
  const std::string later = folder.Write("later.csv", std::string(text).insert(end_of_time, "1"));
  EXPECT_EQ(of(later), readings);
  text.insert(text.find(',', end_of_time + 1), "1");  // The last reading's first value.
  const std::string other = folder.Write("other.csv", text);
  EXPECT_NE(of(other), readings);
  EXPECT_EQ(of(other, 64), first);
}

}  // namespace calibrate_experiment_test
}  // namespace truetriad
