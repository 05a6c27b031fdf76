// SPDX-License-Identifier: Apache-2.0
//
// Full second-order regressions of a sweep's windows.

#include "sweep/sweep_regression.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "math/random.h"
#include "support/sweep_trials.h"

namespace truetriad {
namespace sweep_regression_test {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr double kReferenceDegc = 25.0;
constexpr int kWindows = 600;

// Factors that go their own ways, so that every product of them is told from the others.
struct Factors {
  double reading = 0.0, tau = 0.0, rate = 0.0, ambient = 0.0, ambient_rate = 0.0;

  double At(const std::string& term) const {
    const std::map<std::string, double> values = {
        {"r", reading}, {"tau", tau}, {"T'", rate}, {"A", ambient}, {"A'", ambient_rate}};
    if (term.ends_with("^2")) return std::pow(values.at(term.substr(0, term.size() - 2)), 2);
    const std::size_t blank = term.find(' ');
    if (blank == std::string::npos) return values.at(term);
    return values.at(term.substr(0, blank)) * values.at(term.substr(blank + 1));
  }
};

Factors FactorsOf(int window) {
  const auto turns = [window](double windows) { return 2.0 * std::numbers::pi * window / windows; };
  Factors factors;
  factors.reading = window / 75 % 2 == 0 ? 9.8 : -4.0;
  factors.tau = 35.0 * std::sin(turns(210.0)) + 4.0;
  factors.rate = 0.05 * std::cos(turns(83.0));
  factors.ambient = 25.0 * std::sin(turns(131.0) + 1.0) - 3.0;
  factors.ambient_rate = 0.04 * std::cos(turns(47.0) + 0.3);
  return factors;
}

using Terms = std::map<std::string, double>;

// Windows of an accelerometer whose axes all follow `terms`, in two attitudes or in one.
PoseSet WindowsWith(const Terms& terms, double noise, int attitudes, Random* random) {
  PoseSet set;
  set.source = "made";
  set.streams.emplace_back().triad = Triad::kAccelerometer;
  set.sweep.attitude_names =
      attitudes == 1 ? std::vector<std::string>{"1"} : std::vector<std::string>{"1", "2"};
  for (int i = 0; i < kWindows; ++i) {
    Factors factors = FactorsOf(i);
    if (attitudes == 1) factors.reading = 9.8;
    double reading = factors.reading;
    for (const auto& [term, value] : terms) reading += value * factors.At(term);
    StaticPose& window = set.poses.emplace_back();
    window.start_ns = i * std::int64_t{1'000'000'000};
    window.temperature_degc = kReferenceDegc + factors.tau;
    window.temperature_rate_degcps = factors.rate;
    TriadPose& seen = window.triads[Triad::kAccelerometer].emplace();
    seen.samples = 100;
    seen.mean_raw.setConstant(reading);
    if (noise > 0.0) seen.mean_raw += noise * random->Normal3();
    seen.mean_covariance_raw = std::pow(std::max(noise, 1e-6), 2) * Eigen::Matrix3d::Identity();
    set.sweep.temperature.time_s.push_back(i);
    set.sweep.temperature.degc.push_back(*window.temperature_degc);
    set.sweep.temperature.rate_degcps.push_back(factors.rate);
    set.sweep.ambient.time_s.push_back(i);
    set.sweep.ambient.degc.push_back(kReferenceDegc + factors.ambient);
    set.sweep.ambient.rate_degcps.push_back(factors.ambient_rate);
    set.sweep.first.push_back(static_cast<std::size_t>(i));
    set.sweep.last.push_back(static_cast<std::size_t>(i));
    set.sweep.attitude.push_back(attitudes == 1 ? 0 : i / 75 % 2);
  }
  return set;
}

ThermalOptions AllFactors() {
  ThermalOptions wanted;
  wanted.regression.fill(true);
  return wanted;
}

SweepRegression Regressed(const PoseSet& set, int axis = 0) {
  constexpr int kFolds = 14;
  const SweepProblem problem(set, Triad::kAccelerometer, kReferenceDegc, true, kFolds);
  return RegressSweep(problem, axis, AllFactors(), "m/s^2");
}

const RegressionTerm& TermCalled(const SweepRegression& regression, const std::string& name) {
  const auto found = std::find_if(regression.terms.begin(),
                                  regression.terms.end(),
                                  [&](const RegressionTerm& term) { return term.name == name; });
  EXPECT_NE(found, regression.terms.end()) << name;
  return *found;
}

std::vector<std::string> Chosen(const SweepRegression& regression) {
  std::vector<std::string> names;
  for (const RegressionTerm& term : regression.terms) {
    if (term.chosen) names.push_back(term.name);
  }
  return names;
}

const Terms& SixTerms() {
  static const Terms terms = {
      {"tau", 2e-3}, {"tau^2", 3e-5}, {"T'", 0.8}, {"r tau", 4e-5}, {"A", -1e-3}, {"T' A'", 15.0}};
  return terms;
}

TEST(SweepRegression, HasTwentyOneTermsInFiveFactors) {
  Random random(1);
  const SweepRegression regression = Regressed(WindowsWith({}, 1e-3, 2, &random));
  EXPECT_EQ(regression.terms.size(), 21U);
  EXPECT_THAT(regression.factors, ElementsAre("r", "tau", "T'", "A", "A'"));
  EXPECT_EQ(regression.terms[0].name, "1");
  EXPECT_EQ(TermCalled(regression, "tau").unit, "m/s^2/degC");
  EXPECT_EQ(TermCalled(regression, "r tau").unit, "1/degC");
  EXPECT_EQ(TermCalled(regression, "T' A'").unit, "m/s^2/((degC/s)(degC/s))");
}

// Readings of 10 in doubles, some hundred of them: 1e-13 of the reading, seen through a term of a
// thousandth of it.
TEST(SweepRegression, RecoversItsTermsExactlyWithoutNoise) {
  Random random(2);
  const SweepRegression regression = Regressed(WindowsWith(SixTerms(), 0.0, 2, &random));
  EXPECT_THAT(Chosen(regression), ElementsAre("tau", "T'", "A", "r tau", "tau^2", "T' A'"));
  for (const auto& [name, value] : SixTerms()) {
    EXPECT_NEAR(TermCalled(regression, name).coefficient, value, 1e-9 * std::abs(value)) << name;
  }
  EXPECT_LT(regression.rms, 1e-11);
}

TEST(SweepRegression, FindsTheTermsThatAreThereWithTheirSigma) {
  Random random(3);
  int right = 0;
  constexpr int kRuns = 40;
  double chi2 = 0.0;
  for (int run = 0; run < kRuns; ++run) {
    const SweepRegression regression = Regressed(WindowsWith(SixTerms(), 5e-3, 2, &random));
    right +=
        Chosen(regression) == std::vector<std::string>{"tau", "T'", "A", "r tau", "tau^2", "T' A'"}
            ? 1
            : 0;
    for (const auto& [name, value] : SixTerms()) {
      const RegressionTerm& term = TermCalled(regression, name);
      EXPECT_TRUE(term.chosen) << name;
      if (term.chosen) chi2 += std::pow((term.coefficient - value) / term.sigma, 2);
    }
  }
  // At 5 % a run has one that is not there: 38 are expected, 33 is 3.6 σ below.
  EXPECT_GE(right, 33);
  // A χ² with 240 degrees of freedom, 4 σ.
  EXPECT_NEAR(chi2 / (kRuns * 6.0), 1.0, 4.0 * std::sqrt(2.0 / (kRuns * 6.0)));
}

TEST(SweepRegression, SeldomTakesATermThatIsNotThere) {
  Random random(4);
  constexpr int kRuns = 100;
  int false_entries = 0;
  for (int run = 0; run < kRuns; ++run) {
    const PoseSet set = WindowsWith({}, 1e-3, 2, &random);
    for (int axis = 0; axis < 3; ++axis) {
      false_entries += Chosen(Regressed(set, axis)).empty() ? 0 : 1;
    }
  }
  // 5 % of 300, and 3 σ of the count.
  EXPECT_LE(false_entries, 15 + 3 * static_cast<int>(std::ceil(std::sqrt(300 * 0.05 * 0.95))));
  RecordProperty("false_entries", false_entries);
}

TEST(SweepRegression, SaysWhatOneAttitudeCannotTell) {
  Random random(5);
  const SweepRegression regression = Regressed(WindowsWith({{"tau", 2e-3}}, 1e-3, 1, &random));
  EXPECT_THAT(Chosen(regression), ElementsAre("tau"));
  EXPECT_THAT(TermCalled(regression, "r tau").why, HasSubstr("add an attitude"));
  EXPECT_THAT(TermCalled(regression, "r^2").why, HasSubstr("static calibration"));
  EXPECT_THAT(TermCalled(regression, "tau^2").why, IsEmpty());
}

TEST(SweepRegression, SaysWhatStandsForEachOther) {
  Random random(6);
  PoseSet set = WindowsWith({{"tau", 2e-3}}, 1e-3, 2, &random);
  // The ambient thermometer is the unit's own but for a little.
  set.sweep.ambient.degc = set.sweep.temperature.degc;
  for (double& degc : set.sweep.ambient.degc) degc += 0.1 * random.Normal();
  const SweepRegression regression = Regressed(set);
  const RegressionTerm& tau = TermCalled(regression, "tau");
  const RegressionTerm& ambient = TermCalled(regression, "A");
  EXPECT_NE(tau.chosen, ambient.chosen);
  EXPECT_THAT(tau.chosen ? ambient.why : tau.why, HasSubstr("independent of the chosen terms"));
}

TEST(SweepRegression, LeavesOutWindowsWithoutTheAmbientTemperature) {
  Random random(7);
  PoseSet set = WindowsWith(SixTerms(), 0.0, 2, &random);
  for (std::size_t i = 100; i < 200; ++i) set.sweep.ambient.degc[i] = std::nan("");
  const SweepRegression regression = Regressed(set);
  EXPECT_EQ(regression.windows, kWindows - 100);
  EXPECT_NEAR(TermCalled(regression, "A").coefficient, -1e-3, 1e-11);
}

TEST(SweepRegression, TableOfStepsGoesUpInFitAndDownInHeldOutError) {
  Random random(8);
  const SweepRegression regression = Regressed(WindowsWith(SixTerms(), 5e-3, 2, &random));
  ASSERT_GE(regression.steps.size(), 7U);
  EXPECT_EQ(regression.steps.front().what, "start");
  EXPECT_EQ(regression.steps.front().r2, 0.0);
  for (std::size_t i = 1; i < regression.steps.size(); ++i) {
    EXPECT_GT(regression.steps[i].f, 0.0);
  }
  EXPECT_LT(regression.steps.back().bic, regression.steps.front().bic);
  EXPECT_LT(regression.steps.back().held_out, 0.5 * regression.steps.front().held_out);
  EXPECT_GT(regression.steps.back().adjusted_r2, 0.9);
}

}  // namespace sweep_regression_test
}  // namespace truetriad
