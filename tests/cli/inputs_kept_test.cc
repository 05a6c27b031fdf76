// SPDX-License-Identifier: Apache-2.0
// No output takes the place of an input: a recording that was measured cannot be had again.
#include <filesystem>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cli/command_line_run.h"
#include "support/log_writer.h"

namespace truetriad {
namespace inputs_kept_test {

namespace fs = std::filesystem;

using ::testing::HasSubstr;

class InputsKept : public ::testing::Test {
 protected:
  void SetUp() override {
    LogOptions options;
    options.magnetometer = false;
    folder_.Write("log.csv", LogText(options));
    fs::create_directories(folder_.Path("sub"));
    fs::create_directories(folder_.Path("json"));
    const Finished run = Run("calibrate log.csv -o cal --quiet");
    ASSERT_EQ(run.exit_code, 0) << run.err;
    fs::copy_file(folder_.Path("cal/calibration.yaml"), folder_.Path("c.yaml"));
    fs::copy_file(folder_.Path("c.yaml"), folder_.Path("p.html"));
    const fs::path demo = TRUETRIAD_SOURCE_DIR "/datasets/demo";
    fs::copy_file(demo / "recording.csv", folder_.Path("demo.csv"));
    fs::copy_file(demo / "poses.yaml", folder_.Path("poses.html"));
    fs::copy_file(folder_.Path("log.csv"), folder_.Path("log.html"));
    fs::create_hard_link(folder_.Path("log.html"), folder_.Path("hard.html"));
    fs::create_symlink(folder_.Path("log.html"), folder_.Path("soft.html"));
    fs::copy_file(folder_.Path("log.csv"), folder_.Path("sub/report.html"));
    fs::copy_file(folder_.Path("log.csv"), folder_.Path("json/calibration.json"));
    folder_.Write("sub/manifest.yaml", Manifest("report.html"));
    folder_.Write("sub/recording.yaml", Readings());
    folder_.Write("sub/imu.csv", Readings());
  }

  static std::string Manifest(const std::string& file) {
    return "recording: 1\napplied: none\nstreams:\n  accelerometer: { file: " + file +
           ", time: { column: \"time[s]\", unit: s }, x: \"accel_x[m/s^2]\", "
           "y: \"accel_y[m/s^2]\", z: \"accel_z[m/s^2]\", unit: m/s^2 }\n";
  }

  /// JSON arrays, whatever its name.
  static std::string Readings() { return R"({"t": [0, 1], "a": [[0, 0, 9.8], [0, 9.8, 0]]})"; }

  /// A line of `truetriad`, in the folder.
  Finished Run(const std::string& line) const {
    return RunShell("'" TRUETRIAD_BINARY "' " + line, folder_.Path(""));
  }

  const TemporaryFolder folder_;
};

TEST_F(InputsKept, ByEveryVerb) {
  struct Call {
    std::string line;
    std::string input;
  };
  const std::vector<Call> calls = {
      {"inspect log.html --report=log.html", "log.html"},
      {"inspect hard.html --report=log.html", "log.html"},
      {"inspect log.html --report=soft.html", "log.html"},
      {"inspect sub/manifest.yaml --report=sub/report.html", "sub/report.html"},
      {"evaluate p.html log.csv --report=p.html", "p.html"},
      {"evaluate c.yaml log.html --report=soft.html", "log.html"},
      {"inspect demo.csv --poses=file:poses.html --report=poses.html", "poses.html"},
      {"compare p.html cal/calibration.yaml --report=./cal/../p.html", "p.html"},
      {"apply c.yaml log.csv -o log.csv", "log.csv"},
      {"apply c.yaml log.csv -o c.yaml", "c.yaml"},
      {"export --calibration=c.yaml --to=json -o c.yaml", "c.yaml"},
      {"report --calibration=p.html -o p.html", "p.html"},
      {"calibrate sub/report.html -o sub", "sub/report.html"},
      {"calibrate sub/report.html -o sub --report=false", "sub/report.html"},
      {"calibrate json/calibration.json -o json", "json/calibration.json"},
      {"calibrate sub/manifest.yaml -o sub", "sub/report.html"},
      {"convert --from=json sub/recording.yaml -o sub --columns=time=t,accelerometer=a "
       "--units=s,m/s^2",
       "sub/recording.yaml"},
  };
  for (const Call& call : calls) {
    SCOPED_TRACE(call.line);
    const std::string before = TemporaryFolder::Read(folder_.Path(call.input));
    ASSERT_FALSE(before.empty());
    const Finished run = Run(call.line);
    EXPECT_EQ(run.exit_code, 1) << run.out;
    EXPECT_THAT(run.err, HasSubstr("would be overwritten, and it is an input"));
    EXPECT_TRUE(fs::exists(folder_.Path(call.input)));
    EXPECT_EQ(TemporaryFolder::Read(folder_.Path(call.input)) == before, true);
  }
  EXPECT_FALSE(fs::exists(folder_.Path("sub/calibration.yaml")));
  EXPECT_FALSE(fs::exists(folder_.Path("sub/experiment.yaml")));
}

// A day's runs are nowhere else.
TEST_F(InputsKept, StoresAreNotReplaced) {
  ASSERT_EQ(Run("fleet run log.csv -o a").exit_code, 0);
  ASSERT_EQ(Run("fleet run log.csv -o b --store=b/0.jsonl").exit_code, 0);
  const std::string again = "fleet export --store=a/fleet.db --to=jsonl -o a/all.jsonl";
  ASSERT_EQ(Run(again).exit_code, 0);
  for (const std::string store : {"a/fleet.db", "b/0.jsonl", "a/all.jsonl"}) {
    const std::string before = TemporaryFolder::Read(folder_.Path(store));
    fs::copy_file(folder_.Path("a/fleet.db"), folder_.Path("other.db"));
    for (const std::string line : {"fleet export --store=other.db --to=csv -o ",
                                   "fleet export --store=other.db --to=parquet -o ",
                                   "apply c.yaml log.csv -o ",
                                   "export --calibration=c.yaml --to=json -o "}) {
      const Finished run = Run(line + store);
      EXPECT_EQ(run.exit_code, 2) << line;
      EXPECT_THAT(run.err, HasSubstr(store + ": is a fleet's store")) << line;
    }
    fs::remove(folder_.Path("other.db"));
    EXPECT_EQ(TemporaryFolder::Read(folder_.Path(store)) == before, true);
  }
  EXPECT_EQ(Run("fleet export --store=a/fleet.db --to=jsonl -o b/0.jsonl").exit_code, 2);
  EXPECT_EQ(Run(again).exit_code, 0);
}

// Bad usage and bad input touch nothing, whatever a run before has left where they would write.
TEST_F(InputsKept, AsAreResultsOfBeforeWhereAVerbRefuses) {
  const std::string configs = "'" TRUETRIAD_SOURCE_DIR "/configs/";
  const std::string foreign = "convert --from=kalibr-csv -o out/converted '" TRUETRIAD_SOURCE_DIR
                              "/datasets/foreign/imu0.csv'";
  const std::vector<std::string> good = {
      "calibrate log.csv -o out/calibrated",
      "plan " + configs + "plans/joint-12.yaml' -o out/planned",
      "simulate -c " + configs + "scenarios/six-position.yaml' -o out/simulated",
      "allan log.csv -o out/allan --report=out/allan.html",
      "inspect log.csv --report=out/inspected.html",
      "evaluate c.yaml demo.csv --report=out/evaluated.html",
      "fleet run log.csv -o out/fleet --to=json",
      foreign,
      "export --calibration=c.yaml --to=json -o out/c.json",
      "report --calibration=c.yaml -o out/reports"};
  for (const std::string& line : good) {
    EXPECT_THAT(Run(line).exit_code, ::testing::AnyOf(0, 3)) << line;
  }
  fs::remove(folder_.Path("out/allan/allan.svg"));
  fs::create_directories(folder_.Path("out/allan/allan.svg/folder"));
  const auto before = FilesIn(folder_.Path("out"));
  EXPECT_GT(before.size(), 20U);
  folder_.Write("bad.csv", "time[s],accel_x[m/s^2]\n0,x\n");
  for (const std::string& line : std::vector<std::string>{
           "calibrate log.csv -o out/calibrated --set=model=diagonal",
           "calibrate bad.csv -o out/calibrated",
           "calibrate none.csv -o out/calibrated",
           "plan " + configs + "plans/joint-12.yaml' -o out/planned --set=plan.poses=x",
           "simulate -c " + configs + "scenarios/six-position.yaml' -o out/simulated --set=x=1",
           "allan bad.csv -o out/allan --report=out/allan.html",
           "allan log.csv -o out/allan --report=out/allan.html",
           "inspect bad.csv --report=out/inspected.html",
           "evaluate c.yaml bad.csv --report=out/evaluated.html",
           "fleet run none.csv -o out/fleet",
           "fleet run log.csv -o out/fleet -c " + configs +
               "experiments/accelerometer-only.yaml' --set=model=diagonal",
           "fleet run log.csv -o out/fleet --set=model=diagonal",
           "fleet run log.csv -o out/fleet --time-limit=x",
           foreign + " --units=g",
           "convert --from=kalibr-csv -o out/converted bad.csv",
           "export --calibration=bad.csv --to=json -o out/c.json",
           "export --calibration=c.yaml --to=px4 --max-loss=-1 -o out/c.json",
           "report --calibration=c.yaml,bad.csv -o out/reports"}) {
    EXPECT_THAT(Run(line).exit_code, ::testing::AnyOf(1, 2)) << line;
    EXPECT_EQ(FilesIn(folder_.Path("out")) == before, true) << line;
  }
}

TEST_F(InputsKept, ResultsOfBeforeAreReplaced) {
  EXPECT_EQ(Run("calibrate log.csv -o cal").exit_code, 0);
  EXPECT_EQ(Run("calibrate log.csv -c cal/experiment.yaml -o cal").exit_code, 0);
  EXPECT_EQ(Run("report --calibration=cal/calibration.yaml -o cal/report.html").exit_code, 0);
}

}  // namespace inputs_kept_test
}  // namespace truetriad
