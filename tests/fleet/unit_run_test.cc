// SPDX-License-Identifier: Apache-2.0
#include "fleet/unit_run.h"

#include <filesystem>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fleet/unit_work.h"
#include "io/temporary_folder.h"
#include "report/sample_calibration.h"

namespace truetriad::fleet {
namespace unit_run_test {

using ::testing::Lt;

UnitRun SampleRun() {
  UnitRun run;
  run.id = NewRunId();
  run.serial = "A\"0001';--\n";
  run.log = "line/ä b.csv";
  run.log_bytes = 1'400'000;
  run.log_modified_ns = 1'700'000'000'123'456'789;
  run.shard = "1/4";
  run.folder = "out/units/A0001";
  run.tags.lot = "L17";
  run.wall_s = 0.1;
  run.cpu_s = 1.0 / 3.0;
  Calibration calibration = SampleCalibration();
  calibration.findings.push_back(Finding(FindingCode::kClockOffset, "late")
                                     .About(Triad::kMagnetometer, 1)
                                     .AtPose(3)
                                     .With("offset", 1.0 / 7.0, 0.01, "s"));
  Fill(calibration, &run);
  run.tags.lot = "L17";
  return run;
}

TEST(UnitRun, ComesBackFromALineToTheLastBit) {
  const UnitRun run = SampleRun();
  ASSERT_FALSE(run.parameters.empty());
  const std::string line = LineOf(run);
  EXPECT_EQ(line.find('\n'), line.size() - 1);
  const Result<UnitRun> back = ReadLine(line);
  ASSERT_TRUE(back) << back.error().message;
  EXPECT_EQ(LineOf(*back), line);
  EXPECT_EQ(back->serial, run.serial);
  EXPECT_EQ(back->covariance, run.covariance);
  EXPECT_EQ(back->parameters.back().value, run.parameters.back().value);
  EXPECT_EQ(back->findings.back().values[0].value, 1.0 / 7.0);
  EXPECT_EQ(back->tags.lot, "L17");
}

TEST(UnitRun, IsNoLineWhenSomethingIsMissing) {
  EXPECT_FALSE(ReadLine("{}"));
  EXPECT_FALSE(ReadLine("{\"run\": 7}"));
  EXPECT_FALSE(ReadLine("nonsense"));
  std::string line = LineOf(SampleRun());
  EXPECT_FALSE(ReadLine(line.substr(0, line.size() / 2)));
}

TEST(UnitRun, SaysWhyAUnitIsNotGood) {
  UnitRun run;
  Calibration calibration = SampleCalibration();
  Fill(calibration, &run);
  EXPECT_EQ(run.verdict, Verdict::kPass);
  calibration.within_limits.reset();
  Fill(calibration, &run);
  EXPECT_EQ(run.verdict, Verdict::kNoLimits);
  calibration.within_limits = false;
  LimitCheck met, missed;
  met.name = "accelerometer.bias";
  met.component = "x";
  met.pass = true;
  missed.name = "gyroscope.bias";
  missed.component = "z";
  missed.limit = Limit::Within(0.01);
  missed.worst = -0.02;
  calibration.quality.limits = {met, missed};
  Fill(calibration, &run);
  EXPECT_EQ(run.verdict, Verdict::kFail);
  EXPECT_EQ(run.code, "limit:gyroscope.bias.z");
  EXPECT_EQ(run.message, "gyroscope.bias.z -0.02 of ± 0.01 rad/s");
  calibration.findings = {Finding(FindingCode::kTooFewPoses, "4 poses").As(Severity::kRefusal)};
  calibration.outcome = Outcome::kNotEnough;
  Fill(calibration, &run);
  EXPECT_EQ(run.verdict, Verdict::kNoResult);
  EXPECT_EQ(run.code, "too-few-poses");
  Fill(Error(ErrorCode::kMissingColumn, "no time"), &run);
  EXPECT_EQ(run.verdict, Verdict::kNoResult);
  EXPECT_EQ(run.code, "missing-column");
}

// A limit is for several numbers; a line wants to see each.
TEST(UnitRun, KeepsTheJudgementOfEveryComponent) {
  Calibration calibration = SampleCalibration();
  LimitCheck check;
  check.name = "accelerometer.bias", check.component = "z";
  check.limit = Limit::Within(0.3);
  check.worst = 0.4, check.sigma = 0.1, check.outside = 0.9;
  check.components = {{"x", 0.1, 0.01, 0.0, true}, {"z", 0.4, 0.1, 0.9, false}};
  LimitCheck stated;
  stated.name = "accelerometer.bias.y";
  stated.worst = 0.2, stated.pass = true;
  stated.components = {{"y", 0.2, 0.0, 0.0, true}};
  calibration.quality.limits = {check, stated};
  UnitRun run;
  Fill(calibration, &run);
  ASSERT_EQ(run.judgements.size(), 3u);
  EXPECT_EQ(run.judgements[0].FullName(), "accelerometer.bias.x");
  EXPECT_EQ(run.judgements[0].worst, 0.1);
  EXPECT_TRUE(run.judgements[0].pass);
  EXPECT_EQ(run.judgements[1].FullName(), "accelerometer.bias.z");
  EXPECT_EQ(run.judgements[1].limit.upper, 0.3);
  EXPECT_FALSE(run.judgements[1].pass);
  EXPECT_EQ(run.judgements[2].FullName(), "accelerometer.bias.y");
}

TEST(UnitRun, HasANameThatNoOtherHas) {
  std::string last = NewRunId();
  for (int i = 0; i < 1000; ++i) {
    const std::string next = NewRunId();
    EXPECT_NE(last, next);
    last = next;
  }
}

// A serial number stays one: no path goes out of the folder, and no two have the same.
TEST(FolderName, IsThatOfOneSerialAlone) {
  EXPECT_EQ(FolderNameOf("A-17_b.2"), "A-17_b.2");
  EXPECT_EQ(FolderNameOf("../x"), "%2E.%2Fx");
  EXPECT_EQ(FolderNameOf("a/b"), "a%2Fb");
  EXPECT_EQ(FolderNameOf("a%2Fb"), "a%252Fb");
  EXPECT_EQ(FolderNameOf("a\nb\"';"), "a%0Ab%22%27%3B");
  EXPECT_EQ(FolderNameOf(""), "%");
  const std::string a = FolderNameOf(std::string(400, 'a') + "1");
  const std::string b = FolderNameOf(std::string(400, 'a') + "2");
  EXPECT_THAT(a.size(), Lt(150u));
  EXPECT_NE(a, b);
}

// Whatever is wrong with the rest of it.
TEST(RunOf, IsOfTheUnitThatARecordingStates) {
  const TemporaryFolder folder;
  std::filesystem::create_directories(folder.Path("X"));
  const std::string log = folder.Write("X/recording.yaml",
                                       "recording: 1\nserial: A17\ndevice: { part: P }\n"
                                       "run: { lot: L1, station: S1 }\nstreams: { nonsense: 1 }\n");
  UnitOrder order{.log = log};
  order.tags.station = "S2";
  const UnitRun run = RunOf(WorkPlan(), order);
  EXPECT_EQ(run.serial, "A17");
  EXPECT_EQ(run.tags.part + run.tags.lot + run.tags.station, "PL1S2");
  EXPECT_EQ(RunOf(WorkPlan(), {.log = log, .serial = "B"}).serial, "B");
  folder.Write("X/recording.yaml", "recording: [\n");
  EXPECT_EQ(RunOf(WorkPlan(), {.log = log}).serial, "X");
}

TEST(WorkPlan, ComesBackFromALine) {
  WorkPlan plan;
  plan.config_text = "experiment: 1\n";
  plan.overrides = {"run.lot=\"a\\nb\""};
  plan.formats = {"px4"};
  plan.folder = "out";
  const Result<WorkPlan> back = ReadPlan(LineOf(plan));
  ASSERT_TRUE(back);
  EXPECT_EQ(LineOf(*back), LineOf(plan));
  UnitOrder order{.log = "a.csv", .serial = "7", .serial_from = "day.csv:2"};
  order.tags.lot = "3";
  const Result<UnitOrder> order_back = ReadOrder(LineOf(order));
  ASSERT_TRUE(order_back);
  EXPECT_EQ(LineOf(*order_back), LineOf(order));
  EXPECT_FALSE(PlanWork("", {}, {"px5"}));
}

}  // namespace unit_run_test
}  // namespace truetriad::fleet
