// SPDX-License-Identifier: Apache-2.0
#include "truetriad/formats/export.h"

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "formats/restate.h"
#include "formats/sample_units.h"
#include "io/temporary_folder.h"

namespace truetriad {
namespace export_test {

using formats_test::RandomUnitCalibration;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

TEST(Export, RefusesACalibrationThatIsNotUsable) {
  Calibration unit = RandomUnitCalibration({}, 1);
  unit.outcome = Outcome::kNotObservable;
  for (const FormatInfo& format : Formats()) {
    const Result<Export> result = ExportCalibration(unit, format.name);
    ASSERT_FALSE(result) << format.name;
    EXPECT_EQ(result.error().kind(), ErrorKind::kBadInput);
    EXPECT_THAT(result.error().message, HasSubstr("not usable (not_observable)"));
  }
}

Calibration UnitOutside() {
  Calibration unit = RandomUnitCalibration({}, 1);
  unit.within_limits = false;
  unit.quality.limits = {{"accelerometer.bias", "y", Limit::Within(0.7), -0.889, 0.01, 1.0, false}};
  return unit;
}

TEST(Export, LetsNoUnitOutsideItsLimitsLeaveInSilence) {
  const Calibration unit = UnitOutside();
  for (const FormatInfo& format : Formats()) {
    if (format.arithmetic == Arithmetic::kIntegers) continue;  // They correct counts alone.
    ExportOptions options{.file_name = "unit.m"};
    const Result<Export> refused = ExportCalibration(unit, format.name, options);
    ASSERT_FALSE(refused) << format.name;
    EXPECT_EQ(refused.error().code, ErrorCode::kOutsideLimits);
    EXPECT_THAT(refused.error().message,
                AllOf(HasSubstr("accelerometer.bias.y -0.889 of ± 0.7 m/s²"),
                      HasSubstr("--outside-limits=allow")));
    options.allows_outside_limits = true;
    const Result<Export> allowed = ExportCalibration(unit, format.name, options);
    ASSERT_TRUE(allowed) << format.name << ": " << allowed.error().message;
    for (const ExportedFile& file : allowed->files) {
      const std::size_t mark = file.text.find("MUST NOT LEAVE: FAIL, accelerometer.bias.y");
      ASSERT_NE(mark, std::string::npos) << format.name << file.suffix;
      // Above all else that it says; imu_tk reads numbers alone, from the first line on.
      const std::size_t title = file.text.find("Calibration of");
      if (title != std::string::npos && format.name != "record") {
        EXPECT_LT(mark, title) << format.name;
      }
    }
  }
}

TEST(Export, OfAUnitThatMayNotLeaveIsKnownAgain) {
  const TemporaryFolder folder;
  const Result<Export> allowed =
      ExportCalibration(UnitOutside(), "px4", {.allows_outside_limits = true});
  ASSERT_TRUE(allowed);
  const std::string file = folder.Write("unit.params", allowed->files[0].text);
  const Result<Import> import = ImportCalibration("px4", {file});
  ASSERT_TRUE(import) << import.error().message;
  const Calibration& unit = import->calibration;
  EXPECT_EQ(unit.verdict(), Verdict::kFail);
  ASSERT_EQ(unit.decisions.size(), 1U);
  EXPECT_EQ(unit.decisions[0].who, file);
  EXPECT_THAT(unit.decisions[0].why,
              AllOf(StartsWith("FAIL, accelerometer.bias.y"), testing::EndsWith("m/s²")));
}

TEST(Export, FollowsWhatAPersonDecidedLast) {
  const Decision bad{Verdict::kFail, "R. Roe", "connector bent", "2026-11-25T10:00:00Z"};
  const Decision good{Verdict::kPass, "M. Moe", "concession 17", "2026-11-26T10:00:00Z"};
  Calibration unit = RandomUnitCalibration({}, 1);
  unit.decisions = {good, bad};
  const Result<Export> refused = ExportCalibration(unit, "px4");
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::kOutsideLimits);
  EXPECT_THAT(refused.error().message,
              HasSubstr("FAIL by R. Roe on 2026-11-25T10:00:00Z: connector bent"));
  Calibration outside = UnitOutside();
  outside.decisions = {bad, good};
  const Result<Export> conceded = ExportCalibration(outside, "px4");
  ASSERT_TRUE(conceded) << conceded.error().message;
  EXPECT_THAT(conceded->files[0].text,
              HasSubstr("PASS by M. Moe on 2026-11-26T10:00:00Z: concession 17; by the "
                        "limits alone it is FAIL"));
}

TEST(Export, OfOneSensorSaysThatAnotherOfTheDeviceMayNotLeave) {
  const Calibration good = RandomUnitCalibration({}, 1), bad = UnitOutside();
  const Result<ExportsBeside> exports = ExportBeside(
      {{&good, "a", 0}, {&bad, "a/instance-1", 1}}, {"px4"}, {.allows_outside_limits = true});
  ASSERT_TRUE(exports) << exports.error().message;
  EXPECT_THAT(exports->files.at("a/px4.params"), StartsWith("# THIS UNIT MUST NOT LEAVE: FAIL, "));
  const Result<ExportsBeside> refused =
      ExportBeside({{&good, "a", 0}, {&bad, "a/instance-1", 1}}, {"px4"}, {});
  ASSERT_TRUE(refused);
  EXPECT_TRUE(refused->files.empty());
}

TEST(Export, OfASensorWithoutAPlaceLeavesTheOthersTheirs) {
  const Calibration good = RandomUnitCalibration({}, 1);
  Calibration homeless = good;
  homeless.tags.firmware = "px4";
  homeless.tags.device_slots[Triad::kGyroscope] = Tags::kNoSlot;
  const Result<ExportsBeside> exports =
      ExportBeside({{&good, "a", 0}, {&homeless, "a/instance-1", 1}}, {"px4"}, {});
  ASSERT_TRUE(exports) << exports.error().message;
  EXPECT_FALSE(exports->is_whole);
  EXPECT_THAT(exports->files.at("a/px4.params"), Not(HasSubstr("CAL_ACC1_")));
  EXPECT_THAT(exports->warnings, Contains(HasSubstr("set the id of a removed sensor to 0")));
}

TEST(Export, IsWithdrawnWhateverItIsCalled) {
  const TemporaryFolder folder;
  std::filesystem::create_directories(folder.Path("instance-1"));
  std::size_t count = 0;
  for (const FormatInfo& format : Formats()) {
    for (const std::string file_name : {"unit.m", "unit.mat"}) {
      const Result<Export> result = ExportCalibration(
          RandomUnitCalibration({.counts = true}, 1), format.name, {.file_name = file_name});
      ASSERT_TRUE(result) << format.name;
      for (const ExportedFile& file : result->files) {
        const std::string in = count % 2 == 0 ? "" : "instance-1/";
        const std::string name = in + "B" + std::to_string(count++);
        folder.Write(name, file.text);
        EXPECT_TRUE(IsExport(folder.Path(name), RandomUnitCalibration({}, 1).serial).value());
        EXPECT_FALSE(IsExport(folder.Path(name), "another").value());
      }
    }
  }
  // Of others, whatever names they have.
  const std::vector<std::string> others = {"calibration.yaml", "imu.yaml", "px4.params"};
  for (const std::string& name : others) folder.Write(name, "of somebody else");
  const std::string kept = folder.Path("B0");
  const Result<std::vector<std::string>> withdrawn =
      WithdrawExports(folder.Path(""), {{kept, "written anew"}});
  ASSERT_TRUE(withdrawn);
  EXPECT_EQ(withdrawn->size(), count - 1);
  EXPECT_TRUE(std::filesystem::exists(kept));
  for (const std::string& name : others) {
    EXPECT_TRUE(std::filesystem::exists(folder.Path(name))) << name;
  }
  // What is withdrawn later does not take the place of what was before.
  std::filesystem::copy(kept, folder.Path("B2"));
  const Result<std::vector<std::string>> again = WithdrawExports(folder.Path(""), {{kept, ""}});
  ASSERT_TRUE(again);
  EXPECT_THAT(*again, testing::ElementsAre(folder.Path("B2.withdrawn-2")));
}

TEST(Export, NamesTheFormatsWhenThereIsNoSuchOne) {
  const Result<Export> result = ExportCalibration(RandomUnitCalibration({}, 1), "px5");
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().kind(), ErrorKind::kUsage);
  EXPECT_THAT(result.error().message,
              AllOf(HasSubstr("did you mean `px4`?"), HasSubstr("c-header")));
}

TEST(Export, HasNoSecondLineEndFromASerialNumber) {
  Calibration unit = RandomUnitCalibration({.counts = true}, 1);
  unit.serial = "a\u2028b: [\u2029c\u0085d\u202Ee\xFF";
  for (const FormatInfo& format : Formats()) {
    const Result<Export> result = ExportCalibration(unit, format.name, {.file_name = "unit.m"});
    ASSERT_TRUE(result) << format.name << ": " << result.error().message;
    for (const ExportedFile& file : result->files) {
      // In JSON they are characters as others.
      if (format.name == "json" || format.name == "record") continue;
      for (const char* wrong : {"\u2028", "\u2029", "\u0085", "\u202E", "\xFF"}) {
        EXPECT_EQ(file.text.find(wrong), std::string::npos) << format.name;
      }
    }
  }
}

TEST(Export, SaysInEveryFileWhatItIs) {
  setenv("SOURCE_DATE_EPOCH", "1769860800", 1);
  for (const FormatInfo& format : Formats()) {
    const Result<Export> result =
        ExportCalibration(RandomUnitCalibration({.counts = true}, 1),
                          format.name,
                          {.software_version = "0.9.8", .file_name = "unit.m"});
    ASSERT_TRUE(result) << format.name << ": " << result.error().message;
    for (const ExportedFile& file : result->files) {
      EXPECT_THAT(file.text,
                  AllOf(HasSubstr("Calibration of T1 (random)"),
                        HasSubstr("truetriad 0.9.8 at 2026-01-31T12:00:00Z"),
                        HasSubstr("Gauge accel-"),
                        HasSubstr("accelerometer: readings in "),
                        HasSubstr("accelerometer: error of at most")))
          << format.name;
    }
  }
  unsetenv("SOURCE_DATE_EPOCH");
}

TEST(Export, IsTheSameForTheSameInput) {
  setenv("SOURCE_DATE_EPOCH", "1769860800", 1);
  const Calibration unit = RandomUnitCalibration({.bias_order = 2, .counts = true}, 2);
  for (const FormatInfo& format : Formats()) {
    const Result<Export> once = ExportCalibration(unit, format.name);
    const Result<Export> again = ExportCalibration(unit, format.name);
    ASSERT_TRUE(once && again) << format.name;
    for (std::size_t i = 0; i < once->files.size(); ++i) {
      EXPECT_EQ(once->files[i].text, again->files[i].text) << format.name;
    }
  }
  unsetenv("SOURCE_DATE_EPOCH");
}

TEST(Export, SaysThatItDropsTheHigherTerms) {
  const Calibration unit = RandomUnitCalibration({.axis_terms = true, .counts = true}, 3);
  for (const FormatInfo& format : Formats()) {
    const Result<Export> result = ExportCalibration(unit, format.name, {.file_name = "unit.m"});
    ASSERT_TRUE(result) << format.name << ": " << result.error().message;
    const ExportLoss& loss = *result->loss[Triad::kAccelerometer];
    if (format.name == "json" || format.name == "record") {
      EXPECT_TRUE(result->notes.empty()) << result->notes[0];
      EXPECT_LT(loss.share(), 1e-12);
      continue;
    }
    for (const AxisTermInfo& info : kAxisTerms) {
      if (!result->loss[info.triad]) continue;
      EXPECT_THAT(
          result->notes,
          Contains(std::string(TriadName(info.triad)) + ": dropped: " + std::string(info.words)))
          << format.name;
    }
    // Some 1e-3 of the signal.
    EXPECT_GT(loss.share(), 1e-4) << format.name;
  }
}

// At a rate r that has lasted, the reading is off by r (d1 - lag b1) from what a format without
// rates takes it for; five rates from end to end are looked at.
TEST(Export, SaysWhatDroppedTermsInTheRateOfTemperatureCost) {
  Calibration unit = RandomUnitCalibration({.bias_order = 1}, 4);
  TriadCalibration& sensor = *unit.sensors[Triad::kAccelerometer];
  ThermalTerms& thermal = *sensor.thermal;
  thermal.sensitivity.clear();
  thermal.rate[RateTerm::kLinear] = Eigen::Vector3d(0.2, -0.1, 0.3);
  thermal.element_lag_s = Eigen::Vector3d(60.0, 30.0, 0.0);
  const Result<Export> unknown = ExportCalibration(unit, "c-header");
  ASSERT_TRUE(unknown) << unknown.error().message;
  EXPECT_FALSE(unknown->loss[Triad::kAccelerometer]->at_rates);
  EXPECT_THAT(unknown->notes, Contains(HasSubstr("not included in the stated error")));
  thermal.rate_range_degcps = Eigen::Vector2d(-0.05, 0.1);
  const Result<Export> result = ExportCalibration(unit, "c-header");
  ASSERT_TRUE(result) << result.error().message;
  const ExportLoss& loss = *result->loss[Triad::kAccelerometer];
  ASSERT_TRUE(loss.at_rates);
  const double of_one =
      (sensor.model.Correction() *
       (*thermal.rate[RateTerm::kLinear] - thermal.element_lag_s->cwiseProduct(thermal.bias[0])))
          .norm();
  double squares = 0.0;
  for (const double rate : {-0.05, -0.0125, 0.025, 0.0625, 0.1}) squares += rate * rate;
  // Without rates the header is off by single precision alone.
  EXPECT_NEAR(loss.at_rates->largest, 0.1 * of_one, 1.01 * loss.largest);
  EXPECT_NEAR(loss.at_rates->rms, std::sqrt(squares / 5.0) * of_one, 1.01 * loss.largest);
  EXPECT_LT(loss.largest, 1e-3 * of_one);
  EXPECT_THAT(result->notes, Contains(HasSubstr("dropped: bias from the temperature rate")));
  EXPECT_THAT(result->notes, testing::Not(Contains(HasSubstr("not included in the stated error"))));
  const Result<Export> whole = ExportCalibration(unit, "json");
  ASSERT_TRUE(whole) << whole.error().message;
  EXPECT_FALSE(whole->loss[Triad::kAccelerometer]->at_rates);
}

TEST(ChebyshevFit, GivesBackAPolynomialOfItsDegree) {
  const auto cubic = [](double x) { return 3.0 - 0.5 * x + 0.02 * x * x - 1e-4 * x * x * x; };
  const std::vector<double> fit = ChebyshevFit(cubic, -45.0, 60.0, 3);
  ASSERT_EQ(fit.size(), 4U);
  // Values of some ten, exact to 1e-15 of them; a power of x divides by 50.
  EXPECT_NEAR(fit[0], 3.0, 1e-13);
  EXPECT_NEAR(fit[1], -0.5, 1e-14);
  EXPECT_NEAR(fit[2], 0.02, 1e-15);
  EXPECT_NEAR(fit[3], -1e-4, 1e-17);
}

}  // namespace export_test
}  // namespace truetriad
