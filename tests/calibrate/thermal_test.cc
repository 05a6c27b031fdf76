// SPDX-License-Identifier: Apache-2.0
//
// Temperature terms in the static estimator: exact recovery, Jacobians, names, statistics of
// errors.

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "problem/parameter_name.h"
#include "problem/thermal_block.h"
#include "support/soak_trials.h"
#include "truetriad/calibrate/calibrate.h"
#include "truetriad/calibrate/evaluate.h"
#include "truetriad/model/calibration.h"
#include "verdict/reference_temperature.h"

namespace truetriad {
namespace thermal_test {

using ::testing::AllOf;
using ::testing::HasSubstr;
using trials::ExactSoakPoses;
using trials::kReferenceDegc;
using trials::kSoakDegc;
using trials::MakeSoak;
using trials::PosesOf;
using trials::RandomMatrix;
using trials::Soak;
using trials::SoakErrors;

// Attitudes are stated by a fixture whose heading in the field is unknown.
void OnFixture(Soak* soak, PoseSet* poses) {
  soak->options.attitudes.kind = AttitudeKind::kGiven;
  soak->options.gauge = Gauge::kFixture;
  const Eigen::Quaterniond fixture_from_world(Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitZ()));
  for (std::size_t k = 0; k < poses->poses.size(); ++k) {
    poses->poses[k].attitude =
        AttitudeReference{fixture_from_world * soak->attitudes[k], Eigen::Vector3d::Zero()};
  }
}

// Every error within this share of its σ. Readings of size 100 are rounded to 1e-14, 3e-12 of the
// stated noise; conditioning, and an optimum that is flat to the square root of rounding, cost some
// digits more.
void ExpectExact(const Soak& soak, const PoseSet& poses) {
  const auto summary = Calibrate(poses, soak.options);
  ASSERT_TRUE(summary) << summary.error().message;
  const Calibration& calibration = summary->calibration;
  ASSERT_TRUE(calibration.IsUsable()) << calibration.findings.back().Message();
  const Eigen::VectorXd errors = SoakErrors(calibration, soak);
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
    ExpectExact(soak, ExactSoakPoses(soak));
  }
}

TEST(CalibrateSoak, RecoversAnAccelerometerAloneExactlyWithoutNoise) {
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    Random random(seed);
    const Soak soak = MakeSoak(CubicAndLinear(), 12, false, &random);
    ExpectExact(soak, ExactSoakPoses(soak));
  }
}

TEST(CalibrateSoak, RecoversFullMatrixTermsOnAFixture) {
  Random random(3);
  Soak soak = MakeSoak(CubicAndLinear(), 12, true, &random);
  // In known attitudes no entry is left to a gauge.
  soak.thermal[Triad::kAccelerometer]->sensitivity[0] = 2e-4 * RandomMatrix(&random);
  PoseSet poses = ExactSoakPoses(soak);
  OnFixture(&soak, &poses);
  ExpectExact(soak, poses);
}

// A matrix that follows the temperature although no term was asked for: seen, and allowed for.
TEST(CalibrateSoak, SaysThatTheMatrixFollowsTheTemperatureBeyondTheTerms) {
  Random random(5);
  ThermalOptions terms = CubicAndLinear();
  for (const int order : {1, 0}) {
    Soak soak = MakeSoak(terms, 12, false, &random);
    soak.options.triads[Triad::kAccelerometer].thermal.matrix_order = order;
    soak.options.triads[Triad::kAccelerometer].excess = ExcessNoise::kEstimate;
    soak.thermal[Triad::kAccelerometer]->sensitivity[0] *= 0.3;
    const auto summary =
        Calibrate(PosesOf(soak, trials::ModelNoise(), trials::ModelNoise(), &random), soak.options);
    ASSERT_TRUE(summary) << summary.error().message;
    const Calibration& calibration = summary->calibration;
    const bool is_said =
        std::any_of(calibration.findings.begin(), calibration.findings.end(), [](const Finding& f) {
          return f.code == FindingCode::kFault &&
                 f.text.find("matrix with temperature") != std::string::npos;
        });
    EXPECT_EQ(is_said, order == 0);
    ASSERT_TRUE(calibration.IsUsable());
    if (order == 1) continue;
    const Eigen::Matrix3d error = calibration.sensors[Triad::kAccelerometer]->model.sensitivity -
                                  soak.unit.models[Triad::kAccelerometer]->sensitivity;
    for (int axis = 0; axis < 3; ++axis) {
      const std::string name =
          std::string("accelerometer.sensitivity.") + "xyz"[axis] + "xyz"[axis];
      EXPECT_LT(std::abs(error(axis, axis)), 5.0 * calibration.covariance.Sigma(name)) << name;
    }
  }
}

TEST(CalibrateSoak, RecoversRateTerms) {
  Random random(4);
  ThermalOptions terms = CubicAndLinear();
  terms.rate = PerRateTerm<bool>::All(true);
  const Soak soak = MakeSoak(terms, 12, true, &random);
  ExpectExact(soak, ExactSoakPoses(soak));
}

// Over the range the bias moves by more than a third of the signal, so that the readings of all
// poses lie on no ellipsoid.
TEST(CalibrateSoak, FindsItsStartThoughTheUnitDriftsMuch) {
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    Random random(seed);
    Soak soak = MakeSoak(CubicAndLinear(), 12, true, &random);
    for (std::optional<ThermalTerms>& thermal : soak.thermal) {
      if (!thermal) continue;
      for (Eigen::Vector3d& term : thermal->bias) term *= 15.0;
    }
    ExpectExact(soak, ExactSoakPoses(soak));
  }
}

TEST(CalibrateSoak, EstimatesGainsAloneWhereThatIsWanted) {
  Random random(10);
  ThermalOptions terms = CubicAndLinear();
  terms.matrix = ThermalMatrix::kDiagonal;
  Soak soak = MakeSoak(terms, 12, true, &random);
  for (const Triad triad : trials::kStaticTriads) {
    Eigen::Matrix3d& term = soak.thermal[triad]->sensitivity[0];
    term = Eigen::Matrix3d(term.diagonal().asDiagonal());
  }
  ExpectExact(soak, ExactSoakPoses(soak));
  for (const Triad triad : trials::kStaticTriads) {
    const Eigen::Vector3d gains = soak.unit.models[triad]->sensitivity.rowwise().norm();
    soak.thermal[triad]->sensitivity[0] = Eigen::Matrix3d((2e-4 * gains).asDiagonal());
    soak.options.triads[triad].thermal.matrix = ThermalMatrix::kScale;
  }
  const auto summary = Calibrate(ExactSoakPoses(soak), soak.options);
  ASSERT_TRUE(summary) << summary.error().message;
  const auto& sensor = summary->calibration.sensors[Triad::kMagnetometer];
  ASSERT_TRUE(sensor && sensor->thermal);
  // One share for all gains, which the start knows to a few per cent.
  const Eigen::Matrix3d& term = sensor->thermal->sensitivity[0];
  const Eigen::Vector3d shares =
      term.diagonal().cwiseQuotient(sensor->model.sensitivity.diagonal());
  for (const double share : shares) EXPECT_NEAR(share, 2e-4, 1e-5);
  EXPECT_TRUE((term - Eigen::Matrix3d(term.diagonal().asDiagonal())).isZero(0.0));
}

TEST(CalibrateSoak, RefusesAPoseWithoutTemperature) {
  Random random(5);
  const Soak soak = MakeSoak(CubicAndLinear(), 6, true, &random);
  PoseSet poses = ExactSoakPoses(soak);
  poses.poses[7].temperature_degc.reset();
  const auto summary = Calibrate(poses, soak.options);
  ASSERT_FALSE(summary);
  EXPECT_EQ(summary.error().kind(), ErrorKind::kBadInput);
  EXPECT_THAT(summary.error().message, HasSubstr("pose 8 has no temperature"));
}

TEST(CalibrateSoak, NamesTheTermsThatTooFewTemperaturesLeaveOpen) {
  Random random(6);
  Soak soak = MakeSoak(CubicAndLinear(), 12, true, &random);
  for (double& temperature : soak.temperatures_degc) {
    if (temperature < 0.0) temperature = 0.0;
    if (temperature > 50.0) temperature = 45.0;
  }
  const auto summary = Calibrate(ExactSoakPoses(soak), soak.options);
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
  PoseSet poses = ExactSoakPoses(soak);
  const auto summary = Calibrate(poses, soak.options);
  ASSERT_TRUE(summary && summary->calibration.IsUsable());
  const auto& thermal = summary->calibration.sensors[Triad::kMagnetometer]->thermal;
  ASSERT_TRUE(thermal);
  EXPECT_EQ(thermal->reference_degc, kReferenceDegc);
  EXPECT_EQ(thermal->range_degc, Eigen::Vector2d(kSoakDegc.front(), kSoakDegc.back()));
  const auto seen = Evaluate(summary->calibration, poses);
  ASSERT_TRUE(seen) << seen.error().message;
  EXPECT_LT(*seen->norm_rms[Triad::kMagnetometer], 1e-6);
  // Poses at the upper end, stated as warmer still: the temperature is held at the end.
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
  // 24 static parameters less the gauge; 15 and 18 temperature terms.
  EXPECT_EQ(comparison->dof, 21 + 33);
  EXPECT_GT(comparison->p_value, 1e-3);  // one seed: it agrees or the terms are mixed up
  EXPECT_THAT(comparison->entries.back().parameter, HasSubstr("thermal"));
}

TEST(CalibrateSoak, SaysWhatAStaticCalibrationDoesNotHold) {
  Random random(12);
  const Soak soak = MakeSoak(CubicAndLinear(), 12, false, &random);
  const PoseSet poses = PosesOf(soak, trials::ModelNoise(), trials::ModelNoise(), &random);
  const auto with = Calibrate(poses, soak.options);
  ASSERT_TRUE(with && with->calibration.IsUsable());
  Calibration without = with->calibration;
  NamedCovariance& covariance = without.covariance;
  Eigen::Index kept = 0;
  while (covariance.parameters[static_cast<std::size_t>(kept)].find(".thermal.") ==
         std::string::npos) {
    ++kept;
  }
  covariance.parameters.resize(static_cast<std::size_t>(kept));
  covariance.matrix = covariance.matrix.topLeftCorner(kept, kept).eval();
  without.sensors[Triad::kAccelerometer]->thermal.reset();
  const auto comparison = Compare(with->calibration, without);
  ASSERT_TRUE(comparison) << comparison.error().message;
  EXPECT_THAT(comparison->not_compared,
              ::testing::Contains("accelerometer.thermal.bias.1 (only in a)"));
}

TEST(CalibrateSoak, RemarksOnTemperaturesThatSpoilItsTerms) {
  Random random(13);
  Soak soak = MakeSoak(CubicAndLinear(), 12, false, &random);
  PoseSet poses = PosesOf(soak, trials::ModelNoise(), trials::ModelNoise(), &random);
  poses.poses[4].start_ns = 0;
  poses.poses[4].end_ns = 800'000'000'000;
  poses.poses[4].temperature_rate_degcps = 0.05;
  soak.options.reference.temperature_degc = -200.0;
  const auto summary = Calibrate(poses, soak.options);
  ASSERT_TRUE(summary) << summary.error().message;
  ASSERT_TRUE(summary->calibration.IsUsable()) << summary->calibration.findings.back().Message();
  const Findings& findings = summary->calibration.findings;
  const Finding* within = Find(findings, FindingCode::kTemperatureWithinPoses);
  ASSERT_NE(within, nullptr);
  EXPECT_EQ(within->pose, 5);
  EXPECT_EQ(within->Value("poses"), 1.0);
  EXPECT_NEAR(*within->Value("largest"), 40.0, 0.1);
  EXPECT_NE(Find(findings, FindingCode::kReferenceExtrapolated), nullptr);
}

// Chebyshev polynomials of a scaled variable, and what they are in tau, are the same function.
TEST(ThermalBlock, TermsInTauAreTheScaledOnes) {
  Random random(9);
  ThermalOptions terms;
  terms.bias_order = 7;
  terms.matrix_order = 3;
  terms.rate = PerRateTerm<bool>::All(true);
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

// The same unit about another temperature: what it says there, and how well that is known.
TEST(StateAbout, SaysTheSameOfEveryTemperature) {
  Random random(31);
  const Soak soak = MakeSoak(CubicAndLinear(), 12, true, &random);
  const auto summary =
      Calibrate(PosesOf(soak, trials::ModelNoise(), trials::ModelNoise(), &random), soak.options);
  ASSERT_TRUE(summary && summary->calibration.IsUsable());
  const Calibration& about_25 = summary->calibration;
  Calibration about_40 = about_25;
  ASSERT_TRUE(StateAbout(40.0, &about_40));
  EXPECT_EQ(about_40.reference.temperature_degc, 40.0);
  for (const Triad triad : trials::kStaticTriads) {
    const TriadCalibration& a = *about_25.sensors[triad];
    const TriadCalibration& b = *about_40.sensors[triad];
    for (const double degc : {-20.0, 25.0, 40.0, 65.0}) {
      const TriadModel<double> at_a = ModelAtTemperature(a.model, *a.thermal, degc, 0.0);
      const TriadModel<double> at_b = ModelAtTemperature(b.model, *b.thermal, degc, 0.0);
      EXPECT_TRUE(at_a.bias.isApprox(at_b.bias, 1e-12));
      EXPECT_TRUE(at_a.sensitivity.isApprox(at_b.sensitivity, 1e-12));
    }
    // The variance of the bias at 40 degC by the terms about 25.
    const std::string name(TriadName(triad));
    const auto place = [&](const std::string& term) {
      const auto& names = about_25.covariance.parameters;
      return std::find(names.begin(), names.end(), name + term) - names.begin();
    };
    Eigen::VectorXd weights = Eigen::VectorXd::Zero(about_25.covariance.matrix.rows());
    weights[place(".bias.x")] = 1.0;
    for (int i = 1; i <= 3; ++i) {
      weights[place(".thermal.bias." + std::to_string(i) + ".x")] = std::pow(15.0, i);
    }
    EXPECT_NEAR(b.bias_sigma[0],
                std::sqrt(weights.dot(about_25.covariance.matrix * weights)),
                1e-9 * b.bias_sigma[0]);
  }
  // Stating it about 25 degC again gives the covariance back.
  ASSERT_TRUE(StateAbout(25.0, &about_40));
  EXPECT_TRUE(about_40.covariance.matrix.isApprox(about_25.covariance.matrix, 1e-9));
}

}  // namespace thermal_test
}  // namespace truetriad
