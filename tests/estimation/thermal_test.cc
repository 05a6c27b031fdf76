// SPDX-License-Identifier: Apache-2.0
//
// Temperature terms in the static estimator: exact recovery, Jacobians, names, statistics of
// errors.

#include "truetriad/model/thermal.h"

#include <array>
#include <cmath>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include <ceres/gradient_checker.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "estimation/parameter_name.h"
#include "estimation/pose_cost.h"
#include "estimation/thermal_block.h"
#include "support/accel_mag_trials.h"
#include "truetriad/estimation/calibrate.h"

namespace truetriad {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using trials::JointOptions;
using trials::RandomUnit;

constexpr std::array kStaticTriads = {Triad::kAccelerometer, Triad::kMagnetometer};
constexpr std::array kSoakDegc = {-20.0, 0.0, 25.0, 45.0, 65.0};
constexpr double kReferenceDegc = 25.0;

// A unit with temperature terms, in a chamber.
struct Soak {
  SyntheticUnit unit;
  PerTriad<std::optional<ThermalTerms>> thermal;
  std::vector<Eigen::Quaterniond> attitudes;
  std::vector<double> temperatures_degc, rates_degcps;
  CalibrateOptions options;
};

Eigen::Matrix3d RandomMatrix(Random* random) {
  return Eigen::Matrix3d::NullaryExpr([random] { return random->Normal(); });
}

// Bias drifts by about 2 % of the signal and gains by about 1 % over the range.
ThermalTerms RandomTerms(const ThermalOptions& terms, double strength, Random* random) {
  constexpr double kSpanDegc = 40.0;
  ThermalTerms thermal;
  thermal.reference_degc = kReferenceDegc;
  for (int i = 1; i <= terms.bias_order; ++i) {
    thermal.bias.emplace_back(0.02 * strength / std::pow(kSpanDegc, i) * random->Normal3());
  }
  for (int i = 1; i <= terms.matrix_order; ++i) {
    thermal.sensitivity.emplace_back(0.01 / std::pow(kSpanDegc, i) * RandomMatrix(random));
  }
  const double per_rate = 0.01 * strength / 0.02;
  if (terms.rate_linear) thermal.rate_linear = per_rate * random->Normal3();
  if (terms.rate_quadratic) thermal.rate_quadratic = per_rate / 0.02 * random->Normal3();
  if (terms.rate_cross) thermal.rate_cross = per_rate / kSpanDegc * random->Normal3();
  return thermal;
}

// `attitudes_each` attitudes at each chamber temperature, gauge `accel-x`.
Soak MakeSoak(const ThermalOptions& terms, int attitudes_each, bool joint, Random* random) {
  Soak soak;
  soak.unit = RandomUnit({}, random);
  soak.options = JointOptions(soak.unit);
  soak.options.reference.temperature_degc = kReferenceDegc;
  for (const Triad triad : kStaticTriads) {
    TriadOptions& sensor = soak.options.triads[triad];
    sensor.excess = ExcessNoise::kNone;
    sensor.thermal = terms;
    soak.thermal[triad] = RandomTerms(terms, soak.unit.WorldVector(triad).norm(), random);
  }
  // The body frame is that of the accelerometer at every temperature. model.md §3.
  for (Eigen::Matrix3d& term : soak.thermal[Triad::kAccelerometer]->sensitivity) {
    term = term.triangularView<Eigen::Lower>();
  }
  if (!joint) {
    soak.options.triads[Triad::kMagnetometer].enabled = false;
    soak.unit.models[Triad::kMagnetometer].reset();
    soak.thermal[Triad::kMagnetometer].reset();
  }
  for (const double temperature : kSoakDegc) {
    for (const Eigen::Quaterniond& attitude : RandomAttitudes(attitudes_each, random)) {
      soak.attitudes.push_back(attitude);
      soak.temperatures_degc.push_back(temperature);
      soak.rates_degcps.push_back(terms.rate_linear || terms.rate_quadratic || terms.rate_cross
                                      ? random->Uniform(-0.02, 0.02)
                                      : 0.0);
    }
  }
  return soak;
}

// What the estimator is given. Noise is what `noise` says; its covariance is stated as `stated`.
PoseSet PosesOf(const Soak& soak,
                const SyntheticNoise& noise,
                const SyntheticNoise& stated,
                Random* random) {
  PoseSet poses = SimulatePoses(soak.unit, soak.attitudes, noise, random);
  for (std::size_t k = 0; k < poses.poses.size(); ++k) {
    StaticPose& pose = poses.poses[k];
    pose.temperature_degc = soak.temperatures_degc[k];
    pose.temperature_rate_degcps = soak.rates_degcps[k];
    for (const Triad triad : kStaticTriads) {
      if (!soak.unit.models[triad]) continue;
      const TriadModel<double>& at_reference = *soak.unit.models[triad];
      const TriadModel<double> model = ModelAtTemperature(
          at_reference, *soak.thermal[triad], *pose.temperature_degc, pose.temperature_rate_degcps);
      const Eigen::Vector3d truth = soak.attitudes[k].conjugate() * soak.unit.WorldVector(triad);
      TriadPose& reading = *pose.triads[triad];
      reading.mean_raw += model.RawFromTruth(truth) - at_reference.RawFromTruth(truth);
      const Eigen::Matrix3d& S = at_reference.sensitivity;
      reading.mean_covariance_raw = std::pow(stated.rest_sigma[triad], 2) * S * S.transpose();
      reading.has_covariance = true;
    }
  }
  return poses;
}

PoseSet ExactPoses(const Soak& soak) {
  Random unused(0);
  return PosesOf(soak, SyntheticNoise{}, trials::ModelNoise(), &unused);
}

// Told by a fixture that stands somehow in the field.
void OnFixture(Soak* soak, PoseSet* poses) {
  soak->options.attitudes.kind = AttitudeKind::kGiven;
  soak->options.gauge = Gauge::kFixture;
  const Eigen::Quaterniond fixture_from_world(Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitZ()));
  for (std::size_t k = 0; k < poses->poses.size(); ++k) {
    poses->poses[k].attitude =
        AttitudeReference{fixture_from_world * soak->attitudes[k], Eigen::Vector3d::Zero()};
  }
}

// Estimate minus truth of every entry of a sensor's model, in the order of the covariance; NaN for
// the others but the dip.
Eigen::VectorXd Errors(const Calibration& calibration, const Soak& soak) {
  const std::vector<std::string>& names = calibration.covariance.parameters;
  Eigen::VectorXd errors(static_cast<Eigen::Index>(names.size()));
  for (std::size_t i = 0; i < names.size(); ++i) {
    double& error = errors[static_cast<Eigen::Index>(i)];
    error = std::nan("");
    if (names[i] == "reference.dip_rad") {
      error = *calibration.reference.dip_rad - soak.unit.dip_rad;
    }
    const auto name = ParameterName::Parse(names[i]);
    if (!name) continue;
    const auto value = [&](const TriadModel<double>& model,
                           const std::optional<ThermalTerms>& thermal) {
      const auto term = static_cast<std::size_t>(name->power) - 1;
      switch (name->kind) {
        case ParameterKind::kBias:
          return (name->power > 0 ? thermal->bias[term] : model.bias)[name->row];
        case ParameterKind::kSensitivity:
          return (name->power > 0 ? thermal->sensitivity[term] : model.sensitivity)(name->row,
                                                                                    name->col);
        case ParameterKind::kRateLinear:
          return (*thermal->rate_linear)[name->row];
        case ParameterKind::kRateQuadratic:
          return (*thermal->rate_quadratic)[name->row];
        default:
          return (*thermal->rate_cross)[name->row];
      }
    };
    const TriadCalibration& sensor = *calibration.sensors[name->triad];
    error = value(sensor.model, sensor.thermal) -
            value(*soak.unit.models[name->triad], soak.thermal[name->triad]);
  }
  return errors;
}

// Every error within this share of its σ. Readings of size 100 are rounded to 1e-14, 3e-12 of the
// stated noise; conditioning, and an optimum that is flat to the square root of rounding, cost some
// digits more.
void ExpectExact(const Soak& soak, const PoseSet& poses) {
  const auto summary = Calibrate(poses, soak.options);
  ASSERT_TRUE(summary) << summary.error().message;
  const Calibration& calibration = summary->calibration;
  ASSERT_TRUE(calibration.IsUsable()) << calibration.messages.back();
  const Eigen::VectorXd errors = Errors(calibration, soak);
  for (Eigen::Index i = 0; i < errors.size(); ++i) {
    if (std::isnan(errors[i])) continue;
    const double sigma = std::sqrt(calibration.covariance.matrix(i, i));
    EXPECT_LE(std::abs(errors[i]), 1e-5 * sigma + 1e-13)
        << calibration.covariance.parameters[static_cast<std::size_t>(i)];
  }
}

ThermalOptions CubicAndLinear() {
  ThermalOptions terms;
  terms.bias_order = 3;
  terms.matrix_order = 1;
  return terms;
}

TEST(CalibrateSoak, RecoversTruthExactlyWithoutNoise) {
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    Random random(seed);
    const Soak soak = MakeSoak(CubicAndLinear(), 12, true, &random);
    ExpectExact(soak, ExactPoses(soak));
  }
}

TEST(CalibrateSoak, RecoversAnAccelerometerAloneExactlyWithoutNoise) {
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    Random random(seed);
    const Soak soak = MakeSoak(CubicAndLinear(), 12, false, &random);
    ExpectExact(soak, ExactPoses(soak));
  }
}

TEST(CalibrateSoak, RecoversFullMatrixTermsOnAFixture) {
  Random random(3);
  Soak soak = MakeSoak(CubicAndLinear(), 12, true, &random);
  // Nothing is left to a gauge.
  soak.thermal[Triad::kAccelerometer]->sensitivity[0] = 2e-4 * RandomMatrix(&random);
  PoseSet poses = ExactPoses(soak);
  OnFixture(&soak, &poses);
  ExpectExact(soak, poses);
}

TEST(CalibrateSoak, RecoversRateTerms) {
  Random random(4);
  ThermalOptions terms = CubicAndLinear();
  terms.rate_linear = terms.rate_quadratic = terms.rate_cross = true;
  const Soak soak = MakeSoak(terms, 12, true, &random);
  ExpectExact(soak, ExactPoses(soak));
}

TEST(CalibrateSoak, RefusesAPoseWithoutTemperature) {
  Random random(5);
  const Soak soak = MakeSoak(CubicAndLinear(), 6, true, &random);
  PoseSet poses = ExactPoses(soak);
  poses.poses[7].temperature_degc.reset();
  const auto summary = Calibrate(poses, soak.options);
  ASSERT_FALSE(summary);
  EXPECT_EQ(summary.error().code, ErrorCode::kBadInput);
  EXPECT_THAT(summary.error().message, HasSubstr("pose 8 has no temperature"));
}

TEST(CalibrateSoak, NamesTheTermsThatTooFewTemperaturesLeaveOpen) {
  Random random(6);
  Soak soak = MakeSoak(CubicAndLinear(), 12, true, &random);
  for (double& temperature : soak.temperatures_degc) {
    if (temperature < 0.0) temperature = 0.0;
    if (temperature > 50.0) temperature = 45.0;
  }
  const auto summary = Calibrate(ExactPoses(soak), soak.options);
  ASSERT_TRUE(summary) << summary.error().message;
  EXPECT_EQ(summary->calibration.outcome, Outcome::kNotObservable);
  ASSERT_FALSE(summary->calibration.quality.weak_directions.empty());
  for (const WeakDirection& weak : summary->calibration.quality.weak_directions) {
    EXPECT_THAT(weak.description, AllOf(HasSubstr(" bias "), HasSubstr("tau^3")));
    EXPECT_THAT(weak.advice, HasSubstr("more temperatures (3 were seen)"));
  }
}

TEST(CalibrateSoak, StatesItsRangeAndKeepsToItWhenEvaluated) {
  Random random(7);
  const Soak soak = MakeSoak(CubicAndLinear(), 12, true, &random);
  PoseSet poses = ExactPoses(soak);
  const auto summary = Calibrate(poses, soak.options);
  ASSERT_TRUE(summary && summary->calibration.IsUsable());
  const auto& thermal = summary->calibration.sensors[Triad::kMagnetometer]->thermal;
  ASSERT_TRUE(thermal);
  EXPECT_EQ(thermal->reference_degc, kReferenceDegc);
  EXPECT_EQ(thermal->range_degc, Eigen::Vector2d(kSoakDegc.front(), kSoakDegc.back()));
  const auto seen = Evaluate(summary->calibration, poses);
  ASSERT_TRUE(seen) << seen.error().message;
  EXPECT_LT(*seen->norm_rms[Triad::kMagnetometer], 1e-6);
  // Those at the upper end say that they were warmer still: the same, being held at the end.
  for (StaticPose& pose : poses.poses) {
    if (*pose.temperature_degc == kSoakDegc.back()) *pose.temperature_degc += 30.0;
  }
  const auto beyond = Evaluate(summary->calibration, poses);
  ASSERT_TRUE(beyond) << beyond.error().message;
  EXPECT_EQ(*beyond->norm_rms[Triad::kMagnetometer], *seen->norm_rms[Triad::kMagnetometer]);
  poses.poses[2].temperature_degc.reset();
  const auto refused = Evaluate(summary->calibration, poses);
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("pose 3 has no temperature"));
}

TEST(CalibrateSoak, ComparesItsTermsToo) {
  Random random(8);
  const Soak soak = MakeSoak(CubicAndLinear(), 12, true, &random);
  const auto one =
      Calibrate(PosesOf(soak, trials::ModelNoise(), trials::ModelNoise(), &random), soak.options);
  const auto other =
      Calibrate(PosesOf(soak, trials::ModelNoise(), trials::ModelNoise(), &random), soak.options);
  ASSERT_TRUE(one && other);
  const auto comparison = Compare(one->calibration, other->calibration);
  ASSERT_TRUE(comparison) << comparison.error().message;
  // 24 static parameters less the gauge, and the dip; 15 and 18 temperature terms.
  EXPECT_EQ(comparison->dof, 22 + 33);
  EXPECT_GT(comparison->p_value, 1e-3);  // one seed: it agrees or the terms are mixed up
  EXPECT_THAT(comparison->entries.back().parameter, HasSubstr("dip"));
}

// Chebyshev polynomials of a scaled variable, and what they are in tau, are the same function.
TEST(ThermalBlock, TermsInTauAreTheScaledOnes) {
  Random random(9);
  ThermalOptions terms;
  terms.bias_order = 7;
  terms.matrix_order = 3;
  terms.rate_linear = terms.rate_quadratic = terms.rate_cross = true;
  const ThermalBlock block{0, terms};
  const ThermalScale scale{25.0, 10.0, 40.0, 0.02};
  Eigen::VectorXd shared(block.size());
  for (double& value : shared) value = random.Normal();
  const ThermalTerms in_tau = block.TermsInTau(scale, shared.data());
  for (const double temperature : {-30.0, 0.0, 25.0, 50.0}) {
    TriadModel<double> scaled;
    block.AddTerms(scale.FactorsAt(temperature, 0.013), shared.data(), &scaled);
    const TriadModel<double> model =
        ModelAtTemperature(TriadModel<double>(), in_tau, temperature, 0.013);
    // Coefficients of T_7 reach 64, and powers cancel by as much: some 1e3 roundings.
    EXPECT_LT((scaled.bias - model.bias).norm(), 1e-11);
    EXPECT_LT((scaled.sensitivity - model.sensitivity).norm(), 1e-11);
  }
}

TEST(ParameterName, ReadsBackWhatItWrites) {
  const std::vector<ParameterName> names = {
      {Triad::kAccelerometer, ParameterKind::kBias, 0, 2, 0},
      {Triad::kMagnetometer, ParameterKind::kSensitivity, 0, 1, 2},
      {Triad::kMagnetometer, ParameterKind::kBias, 7, 0, 0},
      {Triad::kAccelerometer, ParameterKind::kSensitivity, 3, 2, 1},
      {Triad::kGyroscope, ParameterKind::kRateQuadratic, 0, 1, 0},
  };
  for (const ParameterName& name : names) {
    const auto back = ParameterName::Parse(name.str());
    ASSERT_TRUE(back) << name.str();
    EXPECT_EQ(back->str(), name.str());
    EXPECT_EQ(back->power, name.power);
  }
  for (const char* text : {"reference.dip_rad",
                           "accelerometer",
                           "accelerometer.bias.w",
                           "",
                           ".",
                           "accelerometer.thermal.rate.3.x",
                           "accelerometer.thermal..x"}) {
    EXPECT_FALSE(ParameterName::Parse(text)) << text;
  }
}

}  // namespace
}  // namespace truetriad
