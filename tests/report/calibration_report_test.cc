// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "report/charts.h"
#include "report/sample_calibration.h"
#include "truetriad/calibrate/evaluate.h"
#include "truetriad/report/report.h"

namespace truetriad {
namespace calibration_report_test {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

/// `parts` appear in `text` in this order.
void ExpectInOrder(const std::string& text, const std::vector<std::string>& parts) {
  std::size_t at = 0;
  for (const std::string& part : parts) {
    const std::size_t found = text.find(part, at);
    ASSERT_NE(found, std::string::npos) << part << " is missing or too early in\n" << text;
    at = found;
  }
}

std::size_t Count(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (auto at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
  return count;
}

const std::vector<std::string> kReadingOrder = {"PASS, ",
                                                "Limits",
                                                "Parameters and predicted uncertainty",
                                                "Weak directions",
                                                "Choice of the model",
                                                "Held-out error",
                                                "A small residual alone proves nothing",
                                                "Pose coverage"};

// The marks of a chart of limits: where each value stands.
TEST(LimitDrawing, ShowsEveryValueWhateverSideIsOpen) {
  const auto chart = [](double lower, double upper, double worst, double sigma, double k) {
    LimitCheck check{"gyroscope.bias", "x", {lower, upper, std::nullopt, false}, worst, sigma};
    check.guard_band_k = k;
    return LimitDrawing({check}).svg;
  };
  constexpr double kOpen = std::numeric_limits<double>::infinity();
  // Failed ones with one side, with zero, and with none of width: track, mark and whisker.
  for (const std::string& svg : {chart(-kOpen, -0.1, 0.306, 0.01, 0.0),
                                 chart(-kOpen, 0.0, 0.02, 0.01, 0.0),
                                 chart(0.0, 0.0, 0.01, 0.001, 0.0),
                                 chart(0.001, kOpen, -0.006, 0.001, 0.0)}) {
    EXPECT_THAT(svg, AllOf(HasSubstr("class=\"track\""), HasSubstr("class=\"fail\"")));
    EXPECT_THAT(svg, AllOf(HasSubstr("class=\"whisker\""), HasSubstr("class=\"limit\"")));
  }
  // Twelve times as far inside as the limit is from zero, so near the middle of what is drawn.
  EXPECT_THAT(chart(-0.001, kOpen, 0.011, 2e-5, 0.0), HasSubstr("x=\"254.0\""));
  // As wide as what is allowed at most.
  const std::string guarded = chart(-0.0001, 0.0001, 0.0131, 0.0021, 2.0);
  EXPECT_THAT(guarded, HasSubstr("class=\"guard\" x=\"64.0\" y=\"35.0\" width=\"240.0\""));
  EXPECT_THAT(guarded, HasSubstr("»"));
}

TEST(CalibrationText, StartsWithTheVerdictAndKeepsTheOrder) {
  const std::string text = CalibrationText(SampleCalibration());
  EXPECT_THAT(text, StartsWith("PASS, "));
  ExpectInOrder(text, kReadingOrder);
}

TEST(CalibrationHtml, KeepsTheSameOrder) {
  ExpectInOrder(CalibrationHtml(SampleCalibration()), kReadingOrder);
}

// What firmware computes, from C and b of the file.
TEST(CalibrationText, HasTheCorrectionAsItIsUsed) {
  const Calibration calibration = SampleCalibration();
  const TriadCalibration& sensor = *calibration.sensors[Triad::kAccelerometer];
  const std::string text = CalibrationText(calibration);
  const std::size_t at = text.find("Correction: corrected = C (raw − b)");
  ASSERT_NE(at, std::string::npos);
  std::istringstream lines(text.substr(at));
  std::string line;
  std::getline(lines, line), std::getline(lines, line);
  EXPECT_THAT(line, StartsWith("  accelerometer"));
  for (int row = 0; row < 3; ++row) {
    std::string name;
    lines >> name;
    EXPECT_EQ(name, std::string(1, "xyz"[row]));
    for (int column = 0; column < 3; ++column) {
      double entry = 0.0;
      lines >> entry;
      EXPECT_NEAR(entry, sensor.model.Correction()(row, column), 1e-7 * std::abs(entry) + 1e-12);
    }
    std::getline(lines, line);
  }
}

TEST(CalibrationHtml, IsNotGreenWithoutLimits) {
  Calibration calibration = SampleCalibration();
  EXPECT_THAT(CalibrationHtml(calibration), HasSubstr("class=\"verdict good\""));
  calibration.within_limits.reset();
  EXPECT_THAT(CalibrationHtml(calibration), HasSubstr("class=\"verdict neutral\""));
}

// The serial number stands below each printed page, in a style.
TEST(CalibrationHtml, TakesNoSerialNumberForAStyle) {
  Calibration calibration = SampleCalibration();
  calibration.serial = "A\"}</style><b>\\";
  const std::string html = CalibrationHtml(calibration);
  EXPECT_EQ(Count(html, "</style>"), 1u);
  EXPECT_THAT(html,
              HasSubstr("content:\"Calibration of A\\000022\\00007d\\00003c\\00002fstyle\\00003e"
                        "\\00003cb\\00003e\\00005c\""));
  EXPECT_THAT(html, HasSubstr("default-src 'none'"));
}

TEST(CalibrationText, FitsATerminalOfAHundredColumns) {
  std::istringstream lines(CalibrationText(SampleCalibration()));
  for (std::string line; std::getline(lines, line);) {
    const auto width = std::count_if(line.begin(), line.end(), [](char c) {
      return (static_cast<unsigned char>(c) & 0xC0) != 0x80;
    });
    EXPECT_LE(width, 100) << line;
  }
}

TEST(CalibrationText, ShowsParametersWithSigma) {
  const std::string text = CalibrationText(SampleCalibration());
  EXPECT_THAT(text, HasSubstr("0.05123 ± 0.00045"));  // bias x
  EXPECT_THAT(text, HasSubstr("2310 ± 41"));          // scale error x, ppm
  EXPECT_THAT(text, HasSubstr("65.002 ± 0.040"));     // dip, 1.1345 rad ± 0.0007 rad
}

TEST(CalibrationText, TakesMisalignmentSigmaFromTheFullCovariance) {
  Calibration c = SampleCalibration();
  TriadCalibration& accel = *c.sensors[Triad::kAccelerometer];
  accel.model.sensitivity << 1, 0, 0, 0.1, 1, 0, 0, 0, 1;
  accel.sensitivity_sigma.setZero();
  accel.sensitivity_sigma(1, 0) = accel.sensitivity_sigma(1, 1) = 0.01;
  // S_yx and S_yy fully correlated: σ of S_yx / S_yy is 0.01 - 0.1 * 0.01 = 9 mrad.
  c.covariance.parameters = {"accelerometer.sensitivity.yx", "accelerometer.sensitivity.yy"};
  c.covariance.matrix = Eigen::Matrix2d::Constant(1e-4);
  EXPECT_THAT(CalibrationText(c), HasSubstr("100.0 ± 9.0"));
}

TEST(CalibrationText, SaysThatAHeldMisalignmentIsInNoError) {
  constexpr char kWords[] = "Misalignment of the accelerometer was not estimated";
  Calibration calibration = SampleCalibration();
  Eigen::Matrix3d& sigma = calibration.sensors[Triad::kAccelerometer]->sensitivity_sigma;
  sigma.setConstant(1e-3);
  EXPECT_THAT(CalibrationText(calibration), Not(HasSubstr(kWords)));
  sigma = Eigen::Vector3d::Constant(1e-3).asDiagonal();
  EXPECT_THAT(CalibrationText(calibration), HasSubstr(kWords));
}

TEST(CalibrationText, StatesTheNinetyFivePercentFactorOnce) {
  // Student's t, 27.4 degrees of freedom: 2.0505.
  const std::string text = CalibrationText(SampleCalibration());
  EXPECT_EQ(Count(text, "multiply by 2.05"), 1U);
  EXPECT_THAT(text, Not(HasSubstr("CAUTION")));
}

TEST(CalibrationReport, ShowsTheExcessOfTurns) {
  Calibration c = SampleCalibration();
  c.sensors[Triad::kGyroscope] = c.sensors[Triad::kAccelerometer];
  c.sensors[Triad::kGyroscope]->noise.turn_excess_sigma_rad = 0.0036;  // 0.206 deg
  EXPECT_THAT(CalibrationText(c), HasSubstr("plus turn noise of 0.21°"));
  EXPECT_THAT(CalibrationHtml(c), HasSubstr("plus turn noise of 0.21°"));
}

TEST(CalibrationText, ShowsTheMatrixWhenAxesArePermuted) {
  Calibration c = SampleCalibration();
  c.sensors[Triad::kMagnetometer]->model.sensitivity << 0, 10, 0, 0, 0, 10, 10, 0, 0;
  EXPECT_THAT(CalibrationText(c), HasSubstr("sensitivity x"));
}

TEST(CalibrationText, ShowsTemperatureTermsWithTheirUnitsAndRange) {
  Calibration c = SampleCalibration();
  ThermalTerms thermal;
  thermal.range_degc = {-10.0, 60.0};
  thermal.bias = {{0.0021, 0.0022, 0.0023}};
  thermal.rate[RateTerm::kLinear] = Eigen::Vector3d(0.11, 0.12, 0.13);
  c.sensors[Triad::kAccelerometer]->thermal = thermal;
  const std::string text = CalibrationText(c);
  EXPECT_THAT(text, HasSubstr("m/s² / °C¹"));
  EXPECT_THAT(text, HasSubstr("m/s² s/°C"));
  EXPECT_THAT(text, HasSubstr("above 25 °C; calibrated from -10 to 60 °C"));
}

TEST(CalibrationReport, ShowsTheBiasAtEachTemperature) {
  Calibration calibration = SampleCalibration();
  ThermalTerms& thermal = calibration.sensors[Triad::kAccelerometer]->thermal.emplace();
  thermal.range_degc = {-20.0, 65.0};
  thermal.bias = {{1e-3, 0.0, 0.0}};
  EXPECT_THAT(CalibrationHtml(calibration), Not(HasSubstr("Over temperature")));
  for (const double degc : {-20.0, 25.0, 65.0}) {
    calibration.quality.rests.temperature_settings.push_back({Triad::kAccelerometer,
                                                              degc,
                                                              12,
                                                              {0.1, 0.2, 0.3},
                                                              {1e-3, 1e-3, 1e-3},
                                                              {2.5e-3, 0.0, 0.0},
                                                              0.31,
                                                              1e-3});
  }
  const std::string text = CalibrationText(calibration);
  EXPECT_THAT(text, HasSubstr("Over temperature"));
  EXPECT_THAT(text, HasSubstr("-20.0 °C"));
  EXPECT_THAT(text, HasSubstr("0.0025 ± 0.0010"));
  EXPECT_THAT(CalibrationHtml(calibration), HasSubstr("Accelerometer y: bias over temperature"));
}

TEST(CalibrationText, SaysWhenALimitIsExceeded) {
  Calibration c = SampleCalibration();
  c.within_limits = false;
  c.quality.limits.front().pass = false;
  const std::string text = CalibrationText(c);
  EXPECT_THAT(text, StartsWith("FAIL, "));
  EXPECT_THAT(text, HasSubstr("FAIL"));
}

TEST(CalibrationReport, ShowsNoParametersWhenNotUsable) {
  const Calibration c = UnusableCalibration();
  for (const std::string& report : {CalibrationText(c), CalibrationHtml(c)}) {
    ExpectInOrder(report, {"NO RESULT, ", "8 poses lie within 4 deg", "add poses with z"});
    EXPECT_THAT(report, Not(HasSubstr("Parameters and predicted")));
    EXPECT_THAT(report, Not(HasSubstr("0.05123")));
    EXPECT_THAT(report, Not(HasSubstr("0.0345")));  // A limit's worst value is a parameter.
    EXPECT_THAT(report, Not(HasSubstr("Correlation")));
  }
}

TEST(CalibrationText, CountsManyRejectedPosesInsteadOfListingThem) {
  Calibration c = SampleCalibration();
  c.quality.rests.rejected_poses.assign(300, {9, Triad::kAccelerometer, "moved during the rest"});
  const std::string text = CalibrationText(c);
  EXPECT_THAT(text, HasSubstr("Rejected poses (300)"));
  EXPECT_THAT(text, HasSubstr("and 240 more"));
  EXPECT_EQ(Count(text, "moved during the rest"), 60U);
}

TEST(CalibrationReport, SaysThatNothingWasCalibratedWhenEmpty) {
  EXPECT_THAT(CalibrationText({}), StartsWith("NO RESULT: no calibration was run"));
  EXPECT_THAT(CalibrationHtml({}), HasSubstr("NO RESULT: no calibration was run"));
}

TEST(CalibrationHtml, EscapesHostileStrings) {
  const std::string hostile = "</pre><script>alert(\"x\")</script>&'";
  Calibration c = SampleCalibration();
  c.serial = c.model = c.config_yaml = c.created = hostile;
  c.findings = {{FindingCode::kOddGain, hostile, hostile}};
  c.inputs.front().file = hostile;
  c.quality.weak_directions.front().description = hostile;
  c.quality.rests.rejected_poses.front().reason = hostile;
  c.quality.limits.front().name = hostile;
  c.covariance.parameters.front() = hostile;
  c.sensors[Triad::kAccelerometer]->input_unit = hostile;
  const std::string html = CalibrationHtml(c);
  EXPECT_THAT(html, Not(HasSubstr("<script>alert")));
  EXPECT_THAT(html, Not(HasSubstr("\"x\"")));
  EXPECT_THAT(html, HasSubstr("&lt;script&gt;alert(&quot;x&quot;)"));
}

TEST(CalibrationHtml, NeedsNothingFromOutside) {
  const std::string html = CalibrationHtml(SampleCalibration());
  for (const char* outside : {"http:", "https:", "src=", "href=", "url(", "@import"}) {
    EXPECT_THAT(html, Not(HasSubstr(outside)));
  }
}

TEST(CalibrationHtml, HasItsScriptWhereItsLooksAre) {
  const std::string alone = CalibrationHtml(SampleCalibration());
  EXPECT_THAT(alone, HasSubstr("script-src 'sha256-"));
  EXPECT_THAT(alone, HasSubstr("<script>" + ReportScript() + "</script>"));
  const std::string shared = CalibrationHtml(SampleCalibration(), {.assets = "../../assets"});
  EXPECT_THAT(shared, HasSubstr("script-src 'self'"));
  EXPECT_THAT(shared, HasSubstr("<script src=\"../../assets/report.js\"></script>"));
  EXPECT_THAT(shared, Not(HasSubstr(ReportScript())));
}

TEST(CalibrationHtml, HasScenesThatTurnWhereSomethingDrawsThem) {
  const EmbeddedScript plots{"drawSpheres()", "sha256-ofIt"};
  const std::string turning = CalibrationHtml(SampleCalibration(), {.plots = plots});
  EXPECT_THAT(turning, HasSubstr(" 'sha256-ofIt'"));
  EXPECT_THAT(turning, HasSubstr("<script>drawSpheres()</script>"));
  EXPECT_EQ(Count(turning, "<script type=\"application/json\">{\"sensor\":"), 2U);
  EXPECT_THAT(CalibrationHtml(SampleCalibration()), Not(HasSubstr("application/json")));
  // Nothing is to be turned of what was refused.
  EXPECT_THAT(CalibrationHtml({}, {.plots = plots}), Not(HasSubstr("drawSpheres()")));
}

TEST(CalibrationHtml, NeverThinsTheWorstPoseOutOfAScene) {
  constexpr int kWorst = 13579;
  Calibration c = SampleCalibration(20000);
  c.quality.rests.pose_residuals[kWorst - 1].residual = {0.0, 0.5, 0.0};
  const std::string html = CalibrationHtml(c, {.plots = {"drawSpheres()", "sha256-ofIt"}});
  EXPECT_THAT(html, HasSubstr("\n[" + std::to_string(kWorst) + ",0,"));
  EXPECT_LT(html.size(), 500000U);
}

TEST(CalibrationHtml, OffersCAndBForProgramsToRead) {
  const std::string html = CalibrationHtml(SampleCalibration());
  EXPECT_THAT(html, HasSubstr("data-copy=\"accelerometer: corrected = C (raw - b), C in "));
  EXPECT_THAT(html, HasSubstr("\nC = [["));
}

TEST(CalibrationHtml, HasTheSameBytesTwice) {
  EXPECT_EQ(CalibrationHtml(SampleCalibration()), CalibrationHtml(SampleCalibration()));
}

TEST(CalibrationHtml, LeavesOutWhatWasNotMeasured) {
  Calibration c = SampleCalibration();
  c.sensors[Triad::kMagnetometer].reset();
  std::erase_if(c.quality.rests.pose_residuals,
                [](const auto& pose) { return pose.triad == Triad::kMagnetometer; });
  c.quality.rests.held_out.reset();
  c.quality.coverage.clear();
  for (PoseResidual& pose : c.quality.rests.pose_residuals) {
    pose.norm_error = std::numeric_limits<double>::quiet_NaN();
    pose.direction.setConstant(std::numeric_limits<double>::quiet_NaN());
  }
  const std::string html = CalibrationHtml(c);
  EXPECT_THAT(html, Not(HasSubstr("<h3>Magnetometer")));
  EXPECT_THAT(html, Not(HasSubstr("nan")));
  EXPECT_THAT(html, HasSubstr("no poses were held out"));
}

TEST(CalibrationHtml, ThinsLongPoseLists) {
  const std::string small = CalibrationHtml(SampleCalibration(400));
  const std::string large = CalibrationHtml(SampleCalibration(20000));
  EXPECT_THAT(large, HasSubstr("it would have 40000 rows"));
  // Two sensors, each with at most 600 points before, after and on the discs, and one legend.
  EXPECT_LE(Count(large, "<circle"), 2U * (3U * 600U + 10U));
  EXPECT_LT(large.size(), 2 * small.size());
  // The rejected pose is never thinned away: two strokes in the chart.
  EXPECT_GE(Count(large, "class=\"rejected\""), 2U);
}

TEST(EvaluationText, JudgesErrorsByThePrediction) {
  EvaluationSummary evaluation;
  evaluation.poses = 12;
  evaluation.norm_rms[Triad::kAccelerometer] = 0.0021;
  evaluation.predicted_rms[Triad::kAccelerometer] = 0.0020;
  evaluation.error_ratio[Triad::kAccelerometer] = 1.05;
  evaluation.angle_std_deg = 0.12;
  EXPECT_THAT(ReportOf(evaluation, SampleCalibration()).text, StartsWith("AS PREDICTED"));
  evaluation.error_ratio[Triad::kAccelerometer] = 6.05;
  EXPECT_THAT(ReportOf(evaluation, SampleCalibration()).text,
              StartsWith("WORSE THAN PREDICTED: up to 6.05 times"));
  EXPECT_THAT(ReportOf(EvaluationSummary{}, SampleCalibration()).text, StartsWith("NOT EVALUATED"));
}

TEST(EvaluationText, TakesTheCalibrationsOwnRecordingForNoTest) {
  EvaluationSummary evaluation;
  evaluation.poses = 12;
  evaluation.norm_rms[Triad::kAccelerometer] = 0.0021;
  evaluation.predicted_rms[Triad::kAccelerometer] = 0.0020;
  evaluation.is_own = true;
  EXPECT_THAT(ReportOf(evaluation, SampleCalibration()).text, StartsWith("NOT A TEST"));
}

TEST(EvaluationText, NamesTheWorstPosesFirst) {
  Quality quality;
  AddPoses(12, Triad::kAccelerometer, 0.002, &quality);
  quality.rests.pose_residuals[4].normalized = 9.87;
  EvaluationSummary evaluation;
  evaluation.poses = 12;
  evaluation.norm_rms[Triad::kAccelerometer] = 0.0021;
  evaluation.pose_residuals = quality.rests.pose_residuals;
  ExpectInOrder(ReportOf(evaluation, SampleCalibration()).text,
                {"Worst poses", "   5   accelerometer", "9.87"});
}

TEST(ComparisonText, JudgesByTheProbability) {
  Comparison comparison;
  comparison.entries = {{"accelerometer.bias.x", 0.0512, 0.0522, 0.001, 0.0005}};
  comparison.chi2 = 4.0;
  comparison.dof = 1;
  comparison.p_value = 0.0455;
  comparison.largest_in_sigmas = 2.0;
  EXPECT_THAT(ReportOf(comparison).text, StartsWith("AGREE"));
  EXPECT_THAT(ReportOf(comparison).text, HasSubstr("0.00100 ± 0.00050"));
  comparison.p_value = 0.0001;
  EXPECT_THAT(ReportOf(comparison).text, StartsWith("DIFFER"));
  EXPECT_THAT(ReportOf(Comparison{}).text, StartsWith("NOT COMPARED"));
}

}  // namespace calibration_report_test
}  // namespace truetriad
