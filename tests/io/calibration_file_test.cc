// SPDX-License-Identifier: Apache-2.0
#include "truetriad/io/calibration_file.h"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace truetriad {
namespace calibration_file_test {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kSubnormal = std::numeric_limits<double>::denorm_min();

/// Every field filled, with numbers and texts that a careless writer would spoil.
Calibration Awkward() {
  Calibration calibration;
  calibration.serial = "007";
  calibration.model = "9-dof: \"demo\" # \\ \n\ttab";
  calibration.software_version = "0.10";
  calibration.created = "2026-01-31T12:00:00Z";
  calibration.inputs = {{"a b/Größe.csv", "12e456", 1234567890123}, {"-", "", 0}};
  calibration.outcome = Outcome::kConverged;
  calibration.within_limits = false;
  calibration.findings = {
      Finding(FindingCode::kMessage, "yes"),
      Finding(FindingCode::kClockOffset, "", "- {[&*!|>'%@`")
          .About(Triad::kMagnetometer, 2)
          .AtPose(7)
          .With("offset", 1.0 / 3.0, kSubnormal, "s")
          .With("p_value", std::numeric_limits<double>::quiet_NaN())
          .Shifting(2.0, Treatment::kWidened),
  };
  calibration.reference = {9.8174400000000001,
                           5e-4,
                           1.0 / 3.0,
                           -kSubnormal,
                           true,
                           true,
                           Eigen::Vector4d(0.5, -0.5, 0.1, 1.0 / 3.0),
                           -273.15};
  calibration.gauge = Gauge::kSymmetric;
  calibration.gauge_sensor = Triad::kMagnetometer;

  TriadCalibration full;
  full.input_unit = "counts";
  full.output_unit = "m/s^2";
  full.model.sensitivity << 1e5 / 3.0, -0.1, 1e-300, 0.2, -2e5 / 7.0, 0.3, -0.0, 1e-17, 0.1;
  full.model.bias = {32768.1, -1e-310, 1e300};
  full.bias_sigma = {kInfinity, 0.0, kSubnormal};
  full.sensitivity_sigma.setConstant(0.1);
  full.model.axis_terms[AxisTerm::kQuadratic] = {1e-5 / 3.0, 0.0, -kSubnormal};
  full.axis_term_sigma[AxisTerm::kQuadratic] = {1e-6, 0.0, kInfinity};
  full.model.axis_terms[AxisTerm::kAsymmetry].setConstant(1e-3 / 7.0);
  full.axis_term_sigma[AxisTerm::kAsymmetry] = Eigen::Vector3d::Constant(0.1);
  full.model.axis_terms[AxisTerm::kCubic] = {1e-9 / 3.0, -0.0, 1e300};
  full.axis_term_sigma[AxisTerm::kCubic] = {1e-12, kInfinity, kSubnormal};
  full.g_sensitivity = Eigen::Matrix3d::Constant(-1.0 / 7.0);
  full.thermal = ThermalTerms{
      25.0,
      {-40.0, 85.1},
      {{0.1, 0.2, 0.3}, {1e-7, -1e-8, 0.0}},
      {Eigen::Matrix3d::Identity() / 3.0},
      {{Eigen::Vector3d(1.0, 2.0, 1.0 / 3.0), std::nullopt, Eigen::Vector3d(0.7, 0.0, 0.0)}},
      Eigen::Vector3d(60.1, 0.0, 1.0 / 3.0),
      Eigen::Vector3d(0.0, 1e-3, 1e4),
      100.0 / 7.0,
      {{2, 31.0 + 1.0 / 3.0, -1e-17, 2e-5}, {0, -7.0, 0.0, 1.0 / 7.0}}};
  full.si_per_count = 0.0005985504150390625;
  full.noise = {{0.1, 0.2, 0.3}, NoiseSource::kDatasheet, 1e-3, kInfinity};
  calibration.sensors[Triad::kAccelerometer] = full;
  TriadCalibration plain;
  plain.input_unit = "uT";
  plain.output_unit = "uT";
  calibration.sensors[Triad::kMagnetometer] = plain;

  calibration.covariance.parameters = {"accelerometer.bias.x", "reference.dip_rad"};
  calibration.covariance.matrix = Eigen::Matrix2d{{1.0 / 3.0, -1e-20}, {-1e-20, 2.0 / 3.0}};

  Quality& quality = calibration.quality;
  quality.poses = 38;
  quality.residual_rms[Triad::kAccelerometer] = 0.0012345678901234567;
  quality.residual_rms[Triad::kMagnetometer] = kNan;
  quality.residual_rms_before[Triad::kAccelerometer] = 0.3;
  quality.reduced_chi2 = 1.0000000000000002;
  quality.reduced_chi2_before = 1e10 / 3.0;
  quality.dof = 92.0;
  quality.effective_dof = 17.3;
  quality.weak_directions = {{"bias z and scale z", "add poses \"z up\"", 0.07}};
  quality.rests.held_out.emplace();
  quality.rests.held_out->folds = 5;
  quality.rests.held_out->rms[Triad::kAccelerometer] = 0.1;
  quality.rests.held_out->turns = HeldOutTurns{{0.1 + 0.2, 1e-17, 0.003}, 0.003, 1.0 / 7.0, 0.01};
  quality.rests.model_choice = {
      {"gyroscope full, g-sensitivity", true, 12, 1e2 / 3.0, {}, 70.1, {}},
      {"gyroscope \"bias\"", false, 3, kInfinity, 0.1, -2.0 / 7.0, 1e-300}};
  quality.rests.model_steps = {
      {"gyroscope with \"asymmetry\"", false, 15, 0.1, {}, 1.0 / 3.0, 7e-9},
      {"gyroscope without asymmetry", false, 12, 0.3, 0.4, 0.5, {}}};
  quality.rests.rejected_poses = {{3, Triad::kMagnetometer, "off by 7 sigma: a magnet?"}};
  quality.coverage = {{Triad::kAccelerometer, {0.1, 0.2, 0.7}, 33.3}};
  quality.rests.pose_residuals = {
      {1, Triad::kAccelerometer, {0.1, -0.2, 0.3}, 1e-3, kNan, 0.9, 1.0, {0.6, 0.0, -0.8}}};
  quality.limits = {{"accelerometer.bias", "y", {-0.4, 0.5, 0.05}, 0.1, 0.01, 1e-9, true},
                    {"accelerometer.residual_rms",
                     "",
                     Limit{-std::numeric_limits<double>::infinity(), 0.5, std::nullopt},
                     0.1,
                     0.0,
                     0.0,
                     true}};
  quality.rests.temperature_settings = {{Triad::kMagnetometer,
                                         -17.0 / 3.0,
                                         12,
                                         {0.1, -0.2, 1.0 / 3.0},
                                         {1e-9, 2.0, 3.0},
                                         {-1e-17, 0.0, 0.7},
                                         0.3,
                                         1.0 / 7.0}};
  SweepAxis axis;
  axis.triad = Triad::kGyroscope;
  axis.axis = 2;
  axis.branch_gap = kNan;
  axis.held_out = 1.0 / 3.0;
  axis.rate_lag_s = 1e2 / 7.0;
  axis.chosen = "tau, T'^2";
  axis.left_out = {"T': \"only up\"; 3 %"};
  axis.steps = {{"tau", "+ tau", 0.9, 1.0 / 7.0, -1e3 / 3.0, 1e-17}};
  quality.sweep.axes = {axis};
  quality.sweep.windows = {{Triad::kGyroscope,
                            0.1,
                            -17.6,
                            1e-3,
                            {0.1, -0.2, 0.3},
                            {1.0 / 3.0, 0.0, -0.0},
                            {1e-9, 0, 1}}};
  calibration.config_yaml =
      "experiment: 1  # version\n\n# a comment\nsensors:\n  magnetometer: {}\n";
  return calibration;
}

Result<Calibration> Reread(const std::string& text) {
  return CalibrationFromYaml(text, "unit.yaml");
}

/// The text of Awkward() with the first `old_text` replaced.
std::string Edited(const std::string& old_text, const std::string& new_text) {
  std::string text = CalibrationToYaml(Awkward());
  const std::size_t at = text.find(old_text);
  EXPECT_NE(at, std::string::npos) << old_text;
  return text.replace(at, old_text.size(), new_text);
}

std::string ErrorOf(const std::string& text) {
  const Result<Calibration> result = Reread(text);
  return result ? "no error" : result.error().message;
}

std::string ReadAll(const std::filesystem::path& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

/// An empty folder of its own for each test.
class FileWriting : public ::testing::Test {
 protected:
  FileWriting() {
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  ~FileWriting() override { std::filesystem::remove_all(folder_); }

  std::size_t FileCount() const {
    return static_cast<std::size_t>(
        std::distance(std::filesystem::directory_iterator(folder_), {}));
  }

  const std::filesystem::path folder_ =
      std::filesystem::path(::testing::TempDir()) /
      ::testing::UnitTest::GetInstance()->current_test_info()->name();
};

TEST(CalibrationFile, LoadsBackToTheSameText) {
  const std::string text = CalibrationToYaml(Awkward());
  const Result<Calibration> reread = Reread(text);
  ASSERT_TRUE(reread) << reread.error().message;
  EXPECT_EQ(CalibrationToYaml(*reread), text);
}

TEST(CalibrationFile, LoadsBackToTheSameBits) {
  const Calibration original = Awkward();
  const Result<Calibration> reread = Reread(CalibrationToYaml(original));
  ASSERT_TRUE(reread) << reread.error().message;
  const TriadCalibration& a = *original.sensors[Triad::kAccelerometer];
  const TriadCalibration& b = *reread->sensors[Triad::kAccelerometer];
  EXPECT_EQ(a.model.sensitivity, b.model.sensitivity);
  EXPECT_EQ(a.model.bias, b.model.bias);
  EXPECT_EQ(a.bias_sigma, b.bias_sigma);
  EXPECT_EQ(a.model.axis_terms, b.model.axis_terms);
  EXPECT_EQ(a.axis_term_sigma, b.axis_term_sigma);
  EXPECT_EQ(a.thermal->bias, b.thermal->bias);
  EXPECT_EQ(a.thermal->sensitivity, b.thermal->sensitivity);
  EXPECT_EQ(a.thermal->rate[RateTerm::kCross], b.thermal->rate[RateTerm::kCross]);
  EXPECT_FALSE(b.thermal->rate[RateTerm::kQuadratic]);
  EXPECT_EQ(a.thermal->element_lag_s, b.thermal->element_lag_s);
  EXPECT_EQ(a.thermal->rate_lag_s, b.thermal->rate_lag_s);
  EXPECT_EQ(a.thermal->smoothing_s, b.thermal->smoothing_s);
  EXPECT_EQ(a.thermal->knots[0].degc, b.thermal->knots[0].degc);
  EXPECT_EQ(a.thermal->knots[0].slope, b.thermal->knots[0].slope);
  EXPECT_EQ(a.thermal->knots[1].axis, b.thermal->knots[1].axis);
  EXPECT_EQ(original.quality.sweep.axes[0].axis, reread->quality.sweep.axes[0].axis);
  EXPECT_EQ(original.quality.sweep.axes[0].left_out, reread->quality.sweep.axes[0].left_out);
  EXPECT_EQ(original.covariance.matrix, reread->covariance.matrix);
  EXPECT_EQ(original.model, reread->model);
  ASSERT_EQ(reread->findings.size(), 2U);
  const Finding& finding = reread->findings[1];
  EXPECT_EQ(finding.code, FindingCode::kClockOffset);
  EXPECT_EQ(finding.severity, Severity::kWarning);
  EXPECT_EQ(finding.sensor, Triad::kMagnetometer);
  EXPECT_EQ(finding.axis, 2);
  EXPECT_EQ(finding.pose, 7);
  EXPECT_EQ(finding.values[0].value, 1.0 / 3.0);
  EXPECT_EQ(finding.values[0].sigma, kSubnormal);
  EXPECT_EQ(finding.values[0].unit, "s");
  EXPECT_TRUE(std::isnan(finding.values[1].value));
  EXPECT_FALSE(finding.values[1].sigma);
  EXPECT_EQ(finding.treatment, Treatment::kWidened);
  EXPECT_EQ(finding.remedy, original.findings[1].remedy);
  EXPECT_EQ(original.inputs[0].file, reread->inputs[0].file);
  EXPECT_EQ(original.inputs[0].samples, reread->inputs[0].samples);
  EXPECT_EQ(original.config_yaml, reread->config_yaml);
  EXPECT_EQ(original.within_limits, reread->within_limits);
}

TEST(CalibrationFile, HoldsWhatFirmwareSaysOfSensors) {
  Calibration calibration = Awkward();
  calibration.tags.firmware = "px4";
  calibration.tags.magnetometer_turn_deg = Eigen::Vector3d(180.0, 0.0, 22.5);
  calibration.tags.magnetometer_mount_deg = Eigen::Vector3d(0.0, 0.0, 90.0);
  calibration.tags.device_ids[Triad::kGyroscope] = 1310988;
  calibration.tags.device_slots[Triad::kGyroscope] = 2;
  calibration.tags.thermal_slots[Triad::kGyroscope] = Tags::kNoSlot;
  const std::string text = CalibrationToYaml(calibration);
  EXPECT_THAT(text,
              HasSubstr(", firmware: \"px4\", ids: { gyroscope: 1310988 }, "
                        "slots: { gyroscope: 2 }, thermal_slots: { gyroscope: -1 }, "
                        "magnetometer_turn_deg: [180, 0, 22.5], "
                        "magnetometer_mount_deg: [0, 0, 90] }\n"));
  const Result<Calibration> reread = Reread(text);
  ASSERT_TRUE(reread) << reread.error().message;
  EXPECT_EQ(reread->tags, calibration.tags);
  calibration.tags.device_ids[Triad::kGyroscope] = 0;
  EXPECT_THAT(ErrorOf(CalibrationToYaml(calibration)),
              HasSubstr("device.ids.gyroscope: must be above zero"));
  calibration.tags = {};
  calibration.tags.device_slots[Triad::kGyroscope] = -2;
  EXPECT_THAT(ErrorOf(CalibrationToYaml(calibration)),
              HasSubstr("device.slots.gyroscope: must be 0 or more, or -1 if no slot is free"));
}

TEST(CalibrationFile, HoldsWhatWasDecidedAndIsHeadedByIt) {
  Calibration calibration = Awkward();
  calibration.outcome = Outcome::kConverged;
  calibration.findings.clear();
  calibration.within_limits = true;
  calibration.decisions = {
      {Verdict::kFail, "run 7", "FAIL, and that run counts", "2026-11-25T10:00:00Z", true},
      {Verdict::kFail, "R. Roe", "bent \"here\": 17", "2026-11-26T10:00:00Z"}};
  const std::string text = CalibrationToYaml(calibration);
  EXPECT_THAT(text, HasSubstr("\nverdict: FAIL\ndecisions:\n"));
  const Result<Calibration> read = CalibrationFromYaml(text, "c.yaml");
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(CalibrationToYaml(*read), text);
  EXPECT_EQ(read->LimitsVerdict(), Verdict::kPass);
  EXPECT_EQ(read->decisions[1].why, "bent \"here\": 17");
  EXPECT_TRUE(read->decisions[0].is_automatic);
}

TEST(CalibrationFile, LoadsBackAnEmptyCalibration) {
  const std::string text = CalibrationToYaml(Calibration());
  const Result<Calibration> reread = Reread(text);
  ASSERT_TRUE(reread) << reread.error().message;
  EXPECT_EQ(CalibrationToYaml(*reread), text);
  EXPECT_FALSE(reread->within_limits);
}

TEST(CalibrationFile, HoldsNoSensorsUnlessConverged) {
  Calibration calibration = Awkward();
  calibration.outcome = Outcome::kNotObservable;
  const std::string text = CalibrationToYaml(calibration);
  EXPECT_THAT(text, AllOf(Not(HasSubstr("\nsensors:")), Not(HasSubstr("\ncovariance:"))));
  EXPECT_THAT(text, HasSubstr("weak_directions"));
  const Result<Calibration> reread = Reread(text);
  ASSERT_TRUE(reread) << reread.error().message;
  EXPECT_FALSE(reread->IsUsable());
}

TEST(CalibrationFile, LeavesOutThousandsOfPoseResidualsAndSaysSo) {
  Calibration calibration = Awkward();
  calibration.quality.rests.pose_residuals.assign(2001, PoseResidual());
  const std::string text = CalibrationToYaml(calibration);
  EXPECT_THAT(text, HasSubstr("# Omitted: 2001 rows"));
  const Result<Calibration> reread = Reread(text);
  ASSERT_TRUE(reread) << reread.error().message;
  EXPECT_TRUE(reread->quality.rests.pose_residuals.empty());
}

TEST(CalibrationFile, KeepsTheConfigurationOfAFileThatWasIndentedOtherwise) {
  const Result<Calibration> reread =
      Reread(Edited("config:\n  experiment: 1  # version\n\n  # a comment\n  sensors:\n    mag",
                    "config:\n    experiment: 1\n\n    sensors:\n      mag"));
  ASSERT_TRUE(reread) << reread.error().message;
  EXPECT_EQ(reread->config_yaml, "experiment: 1\n\nsensors:\n  magnetometer: {}\n");
}

TEST(CalibrationFile, RefusesAnotherVersionOfTheFormat) {
  EXPECT_THAT(ErrorOf(Edited("calibration/1", "calibration/2")),
              AllOf(HasSubstr("unit.yaml:1: format"),
                    HasSubstr("truetriad/calibration/2"),
                    HasSubstr("reads truetriad/calibration/1")));
}

TEST(CalibrationFile, RefusesTemperatureTermsThatNoCalibrationWrites) {
  const auto error_with = [](auto change) {
    Calibration calibration = Awkward();
    for (const Triad triad : kTriads) {
      auto& sensor = calibration.sensors[triad];
      if (sensor && sensor->thermal) change(&*sensor->thermal);
    }
    return ErrorOf(CalibrationToYaml(calibration));
  };
  EXPECT_THAT(error_with([](ThermalTerms* terms) { terms->bias[0][1] = kNan; }),
              AllOf(HasSubstr("thermal"), HasSubstr("not finite")));
  EXPECT_THAT(error_with([](ThermalTerms* terms) {
                terms->range_degc = {60.0, -10.0};
              }),
              HasSubstr("[lowest, highest]"));
  EXPECT_THAT(error_with([](ThermalTerms* terms) { terms->reference_degc = -300.0; }),
              HasSubstr("-273.15"));
}

TEST(CalibrationFile, NamesAMissingKey) {
  EXPECT_THAT(ErrorOf(Edited("gauge: symmetric\n", "")), HasSubstr("gauge: is missing"));
  EXPECT_THAT(ErrorOf(Edited(", excess_sigma: 0", "")),
              HasSubstr("sensors.accelerometer.noise.excess_sigma: is missing"));
}

TEST(CalibrationFile, SaysNoDegreesOfFreedomOfAnExcessThatWasNotEstimated) {
  const std::string whole = Edited("gauge: symmetric", "gauge: symmetric");
  EXPECT_THAT(whole, Not(HasSubstr("excess_dof: .inf")));
  const auto read = Reread(whole);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_TRUE(std::isinf(read->sensors[Triad::kAccelerometer]->noise.excess_dof));
}

TEST(CalibrationFile, RejectsAnUnknownKeyWithItsLine) {
  EXPECT_THAT(ErrorOf(Edited("gauge: ", "gauge_: 3\ngauge: ")), HasSubstr("gauge_"));
  EXPECT_THAT(ErrorOf(Edited("format:", "frmat: 1\nformat:")), HasSubstr("unit.yaml:1: frmat"));
}

TEST(CalibrationFile, RejectsADuplicateKey) {
  EXPECT_THAT(ErrorOf(Edited("gauge: ", "gauge: accel-x\ngauge: ")), HasSubstr("gauge"));
}

TEST(CalibrationFile, RejectsAWrongShapeOrWord) {
  EXPECT_THAT(ErrorOf(Edited("bias: [32768", "bias: [1, 32768")),
              HasSubstr("sensors.accelerometer.bias: has 4 numbers; expected 3"));
  EXPECT_THAT(ErrorOf(Edited("source: datasheet", "source: rumour")), HasSubstr("`rumour`"));
  EXPECT_THAT(ErrorOf(Edited("poses: 38", "poses: many")), HasSubstr("quality.poses"));
}

TEST(CalibrationFile, RejectsACorrectionThatIsNotTheInverse) {
  EXPECT_THAT(ErrorOf(Edited("sensitivity: [[33333.333333333336", "sensitivity: [[33334")),
              HasSubstr("is not the inverse of `sensitivity`"));
}

TEST(CalibrationFile, RejectsANegativeStandardDeviation) {
  Calibration calibration = Awkward();
  calibration.sensors[Triad::kAccelerometer]->bias_sigma[1] = -0.1;
  EXPECT_THAT(
      ErrorOf(CalibrationToYaml(calibration)),
      HasSubstr("sensors.accelerometer.sigma.bias: contains a negative standard deviation"));
  calibration = Awkward();
  calibration.sensors[Triad::kAccelerometer]->noise.sigma[2] = -1.0;
  EXPECT_THAT(ErrorOf(CalibrationToYaml(calibration)),
              HasSubstr("sensors.accelerometer.noise.sigma: contains a negative"));
}

TEST(CalibrationFile, RejectsWhatIsNoCovariance) {
  const auto error = [](const Eigen::Matrix2d& matrix) {
    Calibration calibration = Awkward();
    calibration.covariance.matrix = matrix;
    return ErrorOf(CalibrationToYaml(calibration));
  };
  EXPECT_EQ(error(Eigen::Matrix2d{{1.0, -0.5}, {-0.5, 1.0}}), "no error");
  EXPECT_EQ(error(Eigen::Matrix2d::Zero()), "no error");
  EXPECT_THAT(error(Eigen::Matrix2d{{1.0, 2.0}, {2.0, 1.0}}), HasSubstr("is not a covariance"));
  EXPECT_THAT(error(Eigen::Matrix2d{{1.0, 0.5}, {0.4, 1.0}}), HasSubstr("is not a covariance"));
  EXPECT_THAT(error(Eigen::Matrix2d{{1.0, 1e308}, {1e308, 1.0}}), HasSubstr("is not a covariance"));
}

TEST(CalibrationFile, TakesItsTimeFromTheEnvironment) {
  setenv("SOURCE_DATE_EPOCH", "1769860800", 1);
  EXPECT_EQ(TimestampUtc(), "2026-01-31T12:00:00Z");
  unsetenv("SOURCE_DATE_EPOCH");
  EXPECT_EQ(TimestampUtc().size(), std::string("2026-01-31T12:00:00Z").size());
}

TEST_F(FileWriting, ReplacesTheWholeFileAndLeavesNothingBeside) {
  const std::string path = (folder_ / "result.yaml").string();
  ASSERT_TRUE(WriteFileAtomically(path, std::string(100000, 'a')));
  ASSERT_TRUE(WriteFileAtomically(path, "short"));
  EXPECT_EQ(ReadAll(path), "short");
  EXPECT_EQ(FileCount(), 1U);
}

TEST_F(FileWriting, SaysThatTheDirectoryIsMissing) {
  const Status status = WriteFileAtomically((folder_ / "no/such/file.yaml").string(), "text");
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().kind(), ErrorKind::kBadInput);
  EXPECT_THAT(status.error().message, HasSubstr("there is no folder"));
}

TEST_F(FileWriting, RefusesADirectoryAsTarget) {
  const Status status = WriteFileAtomically(folder_.string(), "text");
  ASSERT_FALSE(status);
  EXPECT_THAT(status.error().message, HasSubstr("is a folder"));
  EXPECT_EQ(FileCount(), 0U);
}

TEST_F(FileWriting, MakesTheDirectoriesOfAPath) {
  const std::string directory = (folder_ / "a/b/c").string();
  ASSERT_TRUE(EnsureWritableDirectory(directory));
  ASSERT_TRUE(EnsureWritableDirectory(directory));
  EXPECT_TRUE(std::filesystem::is_empty(directory));
}

TEST_F(FileWriting, RefusesADirectoryThatIsAFile) {
  const std::string path = (folder_ / "file").string();
  ASSERT_TRUE(WriteFileAtomically(path, "text"));
  EXPECT_FALSE(EnsureWritableDirectory(path));
  EXPECT_FALSE(EnsureWritableDirectory(path + "/below"));
}

}  // namespace calibration_file_test
}  // namespace truetriad
