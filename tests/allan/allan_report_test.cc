// SPDX-License-Identifier: Apache-2.0
#include "allan/allan_report.h"

#include <cmath>
#include <map>
#include <regex>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace truetriad {
namespace allan_report_test {

using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

constexpr double kMinimumOverB = 0.6642824703;  // sqrt(2 ln 2 / pi)

Interval Around(double value) { return {value, 0.9 * value, 1.2 * value}; }

/// Counts of 0.05 deg/s: N = 0.8 counts/√Hz = 0.04 deg/s/√Hz, and so on.
AllanResult Sample() {
  AllanResult result;
  result.source = "a<b>.csv";
  result.serial = "U&1";
  AllanTriad& triad = result.triads.emplace_back();
  triad.triad = Triad::kGyroscope;
  triad.unit = *ParseTriadUnit(Triad::kGyroscope, "counts");
  triad.si_per_count = 0.05 * M_PI / 180.0;
  triad.rate_hz = 100.0;
  triad.samples = 1000000;
  triad.duration_s = 10000.0;
  triad.warnings = {"gyroscope: the temperature went up"};
  for (AllanAxis& axis : triad.axes) {
    for (double tau_s = 0.01; tau_s < 2000.0; tau_s *= 1.3) {
      const double variance = 0.64 / tau_s + 0.01 + 4e-6 * tau_s / 3.0;
      axis.points.push_back({tau_s, Around(std::sqrt(variance)), 100.0, 1000});
    }
    axis.white_density = Around(0.8);
    axis.white_range_s = {0.01, 20.0};
    axis.instability = BiasInstability{Around(0.2), Around(0.2 * kMinimumOverB), 300.0, false};
    axis.random_walk = Around(0.02);
    axis.quantisation = Around(0.004);
  }
  triad.axes[1].random_walk.reset();
  triad.axes[2].instability->at_end = true;
  return result;
}

/// One panel's straight map from pixels to log10, from two of its labelled ticks.
struct LogScale {
  double pixel = 0.0, decade = 0.0, decades_a_pixel = 0.0;
  double Value(double at) const { return std::pow(10.0, decade + decades_a_pixel * (at - pixel)); }
};

LogScale ScaleFrom(const std::map<double, double>& decade_at_pixel) {
  const auto& [first, first_decade] = *decade_at_pixel.begin();
  const auto& [last, last_decade] = *decade_at_pixel.rbegin();
  return {first, first_decade, (last_decade - first_decade) / (last - first)};
}

/// All matches of `pattern`, each as its groups.
std::vector<std::vector<std::string>> Matches(const std::string& text, const std::string& pattern) {
  std::vector<std::vector<std::string>> matches;
  const std::regex expression(pattern);
  for (std::sregex_iterator it(text.begin(), text.end(), expression), end; it != end; ++it) {
    matches.emplace_back(it->begin() + 1, it->end());
  }
  return matches;
}

/// Scales of the first panel, read from its tick labels.
std::pair<LogScale, LogScale> FirstPanel(const std::string& svg) {
  std::map<double, double> tau, deviation;
  for (const auto& tick : Matches(svg, "class=\"middle\" x=\"([0-9.]+)\"[^>]*>([0-9.]+)<")) {
    const double x = std::stod(tick[0]);
    if (!tau.empty() && x < tau.rbegin()->first) break;  // The next row.
    if (x < 78.0 + 330.0) tau[x] = std::log10(std::stod(tick[1]));
  }
  for (const auto& tick : Matches(svg, "class=\"end\" x=\"73.0\" y=\"([0-9.]+)\">([0-9.]+)<")) {
    deviation[std::stod(tick[0]) - 4.0] = std::log10(std::stod(tick[1]));
  }
  return {ScaleFrom(tau), ScaleFrom(deviation)};
}

TEST(AllanReport, MarksAndSlopesOfThePlotAreThePrintedNumbers) {
  const AllanResult result = Sample();
  const std::string svg = AllanSvg(result);
  const std::string text = ReportOf(result).text;
  const auto [tau, deviation] = FirstPanel(svg);
  // Positions are written to a tenth of a unit, some 60 units a decade: 0.4 %.
  constexpr double kTolerance = 0.01;
  const auto coefficients = Coefficients(result.triads[0].axes[0], ShownScale(result.triads[0]));
  ASSERT_EQ(coefficients.size(), 4U);
  for (const AllanCoefficient& coefficient : coefficients) {
    const std::string symbol(1, coefficient.symbol);
    const auto mark =
        Matches(svg, "class=\"mark fill" + symbol + "\" cx=\"([0-9.]+)\" cy=\"([0-9.]+)\"");
    ASSERT_FALSE(mark.empty()) << symbol;
    EXPECT_NEAR(tau.Value(std::stod(mark[0][0])) / coefficient.mark_tau_s, 1.0, kTolerance);
    EXPECT_NEAR(deviation.Value(std::stod(mark[0][1])) / coefficient.mark, 1.0, kTolerance);

    const auto line = Matches(
        svg, "class=\"slope " + symbol + "\" points=\"([0-9.]+),([0-9.]+) ([0-9.]+),([0-9.]+)\"");
    ASSERT_FALSE(line.empty());
    const double from_s = tau.Value(std::stod(line[0][0]));
    const double to_s = tau.Value(std::stod(line[0][2]));
    const double from = deviation.Value(std::stod(line[0][1]));
    const double to = deviation.Value(std::stod(line[0][3]));
    EXPECT_NEAR(std::log(to / from) / std::log(to_s / from_s), coefficient.slope, 0.01);
    EXPECT_NEAR(
        from * std::pow(coefficient.mark_tau_s / from_s, coefficient.slope) / coefficient.mark,
        1.0,
        2.0 * kTolerance);
    // The same digits in the plot's legend and in the table.
    EXPECT_THAT(svg, HasSubstr(">" + ValueText(coefficient) + " " + coefficient.unit));
    EXPECT_THAT(text, HasSubstr(" " + ValueText(coefficient) + " "));
    EXPECT_THAT(text, HasSubstr(coefficient.unit));
  }
}

TEST(AllanReport, DrawsTheCurveWhereItsPointsAre) {
  const AllanResult result = Sample();
  const std::string svg = AllanSvg(result);
  const auto [tau, deviation] = FirstPanel(svg);
  const auto dots = Matches(svg, "M([0-9.]+) ([0-9.]+)h0");
  const auto& points = result.triads[0].axes[0].points;
  ASSERT_EQ(dots.size(), 3 * points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    EXPECT_NEAR(tau.Value(std::stod(dots[i][0])) / points[i].tau_s, 1.0, 0.01);
    EXPECT_NEAR(
        deviation.Value(std::stod(dots[i][1])) / (0.05 * points[i].deviation.value), 1.0, 0.01);
  }
}

TEST(AllanReport, ConvertsCountsOfKnownScaleAndNamesEveryUnit) {
  const std::string text = ReportOf(Sample()).text;
  EXPECT_THAT(text, HasSubstr("100 Hz, 2.778 h, 1000000 samples; 1 count = 0.05 deg/s"));
  // 0.8 counts/√Hz of 0.05 deg/s: 0.04 deg/s/√Hz = 2.4 deg/√h.
  EXPECT_TRUE(std::regex_search(text, std::regex("noise density N +0.04 +0.04 +0.04 +deg/s/√Hz")));
  EXPECT_TRUE(std::regex_search(text, std::regex("one sample +0.4 +0.4 +0.4 +deg/s\n")));
  EXPECT_TRUE(std::regex_search(text, std::regex("angle random walk +2.4 +2.4 +2.4 +deg/√h")));
  EXPECT_TRUE(std::regex_search(text, std::regex("bias instability B +0.01 +0.01 +≤ 0.01 +deg/s")));
  EXPECT_TRUE(std::regex_search(
      text, std::regex("rate random walk K +0.001 +not visible +0.001 +deg/s/s/√Hz")));
  EXPECT_THAT(text, HasSubstr("the temperature went up"));
  EXPECT_THAT(text, HasSubstr("K not visible"));
  EXPECT_THAT(text, HasSubstr("B ≤"));
}

TEST(AllanReport, LeavesCountsOfUnknownScaleAlone) {
  AllanResult result = Sample();
  result.triads[0].si_per_count.reset();
  const std::string text = ReportOf(result).text;
  EXPECT_TRUE(std::regex_search(text, std::regex("noise density N +0.8 +0.8 +0.8 +counts/√Hz")));
  EXPECT_THAT(text, Not(HasSubstr("deg")));
}

TEST(AllanReport, KeepsNamesOfTheUserOutOfTheMarkup) {
  const std::string svg = AllanSvg(Sample());
  EXPECT_THAT(svg, HasSubstr("a&lt;b&gt;.csv"));
  EXPECT_THAT(svg, HasSubstr("U&amp;1"));
  EXPECT_THAT(svg, HasSubstr("xmlns=\"http://www.w3.org/2000/svg\""));
}

TEST(AllanReport, SaysFirstWhatWasNotAtRestAndMarksItsCurves) {
  AllanResult result = Sample();
  AllanTriad& triad = result.triads[0];
  triad.disturbance = "the unit moved";
  for (AllanAxis& axis : triad.axes) {
    AllanAxis curve;
    curve.points = axis.points;
    axis = curve;
  }
  const std::string text = ReportOf(result).text;
  EXPECT_THAT(text, StartsWith("NOT AT REST: gyroscope: the unit moved\n"));
  EXPECT_THAT(text, HasSubstr("1000000 samples; 1 count = 0.05 deg/s: not at rest"));
  EXPECT_THAT(text, Not(HasSubstr("noise density")));
  EXPECT_THAT(text, Not(HasSubstr("not visible")));
  const std::string svg = AllanSvg(result);
  EXPECT_THAT(svg, HasSubstr("gyroscope x: NOT AT REST"));
  EXPECT_EQ(Matches(svg, "(M)[0-9.]+ [0-9.]+h0").size(), 3 * triad.axes[0].points.size());
  EXPECT_THAT(svg, Not(HasSubstr("class=\"mark")));
}

TEST(AllanReport, ShowsADeadAxisAsSuch) {
  AllanResult result = Sample();
  result.triads[0].axes[0] = {};
  EXPECT_THAT(AllanSvg(result), HasSubstr("gyroscope x: constant"));
  EXPECT_TRUE(
      std::regex_search(ReportOf(result).text, std::regex("noise density N +not visible +0.04")));
}

TEST(AllanReport, PageHasWhatTheTextSaysAndTheCurves) {
  AllanResult result = Sample();
  result.source = "a<b>%.csv";
  const std::string page = ReportOf(result).html;
  EXPECT_THAT(page, HasSubstr("Allan deviation of a&lt;b&gt;%.csv"));
  EXPECT_THAT(page, HasSubstr("AT REST"));
  EXPECT_THAT(page, HasSubstr("noise density N"));
  EXPECT_THAT(page, HasSubstr("K not visible"));
  EXPECT_THAT(page, HasSubstr("src=\"data:image/svg+xml,%3Csvg"));
  EXPECT_THAT(page, HasSubstr("a&amp;lt;b&amp;gt;%25.csv"));
  EXPECT_THAT(page, Not(HasSubstr("<b>%.csv")));
}

}  // namespace allan_report_test
}  // namespace truetriad
