// SPDX-License-Identifier: Apache-2.0
// A file can be called anything; what is written of it stays valid.
#include <filesystem>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include "base/utf8.h"
#include "cli/command_line_run.h"
#include "support/log_writer.h"

namespace truetriad {
namespace odd_names_test {

namespace fs = std::filesystem;

using ::testing::HasSubstr;

TEST(OddNames, AreShownInFilesThatAreStillUtf8) {
  const TemporaryFolder folder;
  LogOptions options;
  options.magnetometer = false;
  const std::string name = "a\xFF\u2028<b>\u0085.csv";
  folder.Write(name, LogText(options));
  const Finished run =
      RunShell("'" TRUETRIAD_BINARY "' calibrate '" + name + "' -o out", folder.Path(""));
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_TRUE(IsUtf8(run.out));
  for (const char* file :
       {"calibration.yaml", "calibration.json", "report.html", "experiment.yaml"}) {
    const std::string text = TemporaryFolder::Read(folder.Path(std::string("out/") + file));
    EXPECT_TRUE(IsUtf8(text)) << file;
    // To some readers of YAML the end of a line.
    const bool is_yaml = fs::path(file).extension() == ".yaml";
    EXPECT_EQ(is_yaml && text.find("\u2028") != std::string::npos, false) << file;
  }
  const YAML::Node calibration = YAML::LoadFile(folder.Path("out/calibration.yaml"));
  EXPECT_THAT(calibration["inputs"][0]["file"].as<std::string>(),
              HasSubstr("a\\xFF\u2028<b>\u0085.csv"));
  // By its hash, whatever it is called: the recording is known as the one it was made from.
  const Finished again = RunShell(
      "'" TRUETRIAD_BINARY "' evaluate --calibration=out/calibration.yaml --input='" + name + "'",
      folder.Path(""));
  EXPECT_THAT(again.out + again.err, HasSubstr("made from"));
}

}  // namespace odd_names_test
}  // namespace truetriad
