// SPDX-License-Identifier: Apache-2.0
#include "fleet/line_summary.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "io/temporary_folder.h"

namespace truetriad::fleet {
namespace line_summary_test {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::SizeIs;

constexpr double kCalibrationSigma = 0.03;

/// A store of a simulated line.
class LineOfUnits : public ::testing::Test {
 protected:
  void SetUp() override {
    Result<std::unique_ptr<Store>> opened = OpenStore(folder_.Path("fleet.db"));
    ASSERT_TRUE(opened) << opened.error().message;
    store_ = std::move(*opened);
  }

  /// A run, one a minute, whose accelerometer bias x is `bias`, judged by -+ 0.3.
  UnitRun RunOf(const std::string& serial, double bias) {
    const int minute = runs_++;
    std::array<char, 64> text{};
    std::snprintf(text.data(), text.size(), "2026-11-24T%02d:%02d:00Z", minute / 60, minute % 60);
    UnitRun run;
    run.recorded = run.created = text.data();
    run.recorded_by = "list";
    std::snprintf(text.data(), text.size(), "20261124T%04d00.000000Z-00000000", minute);
    run.id = text.data();
    run.serial = serial;
    run.log = serial + ".csv";
    run.log_bytes = minute;  // Of another recording than those before.
    run.wall_s = 0.5, run.cpu_s = 0.25;
    run.parameters = {{"accelerometer.bias.x", bias, kCalibrationSigma},
                      {"reference.dip_rad", 1.1, 0.001},
                      {"gyroscope.bias.z", 2.0 * bias, 0.5}};
    // Of the three: lower triangle.
    run.covariance = {kCalibrationSigma * kCalibrationSigma, 0.0, 1e-6, 0.002, 0.0, 0.25};
    LimitCheck check;
    check.name = "accelerometer.bias", check.component = "x";
    check.limit = Limit::Within(0.3);
    check.worst = bias, check.sigma = kCalibrationSigma;
    check.pass = std::abs(bias) <= 0.3;
    run.judgements = {check};
    run.verdict = check.pass ? Verdict::kPass : Verdict::kFail;
    if (!check.pass) run.code = "limit:accelerometer.bias.x";
    return run;
  }
  void Add(const UnitRun& run) { ASSERT_TRUE(store_->Add(run)); }
  void Refuse(const std::string& serial) {
    UnitRun run = RunOf(serial, 0.0);
    run.parameters.clear(), run.covariance.clear(), run.judgements.clear();
    run.verdict = Verdict::kNoResult, run.code = "too-few-poses";
    Add(run);
  }
  Json Summary(const SummaryOptions& options = {.now = "2026-11-24T12:00:00Z"}) {
    Result<Json> summary = Summarise(*store_, options);
    EXPECT_TRUE(summary) << summary.error().message;
    return summary ? *std::move(summary) : Json();
  }

  const TemporaryFolder folder_;
  std::unique_ptr<Store> store_;
  int runs_ = 0;
};

TEST_F(LineOfUnits, CountsWhatWasGoodAtFirstAndInTheEnd) {
  Add(RunOf("a", 0.1));
  Add(RunOf("b", 0.5));
  Add(RunOf("b", 0.2));  // Good at last.
  Add(RunOf("c", 0.6));
  Refuse("d");
  Refuse("e'; DROP TABLE run; --\n");
  ASSERT_TRUE(
      store_->Dispose({.id = NewRunId(), .serial = "c", .created = "", .who = "R", .why = "w"}));
  const Json summary = Summary();
  const Json& yield = summary["yield"];
  EXPECT_EQ(yield["units"], 5);
  EXPECT_EQ(yield["runs"], 6);
  EXPECT_EQ(yield["retested"], 1);
  EXPECT_EQ(yield["good_at_first"], 1);
  EXPECT_EQ(yield["good"], 3);  // a, b, and c by a person.
  EXPECT_EQ(yield["first"], "2026-11-24T00:00:00Z");
  EXPECT_EQ(yield["recorded_by"], Json({{"list", 5}}));
  EXPECT_TRUE(std::isnan(yield["units_per_hour"].get<double>()));  // Of five minutes nobody knows.
  ASSERT_THAT(summary["reasons"], SizeIs(1));
  EXPECT_EQ(summary["reasons"][0]["code"], "too-few-poses");
  EXPECT_EQ(summary["reasons"][0]["cumulative"], 1.0);
  EXPECT_EQ(yield["good_by_decision"], 1);
  EXPECT_THAT(
      SummaryText(summary),
      AllOf(HasSubstr("3 OF 5 GOOD: 60 %"), HasSubstr(", of these 1 by a person's decision")));
  // Units may be chosen by what they amount to.
  EXPECT_EQ(Summary({.where = "final_verdict = 'PASS' AND attempts = 2"})["yield"]["units"], 1);
  EXPECT_EQ(Summary({.where = "disposed_by = 'R'"})["yield"]["units"], 1);
}

TEST_F(LineOfUnits, SaysHowManyGoodUnitsNobodyJudged) {
  Add(RunOf("a", 0.1));
  UnitRun run = RunOf("b", 0.1);
  run.judgements.clear(), run.verdict = Verdict::kNoLimits;
  Add(run);
  const Json summary = Summary();
  EXPECT_EQ(summary["yield"]["good_without_limits"], 1);
  EXPECT_THAT(SummaryText(summary),
              AllOf(HasSubstr("2 OF 2 GOOD: 100 %"), HasSubstr(", of these 1 without limits\n")));
}

TEST_F(LineOfUnits, SaysWhenUnitsWereMeasuredAndHowThatIsKnown) {
  UnitRun early = RunOf("a", 0.1), late = RunOf("b", 0.1), unknown = RunOf("c", 0.1);
  late.recorded = "2026-11-24T02:00:00Z", late.recorded_by = "file";
  unknown.recorded.clear(), unknown.recorded_by.clear();
  // Calibrated again, from a copy.
  UnitRun again = RunOf("b", 0.1);
  for (UnitRun* const run : {&late, &again}) run->readings = {{"accelerometer", "bb"}};
  again.recorded = "2026-11-24T03:00:00Z", again.recorded_by = "file";
  for (const UnitRun& run : {late, unknown, early, again}) Add(run);
  const Json summary = Summary();
  EXPECT_EQ(summary["yield"]["first"], "2026-11-24T00:00:00Z");
  EXPECT_EQ(summary["yield"]["units_per_hour"], 0.5);
  EXPECT_THAT(
      SummaryText(summary),
      HasSubstr("measured 2026-11-24T00:00:00Z to 2026-11-24T02:00:00Z, 0.5 units an hour; 1"));
  EXPECT_EQ(summary["yield"]["recorded_by"]["file"], 1);
  EXPECT_EQ(summary["yield"]["recorded_by"]["nothing"], 1);
}

// Of each unit two recordings, the second of them worked first, and worked in any order.
TEST_F(LineOfUnits, FollowsTheTimeOfMeasurementAndNotThatOfTheWork) {
  const auto summary_of = [](bool is_reversed) {
    const TemporaryFolder folder;
    Result<std::unique_ptr<Store>> store = OpenStore(folder.Path("fleet.db"));
    std::vector<std::pair<std::string, double>> runs;  // Serial number and bias, by time.
    std::mt19937_64 random(4);
    std::normal_distribution<double> process(0.0, 0.05);
    for (int i = 0; i < 60; ++i) runs.emplace_back("u" + std::to_string(i % 30), process(random));
    for (int place = 0; place < 60; ++place) {
      const int i = is_reversed ? 59 - place : place;
      std::array<char, 64> text{};
      UnitRun run;
      std::snprintf(text.data(), text.size(), "2026-11-24T%02d:00:00Z", i / 3);
      run.recorded = text.data(), run.recorded_by = "list";
      run.created = "2026-11-25T00:00:00Z";
      std::snprintf(text.data(), text.size(), "20261125T0000%02d.000000Z-00000000", place);
      run.id = text.data();
      run.serial = runs[static_cast<std::size_t>(i)].first;
      run.log = std::to_string(i) + ".csv";
      run.log_bytes = i;
      const double bias = runs[static_cast<std::size_t>(i)].second + 0.003 * i;
      run.parameters = {{"accelerometer.bias.x", bias, 0.01}};
      run.covariance = {1e-4};
      run.tags.station = i < 30 ? "S1" : "S2";
      run.verdict = i % 7 == 0 ? Verdict::kFail : Verdict::kNoLimits;
      EXPECT_TRUE((*store)->Add(run));
    }
    const Result<Json> summary =
        Summarise(**store, {.now = "2026-11-25T00:00:00Z", .chart_points = 100});
    return SummaryText(*summary) + TextOf(*summary);
  };
  EXPECT_EQ(summary_of(false), summary_of(true));
}

TEST_F(LineOfUnits, SaysWhyMostFrequentFirst) {
  Refuse("a");
  Add(RunOf("b", 0.5));
  Add(RunOf("c", 0.5));
  UnitRun crashed = RunOf("d", 0.0);
  crashed.verdict = Verdict::kNoResult, crashed.code = kCrashed;
  Add(crashed);
  const Json summary = Summary();
  std::vector<std::string> codes;
  for (const Json& reason : summary["reasons"]) codes.push_back(reason["code"]);
  EXPECT_THAT(codes, ElementsAre("limit:accelerometer.bias.x", "crashed", "too-few-poses"));
  EXPECT_EQ(summary["reasons"][1]["cumulative"], 0.75);
}

TEST_F(LineOfUnits, LeavesNoColumnEmptyForWantOfAKey) {
  Refuse("a");
  Json summary = Summary();
  summary["reasons"][0].erase("share");
  try {
    SummaryText(summary);
    FAIL();
  } catch (const Json::exception& error) {
    EXPECT_THAT(error.what(), HasSubstr("'share'"));
  }
}

TEST_F(LineOfUnits, ReadsNumbersOfEveryUnitInTheOrderOfTime) {
  Add(RunOf("b", 0.125));
  Refuse("a");
  UnitRun other = RunOf("c", 0.5);
  other.parameters = {{"gyroscope.bias.z", 7.0, 1.0}};
  other.covariance = {0.75};
  other.tags.station = "S1", other.tags.operator_name = "Ann";
  Add(other);
  const Result<LineReading> line = ReadUnits(*store_);
  ASSERT_TRUE(line) << line.error().message;
  EXPECT_THAT(line->data.parameters, ElementsAre("accelerometer.bias.x", "gyroscope.bias.z"));
  ASSERT_THAT(line->data.units, SizeIs(3));
  EXPECT_EQ(line->data.units[0].serial, "b");
  EXPECT_EQ(line->data.units[0].values, Eigen::Vector2d(0.125, 0.25));
  EXPECT_TRUE(line->data.units[1].values.array().isNaN().all());
  EXPECT_TRUE(std::isnan(line->data.units[2].values[0]));
  EXPECT_EQ(line->data.units[2].sigma[1], 1.0);
  EXPECT_EQ(line->data.units[2].tags,
            (std::map<std::string, std::string>{{"operator", "Ann"}, {"station", "S1"}}));
  ASSERT_THAT(line->judged, SizeIs(1));
  const Quantity judged = line->JudgedOf("accelerometer.bias.x");
  EXPECT_EQ(judged.unit, "m/s^2");
  EXPECT_THAT(judged.units, ElementsAre(0, 2));
  EXPECT_EQ(judged.missed, 1);
}

TEST_F(LineOfUnits, LooksAtTheUnitsThatAreAskedFor) {
  for (int i = 0; i < 6; ++i) {
    UnitRun run = RunOf("u" + std::to_string(i), 0.01 * i);
    run.tags.lot = i < 3 ? "L'1" : "L2";
    run.tags.station = i % 2 == 0 ? "S1" : "S2";
    Add(run);
  }
  const auto count = [this](const std::string& where) {
    const Result<LineReading> line = ReadUnits(*store_, where);
    return line ? std::to_string(line->data.units.size()) : line.error().message;
  };
  EXPECT_EQ(count(""), "6");
  EXPECT_EQ(count("lot = 'L''1' AND station = 'S2'"), "1");
  EXPECT_EQ(count("recorded >= '2026-11-24T00:02'"), "4");
  EXPECT_EQ(count("recorded < '2026-11-24T00:02'"), "2");
  EXPECT_EQ(count("lot = 'L2' AND serial <> 'u4' -- why"), "2");
  EXPECT_EQ(count("\"order\" IS NULL"), "6");
  EXPECT_THAT(count("lots = 1"), HasSubstr("is not valid"));
  const Json summary = Summary();
  ASSERT_EQ(summary["yield"]["by_tag"].count("lot"), 1u);
  EXPECT_EQ(summary["yield"]["by_tag"]["lot"][0]["value"], "L'1");
  EXPECT_EQ(summary["yield"]["by_tag"]["station"][1]["units"], 3);
  EXPECT_EQ(Summary({.where = "recorded >= '2027'"})["yield"]["units"], 0);
}

// Unit b is outside at S1 and good at S2: that is S1's failure, and S1's chart has what it
// measured.
TEST_F(LineOfUnits, ChargesAStationWithWhatItMeasuredFirst) {
  const auto add = [this](const std::string& serial, double bias, const std::string& station) {
    UnitRun run = RunOf(serial, bias);
    run.tags.station = station;
    Add(run);
  };
  for (int i = 0; i < 30; ++i) add("a" + std::to_string(i), 0.01 * (i % 7), "S1");
  add("b", 0.5, "S1");
  add("b", 0.1, "S2");
  add("b", 0.2, "S2");
  const Json summary = Summary();
  ASSERT_THAT(summary["yield"]["by_tag"]["station"], SizeIs(2));
  const Json& first_station = summary["yield"]["by_tag"]["station"][0];
  EXPECT_EQ(first_station["value"], "S1");
  EXPECT_EQ(first_station["units"], 31);
  EXPECT_EQ(first_station["good_at_first"], 30);
  EXPECT_EQ(first_station["good"], 31);
  EXPECT_EQ(first_station["runs"], 31);
  EXPECT_EQ(summary["yield"]["by_tag"]["station"][1]["units"], 0);
  EXPECT_EQ(summary["yield"]["by_tag"]["station"][1]["runs"], 2);
  // What is shipped: of b the last run.
  EXPECT_EQ(summary["yield"]["units"], 31);
  EXPECT_EQ(summary["limits"][0]["missed"], 0);
  Result<LineReading> line = ReadUnits(*store_);
  ASSERT_TRUE(line) << line.error().message;
  const line::LineData measured = line->TakeMeasured();
  ASSERT_THAT(measured.units, SizeIs(32));
  EXPECT_EQ(measured.units[30].values[0], 0.5);
  EXPECT_EQ(measured.units[31].values[0], 0.1);
  ASSERT_THAT(summary["charts"], SizeIs(2));
  EXPECT_EQ(summary["charts"][0]["units"], 31);
}

TEST_F(LineOfUnits, TakesTheTimeThatTheLastListStates) {
  UnitRun run = RunOf("a", 0.1);
  Add(RunOf("b", 0.2));
  Add(run);
  run.id = RunOf("", 0.0).id;
  run.recorded = "2026-11-24T09:00:00Z";
  Add(run);
  Result<LineReading> line = ReadUnits(*store_);
  ASSERT_TRUE(line) << line.error().message;
  const line::LineData measured = line->TakeMeasured();
  ASSERT_THAT(measured.units, SizeIs(2));
  EXPECT_EQ(measured.units[1].recorded, run.recorded);
}

TEST_F(LineOfUnits, NamesWhoDecidedAsAReason) {
  Add(RunOf("a", 0.1));
  ASSERT_TRUE(store_->Dispose({.id = NewRunId(),
                               .serial = "a",
                               .created = "",
                               .who = "R. Roe",
                               .why = "bent",
                               .verdict = Verdict::kFail}));
  const Json summary = Summary();
  EXPECT_EQ(summary["yield"]["good"], 0);
  ASSERT_THAT(summary["reasons"], SizeIs(1));
  EXPECT_EQ(summary["reasons"][0]["code"], "decided by R. Roe");
}

TEST_F(LineOfUnits, TakesNoTagThatIsNone) {
  Add(RunOf("a", 0.1));
  const Result<Json> summary = Summarise(*store_, {.study = "TRUE", .study_by = "operater"});
  ASSERT_FALSE(summary);
  EXPECT_THAT(summary.error().message, HasSubstr("--by=operater"));
}

// 300 units of a process of 0.06 σ in limits of -+ 0.3, measured with 0.03 σ: Pp 1.67 of the
// process, 1.49 as observed; 4 σ of either are 16 %.
TEST_F(LineOfUnits, HoldsTheProcessAgainstItsLimits) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> process(0.0, 0.06), error(0.0, kCalibrationSigma);
  for (int i = 0; i < 300; ++i)
    Add(RunOf("u" + std::to_string(i), process(random) + error(random)));
  const Json summary = Summary();
  ASSERT_THAT(summary["limits"], SizeIs(1));
  const Json& found = summary["limits"][0];
  EXPECT_EQ(found["units"], 300);
  EXPECT_NEAR(found["calibration_sigma"].get<double>(), kCalibrationSigma, 1e-12);
  EXPECT_NEAR(found["observed"]["overall"]["pp"]["value"].get<double>(),
              0.1 / std::hypot(0.06, 0.03),
              0.24);
  EXPECT_NEAR(found["process"]["overall"]["pp"]["value"].get<double>(), 0.1 / 0.06, 0.27);
  EXPECT_GT(found["process"]["overall"]["ppk"]["value"].get<double>(),
            found["observed"]["overall"]["ppk"]["value"].get<double>());
  ASSERT_THAT(summary["parameters"], SizeIs(2));
  EXPECT_FALSE(summary["parameters"][0]["observed"]["overall"].contains("ppk"));
  EXPECT_THAT(SummaryText(summary), HasSubstr("Distributions against limits"));
}

TEST_F(LineOfUnits, SaysWhenLimitsHaveChanged) {
  for (int i = 0; i < 5; ++i) {
    UnitRun run = RunOf("u" + std::to_string(i), 0.01 * i);
    if (i < 2) run.judgements[0].limit = Limit::Within(0.4);
    Add(run);
  }
  const Json summary = Summary();
  EXPECT_EQ(summary["limits"][0]["upper"], 0.3);
  EXPECT_EQ(summary["limits"][0]["other_limits"], 2);
  EXPECT_THAT(SummaryText(summary), HasSubstr("The limits of these quantities have changed"));
}

TEST_F(LineOfUnits, SaysHowStationsMeasureTheirGoldenUnits) {
  const auto check = [this](const std::string& station,
                            const std::string& recorded,
                            bool agrees,
                            const std::string& serial = "G1") {
    ASSERT_TRUE(store_->AddStationCheck({.id = NewRunId(),
                                         .station = station,
                                         .serial = serial,
                                         .created = "2026-11-24T09:00:00Z",
                                         .recorded = recorded,
                                         .agrees = agrees,
                                         .p = 0.4,
                                         .largest = 1.5,
                                         .parameter = "accelerometer.bias.x",
                                         .log = "g.csv"}));
  };
  check("S1", "2026-11-24T08:00:00Z", true);
  check("S2", "2026-11-22T08:00:00Z", true);
  check("S3", "2026-11-24T08:00:00Z", false);
  check("S4", "2026-11-24T07:00:00Z", false);  // Once it disagreed; the last check counts.
  check("S4", "2026-11-24T08:00:00Z", true);
  check("S5", "2026-11-25T08:00:00Z", true);  // Of a time to come.
  check("S6", "yesterday", true);
  check("S7", "2026-11-20T07:00:00Z", false);  // Neither time nor another unit takes an alarm back.
  check("S7", "2026-11-24T08:00:00Z", true, "G2");
  const Json summary = Summary();
  ASSERT_THAT(summary["golden"], SizeIs(8));
  EXPECT_EQ(summary["golden"][6]["serial"], "G1");
  EXPECT_EQ(summary["golden"][6]["state"], "disagrees");
  EXPECT_EQ(summary["golden"][7]["serial"], "G2");
  EXPECT_EQ(summary["golden"][7]["state"], "good");
  EXPECT_EQ(summary["golden"][0]["state"], "good");
  EXPECT_EQ(summary["golden"][1]["state"], "overdue");
  EXPECT_EQ(summary["golden"][2]["state"], "disagrees");
  EXPECT_EQ(summary["golden"][3]["state"], "good");
  EXPECT_EQ(summary["golden"][3]["disagreed"], 1);
  EXPECT_EQ(summary["golden"][3]["checks"][0]["agrees"], false);
  EXPECT_EQ(summary["golden"][4]["state"], "overdue");
  EXPECT_EQ(summary["golden"][5]["state"], "overdue");
  EXPECT_EQ(summary["golden"][0]["age_h"], 4.0);
  EXPECT_THAT(SummaryText(summary), HasSubstr("overdue"));
}

/// Parts, operators and repeats whose numbers are known: part i, operator j, repeat k.
class StudyOfUnits : public LineOfUnits {
 protected:
  void AddStudy(int parts, int operators, int repeats) {
    for (int i = 0; i < parts; ++i) {
      for (int j = 0; j < operators; ++j) {
        for (int k = 0; k < repeats; ++k) {
          UnitRun run = RunOf("part" + std::to_string(i), 0.05 * i + 0.001 * j + 0.004 * (k % 2));
          run.tags.operator_name = "op" + std::to_string(j);
          run.tags.note = "study";
          run.parameters[2].value += 1e-6 * runs_;  // No two measurements are alike in all.
          Add(run);
        }
      }
    }
  }
  const SummaryOptions options_{.study = "note = 'study'", .now = "2026-11-24T12:00:00Z"};
};

TEST_F(StudyOfUnits, IsMadeOfAllRunsThatAreSelected) {
  AddStudy(4, 2, 2);
  Add(RunOf("another", 0.2));
  const Json summary = Summary(options_);
  ASSERT_TRUE(summary.contains("study"));
  EXPECT_EQ(summary["study"]["runs"], 16);
  ASSERT_THAT(summary["study"]["quantities"], SizeIs(3));  // One with limits, two parameters.
  const Json& bias = summary["study"]["quantities"][0];
  EXPECT_EQ(bias["name"], "accelerometer.bias.x");
  EXPECT_EQ(bias["tolerance"], 0.6);
  ASSERT_TRUE(bias.contains("gauge"));
  const Json& gauge = bias["gauge"];
  EXPECT_EQ(gauge["parts"], 4);
  EXPECT_EQ(gauge["appraisers"], 2);
  // Repeats differ by 0.004 everywhere: 8 e-6 is their variance; with the interaction, which is
  // none, 11 instead of 8 degrees of freedom.
  EXPECT_NEAR(gauge["components"]["repeatability"]["variance"].get<double>(), 8e-6 * 8 / 11, 1e-15);
  EXPECT_THAT(SummaryText(summary),
              HasSubstr("Gauge study, crossed: 4 parts, 2 operators, 2 runs each"));
  EXPECT_THAT(SummaryText(summary), HasSubstr("operator p"));
  EXPECT_THAT(summary["study"]["quantities"], SizeIs(3));
}

TEST_F(StudyOfUnits, OfOneUnitIsOfType1) {
  AddStudy(1, 1, 10);
  SummaryOptions options = options_;
  options.references = {{"accelerometer.bias.x", 0.001}};
  const Json summary = Summary(options);
  const Json& quantities = summary["study"]["quantities"];
  ASSERT_TRUE(quantities[0].contains("type1"));
  const Json& study = quantities[0]["type1"];
  EXPECT_NEAR(study["bias"]["value"].get<double>(), 0.001, 1e-15);
  EXPECT_FALSE(std::isnan(study["cgk"].get<double>()));
  EXPECT_TRUE(
      std::isnan(quantities[1]["type1"]["cg"].get<double>()));  // A parameter has no limits.
  EXPECT_THAT(SummaryText(summary), HasSubstr("Type-1 study: 10 runs of one unit"));
  // The reference is of the limit, in m/s^2; the parameter of that name is in the log's unit.
  EXPECT_TRUE(std::isnan(quantities[1]["type1"]["reference"].get<double>()));
  EXPECT_THAT(SummaryText(summary), HasSubstr("m/s²"));
  options.references = {{"accelerometer.bias.w", 0.0}};
  const Result<Json> unknown = Summarise(*store_, options);
  ASSERT_FALSE(unknown);
  EXPECT_THAT(unknown.error().message, HasSubstr("accelerometer.bias.w"));
}

TEST_F(StudyOfUnits, SaysWhatItLacks) {
  Result<Json> none = Summarise(*store_, options_);
  ASSERT_FALSE(none);
  EXPECT_THAT(none.error().message, HasSubstr("the condition of the study selects no run"));
  AddStudy(1, 1, 1);
  none = Summarise(*store_, options_);
  ASSERT_FALSE(none);
  EXPECT_THAT(none.error().message, HasSubstr("one run of one part"));
  AddStudy(3, 2, 2);
  none = Summarise(*store_, options_);
  ASSERT_FALSE(none);
  EXPECT_THAT(none.error().message,
              HasSubstr("2 runs of part part1 by op0, but up to 3 in other cells"));
}

// The same files calibrated again would be a gauge without any error.
TEST_F(StudyOfUnits, IsOfRecordingsEachOfWhichIsThereOnce) {
  for (int i = 0; i < 4; ++i) {
    UnitRun run = RunOf("part" + std::to_string(i % 2), 0.05 * i);
    run.tags.note = "study";
    run.inputs = {{"log.csv", "same", 900}};
    run.readings = {{"accelerometer", i < 3 ? std::to_string(i) : "1"}};
    Add(run);
  }
  const Result<Json> summary = Summarise(*store_, options_);
  ASSERT_FALSE(summary);
  EXPECT_THAT(summary.error().message, HasSubstr("the same recording twice"));
  EXPECT_THAT(summary.error().message, HasSubstr("(part1.csv of part1)"));
}

}  // namespace line_summary_test
}  // namespace truetriad::fleet
