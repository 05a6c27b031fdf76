// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <limits>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include "formats/sample_units.h"
#include "io/temporary_folder.h"
#include "truetriad/formats/export.h"

namespace truetriad {
namespace record_test {

using formats_test::RandomUnitCalibration;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

Calibration Unit() {
  Calibration unit = RandomUnitCalibration({}, 1);
  unit.inputs = {{"recording.csv", std::string(64, 'a'), 6000}};
  unit.within_limits = true;
  unit.quality.poses = 24;
  unit.quality.effective_dof = 10.0;
  unit.quality.limits = {{"accelerometer.bias", "y", Limit::Within(0.6), 0.3, 0.0005, 0.0, true}};
  unit.sensors[Triad::kAccelerometer]->bias_sigma = {0.001, 0.002, 0.003};
  unit.sensors[Triad::kAccelerometer]->model.bias = {0.5, -0.25, 0.125};
  unit.covariance.parameters = {"reference.field_ut"};
  unit.covariance.matrix = Eigen::MatrixXd::Constant(1, 1, 0.01);
  return unit;
}

std::string Record(const Calibration& unit, const std::string& name) {
  ExportOptions options;
  options.file_name = name;
  const Result<Export> result = ExportCalibration(unit, "record", options);
  EXPECT_TRUE(result) << result.error().message;
  return result->files[0].text;
}

/// The JSON that the page carries.
std::string Embedded(const std::string& page) {
  const std::size_t begin = page.find('\n', page.find("<script type=\"application/json\""));
  return page.substr(begin, page.find("</script>") - begin);
}

TEST(CalibrationRecord, StatesExpandedUncertaintiesConditionsAndReferences) {
  const YAML::Node record = YAML::Load(Record(Unit(), "unit.json"));
  EXPECT_EQ(record["device"]["serial"].as<std::string>(), "T1");
  const YAML::Node accel = record["sensors"]["accelerometer"];
  EXPECT_EQ(accel["bias_expanded_uncertainty"].as<std::vector<double>>(),
            (std::vector<double>{0.002, 0.004, 0.006}));
  EXPECT_EQ(accel["bias"].as<std::vector<double>>(), (std::vector<double>{0.5, -0.25, 0.125}));
  EXPECT_EQ(record["uncertainty"]["coverage_factor"].as<double>(), 2.0);
  // Student's t with 10 degrees of freedom: P(|t| < 2) = 0.92661.
  EXPECT_NEAR(record["uncertainty"]["coverage_probability"].as<double>(), 0.92661, 1e-5);
  EXPECT_EQ(record["references"]["field strength"]["value"].as<std::string>(), "48.00 ± 0.20 µT");
  EXPECT_THAT(record["references"]["gravity"]["source"].as<std::string>(),
              HasSubstr("assumed exact"));
  EXPECT_EQ(record["conditions"]["poses"].as<int>(), 24);
  EXPECT_EQ(record["inputs"][0]["sha256"].as<std::string>(), std::string(64, 'a'));
  EXPECT_TRUE(record["limits"][0]["pass"].as<bool>());
  EXPECT_EQ(record["verdict"].as<std::string>(), "PASS");
}

// A chain of attitudes has so many degrees of freedom that they are stated as infinite.
TEST(CalibrationRecord, IsJsonWhateverTheDegreesOfFreedom) {
  Calibration unit = Unit();
  unit.quality.effective_dof = std::numeric_limits<double>::infinity();
  const std::string record = Record(unit, "unit.json");
  EXPECT_THAT(record, AllOf(HasSubstr("\"effective_dof\": null"), Not(HasSubstr("inf,"))));
  EXPECT_NEAR(YAML::Load(record)["uncertainty"]["coverage_probability"].as<double>(), 0.9545, 1e-4);
}

TEST(CalibrationRecord, PageHoldsTheValuesForPeopleAndForPrograms) {
  const std::string page = Record(Unit(), "unit.html");
  EXPECT_THAT(page,
              AllOf(HasSubstr("0.5000 ±\u00a00.0020"),
                    HasSubstr("k = 2"),
                    HasSubstr("Approved by"),
                    HasSubstr("@page{size:A4"),
                    Not(HasSubstr("http:")),
                    Not(HasSubstr("https:"))));
  EXPECT_EQ(YAML::Load(Embedded(page))["sensors"]["accelerometer"]["bias"][0].as<double>(), 0.5);
}

TEST(CalibrationRecord, HasOneCoverageFactorAndWhatWasDecided) {
  Calibration unit = Unit();
  unit.decisions = {{Verdict::kFail, "R. Roe", "bent", "2026-11-25T10:00:00Z"}};
  const ExportOptions options{.file_name = "unit.html", .allows_outside_limits = true};
  const Result<Export> result = ExportCalibration(unit, "record", options);
  ASSERT_TRUE(result) << result.error().message;
  // σ of the limit's value is 0.0005.
  EXPECT_THAT(result->files[0].text,
              AllOf(HasSubstr("FAIL, T1: FAIL by R. Roe on 2026-11-25T10:00:00Z: bent"),
                    HasSubstr("By the limits alone it is PASS."),
                    Not(HasSubstr("its limit is met")),
                    HasSubstr("worst found ± U, k = 2"),
                    HasSubstr("0.3000 ±\u00a00.0010"),
                    HasSubstr("Decided: FAIL by R. Roe on 2026-11-25T10:00:00Z: bent.")));
}

TEST(CalibrationRecord, PageCannotBeBrokenByASerialNumber) {
  Calibration unit = Unit();
  unit.serial = "</script><b>\"&";
  const std::string page = Record(unit, "unit.html");
  EXPECT_THAT(page, Not(HasSubstr("<b>\"&")));
  EXPECT_EQ(YAML::Load(Embedded(page))["device"]["serial"].as<std::string>(), unit.serial);
}

TEST(CalibrationRecord, NamesTheLaboratoryAndWhatWasOverdue) {
  const std::string file =
      (std::filesystem::path(TRUETRIAD_SOURCE_DIR) / "configs/templates/laboratory.yaml").string();
  const Result<Laboratory> laboratory = ReadLaboratory(file);
  ASSERT_TRUE(laboratory) << laboratory.error().message;
  ASSERT_EQ(laboratory->equipment.size(), 2u);
  Calibration unit = Unit();
  unit.created = laboratory->equipment[0].due + "T23:59:59Z";
  ExportOptions options{.file_name = "unit.json", .laboratory = *laboratory};
  Result<Export> result = ExportCalibration(unit, "record", options);
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_TRUE(result->warnings.empty());  // the last day counts
  YAML::Node record = YAML::Load(result->files[0].text);
  EXPECT_EQ(record["laboratory"]["name"].as<std::string>(), laboratory->name);
  EXPECT_FALSE(record["equipment"][0]["overdue"].as<bool>());

  unit.created = "2027-03-02T00:00:00Z";
  result = ExportCalibration(unit, "record", options);
  ASSERT_TRUE(result) << result.error().message;
  ASSERT_EQ(result->warnings.size(), 1u);
  EXPECT_THAT(result->warnings[0], HasSubstr("due for calibration on 2027-03-01"));
  record = YAML::Load(result->files[0].text);
  EXPECT_TRUE(record["equipment"][0]["overdue"].as<bool>());
  EXPECT_FALSE(record["equipment"][1]["overdue"].as<bool>());

  options.file_name = "unit.html";
  result = ExportCalibration(unit, "record", options);
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_THAT(result->files[0].text, AllOf(HasSubstr("2027-03-01 (overdue)"), HasSubstr("C-07")));
}

TEST(CalibrationRecord, RefusesALaboratoryFileWithMistakesAndNamesThemAll) {
  const TemporaryFolder folder;
  const std::string file = folder.Write("laboratory.yaml",
                                        "laboratory: { adress: here }\n"
                                        "equipment:\n"
                                        "  - { name: Table, due: 2026-02-30 }\n");
  const Result<Laboratory> laboratory = ReadLaboratory(file);
  ASSERT_FALSE(laboratory);
  EXPECT_THAT(laboratory.error().message,
              AllOf(HasSubstr(file + ":1: "),
                    HasSubstr("adress"),
                    HasSubstr(file + ":3: "),
                    HasSubstr("`2026-02-30` is not a date")));
}

TEST(CalibrationRecord, SaysThatANominalFieldMakesGainsRelative) {
  Calibration unit = Unit();
  unit.reference.field_nominal = true;
  const YAML::Node record = YAML::Load(Record(unit, "unit.json"));
  EXPECT_THAT(record["references"]["field strength"]["source"].as<std::string>(),
              HasSubstr("relative"));
  EXPECT_THAT(record["traceability"].as<std::string>(),
              HasSubstr("magnetometer's gains are relative"));
}

}  // namespace record_test
}  // namespace truetriad
