// SPDX-License-Identifier: Apache-2.0
//
// Two calibrations on one log: what a vehicle carries beside a better one, in whatever units.
#include <cmath>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "cli/command_line_run.h"

namespace truetriad {
namespace side_by_side_test {

using nlohmann::json;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

/// A simulated vehicle whose log is in g, deg/s and gauss, and its parameters as PX4 has them.
class SideBySideVerb : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TemporaryFolder;
    const std::string scenario = TRUETRIAD_SOURCE_DIR "/configs/scenarios/consumer-9dof.yaml";
    const Finished run =
        RunTruetriad({"simulate",
                      scenario,
                      "--set=sensors.accelerometer.unit=g,sensors.gyroscope.unit=deg/s,"
                      "sensors.magnetometer.unit=G",
                      "-o",
                      folder_->Path("vehicle")});
    ASSERT_EQ(run.exit_code, 0) << run.err;
    const Finished exported =
        RunTruetriad({"export", Truth(), "--to=px4", "-o", folder_->Path("px4.params")});
    ASSERT_EQ(exported.exit_code, 0) << exported.err;
    Import("px4.params", "carried.yaml");
  }
  static void TearDownTestSuite() { delete folder_; }

  static void Import(const std::string& parameters, const std::string& name) {
    const Finished run = RunTruetriad(
        {"import", "--from=px4", folder_->Path(parameters), "-o", folder_->Path(name)});
    ASSERT_EQ(run.exit_code, 0) << run.err;
  }

  static std::string Truth() { return folder_->Path("vehicle/truth.yaml"); }
  static std::string Carried() { return folder_->Path("carried.yaml"); }
  static std::string Log() { return folder_->Path("vehicle/recording.yaml"); }

  /// The result as JSON; its `error` of one name.
  static json Evaluate(std::vector<std::string> words) {
    words.insert(words.begin(), "evaluate");
    words.emplace_back("--json");
    const Finished run = RunTruetriad(words);
    EXPECT_EQ(run.exit_code, 0) << run.out << run.err;
    return json::parse(run.out)["result"];
  }
  static json ErrorIn(const json& result, const std::string& name) {
    for (const json& error : result["errors"]) {
      if (error["error"] == name) return error;
    }
    ADD_FAILURE() << name << " is missing in " << result;
    return {};
  }

  static TemporaryFolder* folder_;
};
TemporaryFolder* SideBySideVerb::folder_ = nullptr;

TEST_F(SideBySideVerb, SaysHowMuchBetterThanWhatTheVehicleHas) {
  const std::string page = folder_->Path("page.html");
  const Finished run = RunTruetriad({"evaluate", Truth(), Carried(), Log(), "--report=" + page});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, StartsWith("A IS BETTER on these 24 poses: B's errors are up to "));
  for (const std::string& text : {run.out, TemporaryFolder::Read(page)}) {
    EXPECT_THAT(text, AllOf(HasSubstr("mm/s²"), HasSubstr("µT"), HasSubstr("deg")));
    EXPECT_THAT(text, HasSubstr("Gravity after a turn"));
    EXPECT_THAT(text, HasSubstr("Angle, field to gravity"));
  }
  const json result = Evaluate({Truth(), Carried(), Log()});
  EXPECT_EQ(result["better"], "a");
  EXPECT_EQ(result["errors"].size(), 7U);
  // PX4 has no misalignment of the accelerometer: 6, 9 and 4 mrad of it times 9.8 m/s^2.
  const json force = ErrorIn(result, "accelerometer");
  EXPECT_EQ(force["unit"], "mm/s^2");
  EXPECT_LT(force["a"], 10.0);
  EXPECT_GT(force["b"], 20.0);
  // Nor gains of the gyroscope, 1 % of turns of some 60 degrees.
  const json turn = ErrorIn(result, "turn");
  EXPECT_EQ(turn["unit"], "deg");
  EXPECT_LT(turn["a"], 0.2);
  EXPECT_GT(turn["b"], 0.3);
  EXPECT_EQ(turn["better"], "a");
}

TEST_F(SideBySideVerb, KnowsCalibrationsFromLogsByTheirContent) {
  const json expected = Evaluate({Truth(), Carried(), Log()})["errors"];
  EXPECT_EQ(Evaluate({Log(), Truth(), Carried()})["errors"], expected);
  EXPECT_EQ(Evaluate({Truth(), Log(), Carried()})["errors"], expected);
  // The one alone, in either order.
  EXPECT_EQ(Evaluate({Log(), Truth()}), Evaluate({Truth(), Log()}));
}

TEST_F(SideBySideVerb, StatesAWrongOffsetInMillimetres) {
  std::string parameters = TemporaryFolder::Read(folder_->Path("px4.params"));
  const std::string key = "CAL_ACC0_XOFF\t";
  const std::size_t at = parameters.find(key) + key.size();
  const std::size_t end = parameters.find('\t', at);
  constexpr double kOffMps2 = 0.3;
  parameters.replace(
      at, end - at, std::to_string(std::stod(parameters.substr(at, end - at)) + kOffMps2));
  folder_->Write("drifted.params", parameters);
  Import("drifted.params", "drifted.yaml");
  const json result = Evaluate({Carried(), folder_->Path("drifted.yaml"), Log()});
  EXPECT_EQ(result["better"], "a");
  const json force = ErrorIn(result, "accelerometer-spread");
  const double more =
      std::sqrt(std::pow(force["b"].get<double>(), 2) - std::pow(force["a"].get<double>(), 2));
  // By the part along gravity, RMS 1/√3 over attitudes that are spread evenly; 24 of them, and what
  // the other errors add to it.
  EXPECT_NEAR(more / (1e3 * kOffMps2 / std::sqrt(3.0)), 1.0, 0.2);
  EXPECT_EQ(ErrorIn(result, "magnetometer-spread")["better"], "neither");
}

TEST_F(SideBySideVerb, FailsOnRequestWhereTheFirstIsWorse) {
  EXPECT_EQ(RunTruetriad({"evaluate", Truth(), Carried(), Log(), "--fail-on=worse"}).exit_code, 0);
  const Finished run = RunTruetriad({"evaluate", Carried(), Truth(), Log(), "--fail-on=worse"});
  EXPECT_EQ(run.exit_code, 4);
  EXPECT_THAT(run.out, StartsWith("B IS BETTER"));
}

TEST_F(SideBySideVerb, RefusesWhatAreNotTwoCalibrationsAndALog) {
  const auto error = [](const std::vector<std::string>& words) {
    std::vector<std::string> call = {"evaluate"};
    call.insert(call.end(), words.begin(), words.end());
    const Finished run = RunTruetriad(call);
    EXPECT_EQ(run.exit_code, 1);
    return run.err;
  };
  EXPECT_THAT(error({Truth(), Log(), Log()}),
              HasSubstr("these are 1 calibration and 2 recordings; expected one or two "
                        "calibrations and one recording"));
  EXPECT_THAT(error({Truth(), Truth(), Truth(), Log()}), HasSubstr("these are 3 calibrations"));
}

TEST_F(SideBySideVerb, ComparesCalibrationsInOtherUnits) {
  const Finished run = RunTruetriad({"compare", Truth(), Carried()});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("magnetometer.bias.x"));
}

}  // namespace side_by_side_test
}  // namespace truetriad
