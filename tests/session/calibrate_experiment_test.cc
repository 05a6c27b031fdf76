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

}  // namespace calibrate_experiment_test
}  // namespace truetriad
