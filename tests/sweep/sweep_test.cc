// SPDX-License-Identifier: Apache-2.0
//
// Temperature sweeps: the terms of a bias in temperature and its rate.

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "math/dense/cholesky.h"
#include "math/distributions.h"
#include "problem/parameter_name.h"
#include "support/finding_matchers.h"
#include "support/sweep_trials.h"
#include "truetriad/calibrate/calibrate.h"
#include "truetriad/verdict/summary.h"

namespace truetriad {
namespace sweep_test {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using trials::CubicWithRates;
using trials::Sweep;
using trials::SweepLeg;
using trials::SweepOptionsFor;
using trials::TwoRates;
using trials::WindowsOf;

ThermalOptions SevenTerms() {
  ThermalOptions terms;
  terms.bias_order = 3;
  terms.rate = PerRateTerm<bool>::All(true);
  return terms;
}

ThermalOptions Polynomial(int order) {
  ThermalOptions terms;
  terms.bias_order = order;
  return terms;
}

Calibration Calibrated(const PoseSet& windows, const CalibrateOptions& options) {
  Result<CalibrationSummary> summary = Calibrate(windows, options);
  EXPECT_TRUE(summary) << summary.error().message;
  return summary ? std::move(summary->calibration) : Calibration();
}

// Estimate minus truth of what is listed, in the order of the covariance; NaN for what is held.
Eigen::VectorXd ErrorsOf(const Calibration& calibration, const Sweep& sweep) {
  const std::vector<std::string>& names = calibration.covariance.parameters;
  Eigen::VectorXd errors(static_cast<Eigen::Index>(names.size()));
  const TriadCalibration& sensor = *calibration.sensors[Triad::kGyroscope];
  for (std::size_t i = 0; i < names.size(); ++i) {
    double& error = errors[static_cast<Eigen::Index>(i)];
    error = std::nan("");
    const auto name = ParameterName::Parse(names[i]);
    if (!name) continue;
    const auto power = static_cast<std::size_t>(name->power);
    if (const auto rate = InfoOf(name->kind).rate) {
      error = (*sensor.thermal->rate[*rate] - *sweep.terms.rate[*rate])[name->row];
    } else if (name->kind == ParameterKind::kBias) {
      error = power == 0 ? sensor.model.bias[name->row] - sweep.bias[name->row]
                         : sensor.thermal->bias[power - 1][name->row] -
                               sweep.terms.bias[power - 1][name->row];
    }
  }
  return errors;
}

std::vector<Eigen::Index> PlacesOnAxis(const Calibration& calibration, int axis) {
  std::vector<Eigen::Index> places;
  for (std::size_t i = 0; i < calibration.covariance.parameters.size(); ++i) {
    const auto name = ParameterName::Parse(calibration.covariance.parameters[i]);
    if (!name || name->row != axis || name->kind == ParameterKind::kSensitivity) continue;
    places.push_back(static_cast<Eigen::Index>(i));
  }
  return places;
}

// Normalised error squared of one axis' parameters.
double Nees(const Calibration& calibration, const Sweep& sweep, int axis) {
  const std::vector<Eigen::Index> places = PlacesOnAxis(calibration, axis);
  const Eigen::VectorXd error = ErrorsOf(calibration, sweep)(places);
  const Eigen::MatrixXd covariance = calibration.covariance.matrix(places, places);
  const Eigen::VectorXd size = covariance.diagonal().cwiseSqrt();
  const Eigen::MatrixXd correlation =
      size.cwiseInverse().asDiagonal() * covariance * size.cwiseInverse().asDiagonal();
  const Eigen::VectorXd scaled = error.cwiseQuotient(size);
  return scaled.dot(PivotedCholesky(correlation).SolveVector(scaled));
}

Sweep SweepWithRates() {
  Sweep sweep;
  sweep.legs = TwoRates();
  sweep.terms = CubicWithRates();
  return sweep;
}

TEST(CalibrateSweep, FindsAllSevenTermsOfARampUpAndDownAtTwoRates) {
  Random random(1);
  const Sweep sweep = SweepWithRates();
  const Calibration calibration =
      Calibrated(WindowsOf(sweep, &random), SweepOptionsFor(SevenTerms()));
  ASSERT_TRUE(calibration.IsUsable()) << calibration.findings.back().Message();
  const Eigen::VectorXd errors = ErrorsOf(calibration, sweep);
  for (int axis = 0; axis < 3; ++axis) {
    const std::vector<Eigen::Index> places = PlacesOnAxis(calibration, axis);
    EXPECT_EQ(places.size(), 7U);
    for (const Eigen::Index i : places) {
      EXPECT_LE(std::abs(errors[i]), 3.0 * std::sqrt(calibration.covariance.matrix(i, i)))
          << calibration.covariance.parameters[static_cast<std::size_t>(i)];
    }
  }
}

// 40 runs of three axes with seven parameters each: a χ² with 840 degrees of freedom, were σ known;
// they are from the residuals of some hundred windows, which adds their own scatter of a few per
// cent, hence twice the χ²'s own 99.9 % interval.
TEST(CalibrateSweep, ErrorsAreWhatTheCovarianceSays) {
  Random random(2);
  const Sweep sweep = SweepWithRates();
  double nees = 0.0;
  constexpr int kRuns = 40;
  for (int run = 0; run < kRuns; ++run) {
    const Calibration calibration =
        Calibrated(WindowsOf(sweep, &random), SweepOptionsFor(SevenTerms()));
    for (int axis = 0; axis < 3; ++axis) nees += Nees(calibration, sweep, axis);
  }
  constexpr double kDof = kRuns * 3 * 7;
  const double low = ChiSquareQuantile(5e-4, kDof) / kDof,
               high = ChiSquareQuantile(1 - 5e-4, kDof) / kDof;
  EXPECT_GT(nees / kDof, 1.0 - 2.0 * (1.0 - low));
  EXPECT_LT(nees / kDof, 1.0 + 2.0 * (high - 1.0));
  RecordProperty("nees_over_dim", std::to_string(nees / kDof));
}

// σ are those of the stated terms, and of how far the missing one moves them.
TEST(CalibrateSweep, SaysThatAStatedOrderIsTooLowAndAllowsForIt) {
  Random random(4);
  Sweep sweep;
  sweep.legs = TwoRates();
  sweep.terms = CubicWithRates();
  for (const RateTermInfo& rate : kRateTerms) sweep.terms.rate[rate.term].reset();
  for (int order = 1; order <= 3; ++order) {
    sweep.terms.bias.resize(static_cast<std::size_t>(std::max(order, 2)));
    const Calibration calibration =
        Calibrated(WindowsOf(sweep, &random), SweepOptionsFor(Polynomial(order)));
    const bool is_too_low = static_cast<std::size_t>(order) < sweep.terms.bias.size();
    EXPECT_EQ(Find(calibration.findings, FindingCode::kSweepUnexplained) != nullptr, is_too_low)
        << order;
    if (!is_too_low) continue;
    EXPECT_THAT(calibration.findings,
                Contains(Says(HasSubstr("the stated bias_order of 1, residuals"))));
    const Eigen::VectorXd errors = ErrorsOf(calibration, sweep);
    for (Eigen::Index i = 0; i < errors.size(); ++i) {
      if (!(calibration.covariance.matrix(i, i) > 0.0)) continue;
      EXPECT_LE(std::abs(errors[i]), 3.0 * std::sqrt(calibration.covariance.matrix(i, i)))
          << calibration.covariance.parameters[static_cast<std::size_t>(i)];
    }
  }
}

TEST(CalibrateSweep, NamesWhatOneRateUpAndDownDoesNotTell) {
  Random random(3);
  Sweep sweep = SweepWithRates();
  sweep.legs = {{60.0, 0.05}, {-10.0, 0.05}};
  // What cannot be told from a constant goes into it.
  sweep.terms.rate[RateTerm::kQuadratic].reset();
  const Calibration calibration =
      Calibrated(WindowsOf(sweep, &random), SweepOptionsFor(SevenTerms()));
  ASSERT_TRUE(calibration.IsUsable());
  EXPECT_THAT(calibration.findings,
              Contains(AllOf(HasCode(FindingCode::kTermsLeftOut), Says(HasSubstr("T'^2")))));
  EXPECT_FALSE(calibration.sensors[Triad::kGyroscope]->thermal->rate[RateTerm::kQuadratic]);
  const Eigen::VectorXd errors = ErrorsOf(calibration, sweep);
  for (Eigen::Index i = 0; i < errors.size(); ++i) {
    if (std::isnan(errors[i])) continue;
    EXPECT_LE(std::abs(errors[i]), 3.5 * std::sqrt(calibration.covariance.matrix(i, i)))
        << calibration.covariance.parameters[static_cast<std::size_t>(i)];
  }
}

TEST(CalibrateSweep, NamesWhatOnlyUpDoesNotTell) {
  Random random(4);
  Sweep sweep = SweepWithRates();
  sweep.legs = {{60.0, 0.05}};
  sweep.terms.rate = {};
  ThermalOptions wanted = SevenTerms();
  wanted.lags = 1;
  const Calibration calibration = Calibrated(WindowsOf(sweep, &random), SweepOptionsFor(wanted));
  ASSERT_TRUE(calibration.IsUsable());
  EXPECT_THAT(
      calibration.quality.sweep.axes[0].left_out,
      testing::UnorderedElementsAre(testing::StartsWith("T':"),
                                    testing::StartsWith("T'^2:"),
                                    testing::StartsWith("tau T':"),
                                    AllOf(testing::StartsWith("lag:"), HasSubstr("up and down"))));
  EXPECT_EQ(calibration.quality.sweep.axes[0].chosen, "tau, tau^2, tau^3");
}

// The sweep with a thermometer that is fine and one of whole degrees, of the same noise. Each axis
// may lose a fifth, in any single recording: what T and T' are off by has to stay below
// sqrt(1.2^2 - 1) = 0.66 of the noise of a window's mean.
void ExpectWholeDegreesAreEnough(const Sweep& sweep, int lags) {
  ThermalOptions terms = SevenTerms();
  terms.lags = lags;
  for (std::uint64_t seed = 0; seed < 2; ++seed) {
    Random random(seed), same(seed);
    Sweep whole = sweep;
    whole.thermometer_step_degc = 1.0;
    const Calibration fine = Calibrated(WindowsOf(sweep, &random), SweepOptionsFor(terms));
    const Calibration coarse = Calibrated(WindowsOf(whole, &same), SweepOptionsFor(terms));
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const SweepAxis &with_fine = fine.quality.sweep.axes[axis],
                      &with_whole = coarse.quality.sweep.axes[axis];
      EXPECT_LE(with_whole.rms_after, 1.2 * with_fine.rms_after) << axis << " of seed " << seed;
      EXPECT_LE(with_whole.held_out, 1.2 * with_fine.held_out) << axis << " of seed " << seed;
    }
  }
}

TEST(CalibrateSweep, FitsAThermometerOfWholeDegreesAsWellAsAFineOne) {
  Sweep sweep = SweepWithRates();
  sweep.unit_lag_s = 120.0;
  ExpectWholeDegreesAreEnough(sweep, 0);
}

// The temperature turns between two steps of the thermometer, 80 s apart.
TEST(CalibrateSweep, FitsWholeDegreesOfABoardThatFollowsQuickly) {
  Sweep sweep = SweepWithRates();
  sweep.unit_lag_s = 30.0;
  ExpectWholeDegreesAreEnough(sweep, 0);
}

TEST(CalibrateSweep, FitsWholeDegreesBesideALagOfTheElement) {
  Sweep sweep = SweepWithRates();
  sweep.unit_lag_s = 120.0;
  sweep.element_lag_s = 30.0;
  ExpectWholeDegreesAreEnough(sweep, 1);
}

TEST(CalibrateSweep, FitsWholeDegreesBehindTheAirOfTheChamber) {
  Sweep sweep = SweepWithRates();
  sweep.air_lag_s = 60.0;
  ExpectWholeDegreesAreEnough(sweep, 0);
}

TEST(CalibrateSweep, FitsWholeDegreesThatGoToAndFroWithTheNoise) {
  Sweep sweep = SweepWithRates();
  sweep.unit_lag_s = 60.0;
  sweep.thermometer_sigma_degc = 0.2;
  ExpectWholeDegreesAreEnough(sweep, 0);
}

TEST(CalibrateSweep, FitsWholeDegreesWithDwells) {
  Sweep sweep = SweepWithRates();
  sweep.legs.insert(sweep.legs.begin() + 1, {1800.0, 0.0});
  ExpectWholeDegreesAreEnough(sweep, 0);
}

// A thermometer with white noise of 0.5 degC: what it does to the temperature, over the width that
// it is smoothed over, looks like a lag that is another. 60 squared errors over their variance are
// a chi-square, 99 %.
TEST(CalibrateSweep, LagsOfANoisyThermometerAreOffByWhatTheirSigmaSays) {
  Random random(16);
  Sweep sweep = SweepWithRates();
  sweep.terms.rate = {};
  sweep.element_lag_s = 60.0;
  sweep.thermometer_sigma_degc = 0.5;
  ThermalOptions terms = Polynomial(3);
  terms.lags = 1;
  double square = 0.0, count = 0.0;
  for (int run = 0; run < 20; ++run) {
    const Calibration calibration = Calibrated(WindowsOf(sweep, &random), SweepOptionsFor(terms));
    for (const SweepAxis& axis : calibration.quality.sweep.axes) {
      square += std::pow((axis.element_lag_s - 60.0) / axis.element_lag_sigma_s, 2);
      count += 1.0;
    }
  }
  EXPECT_GT(square, ChiSquareQuantile(0.005, count));
  EXPECT_LT(square, ChiSquareQuantile(0.995, count));
  RecordProperty("nees_over_dim", std::to_string(square / count));
}

// The element follows the thermometer by a minute. Noise of window means is what is left.
TEST(CalibrateSweep, FindsALagOfAMinute) {
  Random random(7);
  Sweep sweep = SweepWithRates();
  sweep.element_lag_s = 60.0;
  ThermalOptions terms = SevenTerms();
  terms.lags = 1;
  const Calibration calibration = Calibrated(WindowsOf(sweep, &random), SweepOptionsFor(terms));
  ASSERT_TRUE(calibration.IsUsable());
  for (const SweepAxis& axis : calibration.quality.sweep.axes) {
    EXPECT_LE(axis.rms_after, 1.1 * axis.noise_sigma) << axis.axis;
    const double lag = axis.element_lag_s, sigma = axis.element_lag_sigma_s;
    EXPECT_NEAR(lag, 60.0, 4.0 * sigma) << axis.axis;
    EXPECT_LT(sigma, 5.0) << axis.axis;
    EXPECT_GT(axis.held_out_cubic, 2.0 * axis.held_out) << axis.axis;
  }
}

TEST(CalibrateSweep, ChoosesALagWhereThereIsOneAndNoneWhereThereIsNone) {
  Random random(8);
  Sweep sweep = SweepWithRates();
  ThermalOptions terms = Polynomial(3);
  terms.lags_auto = true;
  sweep.terms.rate = {};
  const Calibration without = Calibrated(WindowsOf(sweep, &random), SweepOptionsFor(terms));
  EXPECT_FALSE(without.sensors[Triad::kGyroscope]->thermal->element_lag_s);
  sweep.element_lag_s = 90.0;
  const Calibration with = Calibrated(WindowsOf(sweep, &random), SweepOptionsFor(terms));
  ASSERT_TRUE(with.sensors[Triad::kGyroscope]->thermal->element_lag_s);
  EXPECT_NEAR(with.sensors[Triad::kGyroscope]->thermal->element_lag_s->x(), 90.0, 10.0);
}

// What creeps over hours is no lag of some minutes.
TEST(CalibrateSweep, CallsALagOfMoreThanAQuarterOfTheRecordingADrift) {
  Random random(9);
  Sweep sweep = SweepWithRates();
  sweep.terms.rate = {};
  sweep.element_lag_s = 4000.0;  // of 7000 s
  ThermalOptions terms = Polynomial(3);
  terms.lags = 1;
  const Calibration calibration = Calibrated(WindowsOf(sweep, &random), SweepOptionsFor(terms));
  EXPECT_THAT(calibration.findings, Contains(Says(HasSubstr("this is drift, not a lag"))));
  EXPECT_FALSE(calibration.sensors[Triad::kGyroscope]->thermal->element_lag_s);
}

// A bias that turns sharply at 32.4 degC: no cubic follows it.
Sweep SweepWithKnee() {
  Sweep sweep;
  sweep.legs = {{60.0, 0.05}, {-10.0, 0.05}};
  sweep.curve = [](double degc) { return 1e-3 * degc + 4e-3 * std::max(0.0, degc - 32.4); };
  return sweep;
}

TEST(CalibrateSweep, FindsASharpKnee) {
  Random random(13);
  ThermalOptions terms = Polynomial(2);
  terms.find_knots = 1;
  const Calibration calibration =
      Calibrated(WindowsOf(SweepWithKnee(), &random), SweepOptionsFor(terms));
  ASSERT_TRUE(calibration.IsUsable()) << calibration.findings.back().Message();
  for (const SweepAxis& axis : calibration.quality.sweep.axes) {
    EXPECT_GE(axis.held_out_cubic, 3.0 * axis.held_out) << axis.axis;
    EXPECT_LE(axis.rms_after, 1.1 * axis.noise_sigma) << axis.axis;
  }
  const ThermalTerms& thermal = *calibration.sensors[Triad::kGyroscope]->thermal;
  ASSERT_EQ(thermal.knots.size(), 3U);
  const TriadModel<double>& model = calibration.sensors[Triad::kGyroscope]->model;
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_EQ(thermal.knots[static_cast<std::size_t>(axis)].axis, axis);
    EXPECT_NEAR(thermal.knots[static_cast<std::size_t>(axis)].degc, 32.4, 0.5);
    for (const double degc : {-5.0, 20.0, 32.4, 45.0, 55.0}) {
      // A tenth of the noise of a reading.
      EXPECT_NEAR(
          ModelAtTemperature(model, thermal, degc).bias[axis], SweepWithKnee().curve(degc), 1e-4)
          << degc;
    }
  }
}

TEST(CalibrateSweep, TakesKnotsAsTheyAreGivenWithoutAKinkOnRequest) {
  Random random(14);
  ThermalOptions terms = Polynomial(2);
  terms.knots_degc = {25.0, 40.0};
  terms.smooth_knots = true;
  const Calibration calibration =
      Calibrated(WindowsOf(SweepWithKnee(), &random), SweepOptionsFor(terms));
  ASSERT_TRUE(calibration.IsUsable());
  const ThermalTerms& thermal = *calibration.sensors[Triad::kGyroscope]->thermal;
  ASSERT_EQ(thermal.knots.size(), 6U);
  for (const ThermalKnot& knot : thermal.knots) EXPECT_EQ(knot.slope, 0.0);
  EXPECT_THAT(calibration.covariance.parameters, Contains("gyroscope.thermal.knot.2.curve.z"));
}

TEST(CalibrateSweep, FindsNoKnotWhereThereIsNone) {
  Random random(15);
  Sweep sweep;
  sweep.legs = {{60.0, 0.05}, {-10.0, 0.05}};
  sweep.terms.bias = {{1e-3, -2e-3, 5e-4}};
  ThermalOptions terms = Polynomial(2);
  terms.find_knots = 1;
  const Calibration calibration = Calibrated(WindowsOf(sweep, &random), SweepOptionsFor(terms));
  EXPECT_TRUE(calibration.sensors[Triad::kGyroscope]->thermal->knots.empty());
  EXPECT_THAT(calibration.findings, Contains(Says(HasSubstr("does not lower the held-out error"))));
}

// Three attitudes of an accelerometer share their temperature terms; each has a constant of its
// own.
TEST(CalibrateSweep, SharesTheTermsAmongAttitudes) {
  Random random(12);
  const Eigen::Vector3d slope(2e-3, -1e-3, 4e-3);
  MemoryStream stream(Triad::kAccelerometer);
  stream.info.unit = {"m/s^2", 1.0, false};
  PoseSelection selection;
  selection.kind = PoseSelectionKind::kSweep;
  constexpr int kRows = 4000;
  const std::vector<Eigen::Vector3d> forces = {{0.0, 0.0, 9.8}, {9.8, 0.0, 0.0}, {0.0, 6.9, -6.9}};
  for (std::size_t attitude = 0; attitude < forces.size(); ++attitude) {
    const int before = static_cast<int>(attitude) * kRows;
    selection.ranges.push_back({before + 5, before + kRows - 5, "", ""});
    for (int i = 0; i < kRows; ++i) {
      const double degc = 20.0 + 0.02 * std::min(i, kRows - i);
      stream.Add((before + i) * std::int64_t{500'000'000},
                 forces[attitude] + slope * (degc - 25.0) + 0.002 * random.Normal3());
      stream.temperature_degc.push_back(degc + 0.01 * random.Normal());
    }
  }
  MemorySource source({stream});
  const Result<PoseSet> windows = CollectPoses(source, selection);
  ASSERT_TRUE(windows) << windows.error().message;
  CalibrateOptions options;
  options.triads[Triad::kAccelerometer].enabled = true;
  options.triads[Triad::kAccelerometer].thermal = Polynomial(1);
  options.sweep.emplace();
  options.cross_validation_folds = 14;
  const Calibration calibration = Calibrated(*windows, options);
  ASSERT_TRUE(calibration.IsUsable());
  const Eigen::Vector3d found = calibration.sensors[Triad::kAccelerometer]->thermal->bias[0];
  const auto& names = calibration.covariance.parameters;
  for (int axis = 0; axis < 3; ++axis) {
    const std::string name = std::string("accelerometer.thermal.bias.1.") + "xyz"[axis];
    const auto at = std::find(names.begin(), names.end(), name) - names.begin();
    const double sigma = std::sqrt(calibration.covariance.matrix(at, at));
    EXPECT_NEAR(found[axis], slope[axis], 3.5 * sigma);
    // 12000 samples of 0.002 over 40 degC, uniform: 0.002 / (40 / sqrt(12)) / sqrt(12000).
    EXPECT_NEAR(sigma, 1.58e-6, 0.3e-6);
  }
}

// A share of 5 % of 200 runs; three axes a run count as one each.
TEST(CalibrateSweep, SeldomChoosesMoreThanALineWhereThereIsNoMore) {
  Random random(10);
  Sweep sweep;
  sweep.legs = {{60.0, 0.06}, {-10.0, 0.06}};
  sweep.terms.bias = {{1e-3, -2e-3, 5e-4}};
  ThermalOptions terms = Polynomial(7);
  terms.bias_order_auto = true;
  int more = 0, count = 0;
  while (count < 201) {
    const Calibration calibration = Calibrated(WindowsOf(sweep, &random), SweepOptionsFor(terms));
    for (const SweepAxis& axis : calibration.quality.sweep.axes) {
      more += axis.chosen == "tau" ? 0 : 1;
      ++count;
    }
  }
  EXPECT_LE(more, count / 20);
  RecordProperty("more", more);
}

TEST(CalibrateSweep, ChoosesTheTermsThatAreThere) {
  Random random(11);
  Sweep sweep = SweepWithRates();
  sweep.terms.rate[RateTerm::kQuadratic].reset(), sweep.terms.rate[RateTerm::kCross].reset();
  ThermalOptions terms = SevenTerms();
  terms.bias_order_auto = terms.rate_auto = true;
  terms.bias_order = ThermalOptions::kMaxBiasOrder;
  const Calibration calibration = Calibrated(WindowsOf(sweep, &random), SweepOptionsFor(terms));
  for (const SweepAxis& axis : calibration.quality.sweep.axes) {
    EXPECT_EQ(axis.chosen, "tau, tau^2, tau^3, T'") << axis.axis;
    ASSERT_FALSE(axis.steps.empty());
    EXPECT_GT(axis.steps.back().r2, 0.99);
    EXPECT_LT(axis.steps.back().held_out, 0.5 * axis.steps.front().held_out);
  }
}

// Nine tenths of the time at the hot end, and a curve that no cubic follows.
TEST(CalibrateSweep, DoesNotLetADwellDecide) {
  Random random(6);
  Sweep sweep;
  sweep.legs = {{60.0, 0.06}, {21000.0, 0.0}, {-10.0, 0.06}};
  sweep.curve = [](double degc) { return 0.02 * std::exp(-degc / 20.0); };
  const PoseSet windows = WindowsOf(sweep, &random);
  CalibrateOptions options = SweepOptionsFor(Polynomial(3));
  // RMS error of the fit over a tenth of the range at an end.
  const auto error_at = [&](const Calibration& calibration, double low, double high) {
    double sum = 0.0, count = 0.0;
    for (const SweepWindow& window : calibration.quality.sweep.windows) {
      if (window.degc < low || window.degc > high) continue;
      sum += std::pow(window.fit_raw.x() - sweep.curve(window.degc), 2), count += 1.0;
    }
    return std::sqrt(sum / count);
  };
  const Calibration even = Calibrated(windows, options);
  options.sweep->even_temperatures = false;
  const Calibration plain = Calibrated(windows, options);
  EXPECT_LE(error_at(even, -10.0, -3.0), 2.0 * error_at(even, 53.0, 60.0));
  EXPECT_GT(error_at(plain, -10.0, -3.0), 2.0 * error_at(plain, 53.0, 60.0));
  RecordProperty("even",
                 std::to_string(error_at(even, -10.0, -3.0)) + " " +
                     std::to_string(error_at(even, 53.0, 60.0)));
  RecordProperty("plain",
                 std::to_string(error_at(plain, -10.0, -3.0)) + " " +
                     std::to_string(error_at(plain, 53.0, 60.0)));
}

}  // namespace sweep_test
}  // namespace truetriad
