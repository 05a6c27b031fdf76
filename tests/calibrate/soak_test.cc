// SPDX-License-Identifier: Apache-2.0
//
// Temperature terms chosen from poses at several temperatures, and what the poses of each say.

#include "verdict/checks/soak.h"

#include <cmath>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "support/finding_matchers.h"
#include "support/soak_trials.h"
#include "truetriad/calibrate/calibrate.h"
#include "truetriad/verdict/summary.h"

namespace truetriad {
namespace soak_test {

using ::testing::Contains;
using ::testing::HasSubstr;
using trials::MakeSoak;
using trials::ModelNoise;
using trials::PosesOf;
using trials::Soak;

constexpr Triad kAccel = Triad::kAccelerometer;
constexpr Triad kMag = Triad::kMagnetometer;

ThermalOptions Terms(int bias_order, int matrix_order) {
  ThermalOptions terms;
  terms.bias_order = bias_order;
  terms.matrix_order = matrix_order;
  return terms;
}

// All terms are left open.
ThermalOptions OpenTerms() {
  ThermalOptions terms = Terms(ThermalOptions::kMaxBiasOrder, ThermalOptions::kMaxMatrixOrder);
  terms.bias_order_auto = terms.matrix_order_auto = terms.matrix_auto = true;
  return terms;
}

PoseSet NoisyPoses(const Soak& soak, Random* random) {
  return PosesOf(soak, ModelNoise(), ModelNoise(), random);
}

CalibrationSummary Choose(Soak soak, const ThermalOptions& terms, Random* random) {
  soak.options.cross_validation_folds = 5;
  for (const Triad triad : trials::kStaticTriads) soak.options.triads[triad].thermal = terms;
  const auto summary = Calibrate(NoisyPoses(soak, random), soak.options);
  EXPECT_TRUE(summary) << summary.error().message;
  EXPECT_TRUE(summary->calibration.IsUsable()) << summary->calibration.findings.back().Message();
  return *summary;
}

const ThermalOptions& Chosen(const CalibrationSummary& summary, Triad triad) {
  return summary.options.triads[triad].thermal;
}

TEST(SoakChoice, TakesTheOrdersThatAreThere) {
  for (const auto& [bias_order, matrix_order] : {std::pair(3, 1), std::pair(1, 0)}) {
    Random random(11);
    const Soak soak = MakeSoak(Terms(bias_order, matrix_order), 12, true, &random);
    const CalibrationSummary summary = Choose(soak, OpenTerms(), &random);
    for (const Triad triad : trials::kStaticTriads) {
      EXPECT_EQ(Chosen(summary, triad).bias_order, bias_order);
      EXPECT_EQ(Chosen(summary, triad).matrix_order, matrix_order);
      if (matrix_order > 0) {
        EXPECT_EQ(Chosen(summary, triad).matrix, ThermalMatrix::kFull);
      }
    }
  }
}

TEST(SoakChoice, TakesNoTermsOfAUnitThatDoesNotDrift) {
  Random random(12);
  const Soak soak = MakeSoak(ThermalOptions(), 12, true, &random);
  const CalibrationSummary summary = Choose(soak, OpenTerms(), &random);
  for (const Triad triad : trials::kStaticTriads) {
    EXPECT_FALSE(Chosen(summary, triad).any());
    EXPECT_FALSE(summary.calibration.sensors[triad]->thermal);
  }
}

TEST(SoakChoice, TakesTheLeastShapeOfTheMatrixThatExplainsIt) {
  for (const ThermalMatrix shape : {ThermalMatrix::kDiagonal, ThermalMatrix::kScale}) {
    Random random(13);
    Soak soak = MakeSoak(Terms(1, 1), 12, true, &random);
    for (const Triad triad : trials::kStaticTriads) {
      // One entry per axis, on the diagonal; 2 % at the ends of the range.
      const Eigen::Matrix3d& S = soak.unit.models[triad]->sensitivity;
      const Eigen::Vector3d gains = shape == ThermalMatrix::kScale
                                        ? Eigen::Vector3d(5e-4 * S.rowwise().norm())
                                        : Eigen::Vector3d(5e-4, -3e-4, 4e-4);
      soak.thermal[triad]->sensitivity.front() = gains.asDiagonal();
    }
    const CalibrationSummary summary = Choose(soak, OpenTerms(), &random);
    for (const Triad triad : trials::kStaticTriads) {
      EXPECT_EQ(Chosen(summary, triad).matrix_order, 1);
      EXPECT_EQ(Chosen(summary, triad).matrix, shape) << TriadName(triad);
    }
  }
}

TEST(SoakChoice, TakesTheRateTermsThatAreThere) {
  ThermalOptions terms = Terms(1, 0);
  terms.rate[RateTerm::kLinear] = true;
  Random random(14);
  const Soak soak = MakeSoak(terms, 12, true, &random);
  ThermalOptions open = Terms(1, 0);
  open.rate_auto = true;
  open.rate = PerRateTerm<bool>::All(true);
  const CalibrationSummary summary = Choose(soak, open, &random);
  for (const Triad triad : trials::kStaticTriads) {
    EXPECT_TRUE(Chosen(summary, triad).rate[RateTerm::kLinear]);
    EXPECT_FALSE(Chosen(summary, triad).rate[RateTerm::kQuadratic] ||
                 Chosen(summary, triad).rate[RateTerm::kCross]);
  }
}

TEST(SoakChoice, ShowsWhatItWeighed) {
  Random random(11);
  const Soak soak = MakeSoak(Terms(3, 1), 12, false, &random);
  const CalibrationSummary summary = Choose(soak, OpenTerms(), &random);
  const std::vector<ModelAlternative>& models = summary.calibration.quality.rests.model_choice;
  ASSERT_FALSE(models.empty());
  EXPECT_EQ(models.front().description,
            "accelerometer full, bias of order 3 in tau, matrix of order 1 in tau, matrix full in "
            "tau");
  std::vector<std::string> others;
  for (const ModelAlternative& model : models) {
    if (model.chosen) continue;
    others.push_back(model.description);
    EXPECT_EQ(*model.p_value < 0.01, model.parameters < models.front().parameters)
        << model.description;
  }
  EXPECT_THAT(others,
              ::testing::UnorderedElementsAre("accelerometer bias of order 2 in tau",
                                              "accelerometer matrix of order 0 in tau",
                                              "accelerometer matrix of order 2 in tau",
                                              "accelerometer matrix diagonal in tau"));
}

// Of five temperatures a cubic is judged by each in turn.
TEST(SoakChoice, StaysBelowTheNumberOfTemperatures) {
  Random random(15);
  Soak soak = MakeSoak(Terms(1, 0), 12, false, &random);
  for (double& degc : soak.temperatures_degc) degc = degc < 30.0 ? 10.0 : 50.0;
  const CalibrationSummary two = Choose(soak, OpenTerms(), &random);
  EXPECT_EQ(Chosen(two, kAccel).bias_order, 1);
  for (const ModelAlternative& model : two.calibration.quality.rests.model_choice) {
    EXPECT_THAT(model.description, ::testing::Not(HasSubstr("order 2")));
  }
  soak.temperatures_degc.assign(soak.temperatures_degc.size(), 25.0);
  const CalibrationSummary one = Choose(soak, OpenTerms(), &random);
  EXPECT_FALSE(Chosen(one, kAccel).any());
  const Finding* same = Find(one.calibration.findings, FindingCode::kOneTemperature);
  ASSERT_NE(same, nullptr);
  EXPECT_NEAR(*same->Value("temperature"), 25.0, 0.1);
}

TEST(SoakChoice, NamesWhatItCouldNotWeigh) {
  Random random(16);
  // Each pose has one degree of freedom: 25 poses with 9 + 3 * 4 + 6 * 3 parameters do not leave
  // ten.
  const Soak soak = MakeSoak(Terms(1, 0), 5, false, &random);
  const CalibrationSummary summary = Choose(soak, OpenTerms(), &random);
  EXPECT_THAT(summary.calibration.findings,
              Contains(::testing::AllOf(HasCode(FindingCode::kTermsNotWeighed),
                                        Says(HasSubstr("matrix of order 1")))));
}

TEST(SoakChoice, NeedsATemperatureOfEveryPose) {
  Random random(17);
  Soak soak = MakeSoak(Terms(1, 0), 12, false, &random);
  soak.options.triads[kAccel].thermal = OpenTerms();
  PoseSet poses = NoisyPoses(soak, &random);
  for (StaticPose& pose : poses.poses) pose.temperature_degc.reset();
  const auto summary = Calibrate(poses, soak.options);
  ASSERT_FALSE(summary);
  EXPECT_THAT(summary.error().message, HasSubstr("has no temperature"));
}

TEST(TemperatureSettings, ShowTheBiasAtEachTemperature) {
  Random random(18);
  const Soak soak = MakeSoak(Terms(3, 1), 12, true, &random);
  const auto summary = Calibrate(trials::ExactSoakPoses(soak), soak.options);
  ASSERT_TRUE(summary && summary->calibration.IsUsable());
  const auto& settings = summary->calibration.quality.rests.temperature_settings;
  ASSERT_EQ(settings.size(), 2 * trials::kSoakDegc.size());
  for (std::size_t i = 0; i < settings.size(); ++i) {
    const TemperatureSetting& setting = settings[i];
    EXPECT_EQ(setting.triad, i < trials::kSoakDegc.size() ? kAccel : kMag);
    EXPECT_EQ(setting.degc, trials::kSoakDegc[i % trials::kSoakDegc.size()]);
    EXPECT_EQ(setting.poses, 12);
    const Eigen::Vector3d truth =
        ModelAtTemperature(
            *soak.unit.models[setting.triad], *soak.thermal[setting.triad], setting.degc, 0.0)
            .bias;
    const Eigen::Vector3d errors = (setting.bias_raw - truth).cwiseQuotient(setting.bias_sigma_raw);
    EXPECT_LE(errors.cwiseAbs().maxCoeff(), 1e-5);
    // Readings of size 100 are rounded to 1e-14.
    EXPECT_LE(setting.rms_after, 1e-10);
    if (setting.degc != trials::kReferenceDegc) {
      EXPECT_GE(setting.rms_before, 1e-3);
    }
  }
}

// If the terms are those of the unit, the poses of one temperature scatter about them by no more
// than their noise; if the order is too low, by more.
TEST(TemperatureSettings, ShowAnOrderThatIsTooLow) {
  Random random(19);
  Soak soak = MakeSoak(Terms(3, 0), 12, false, &random);
  const PoseSet poses = NoisyPoses(soak, &random);
  for (const int order : {3, 2}) {
    soak.options.triads[kAccel].thermal.bias_order = order;
    soak.options.robust.enabled = false;  // which would call the misfit disturbed poses
    const auto summary = Calibrate(poses, soak.options);
    ASSERT_TRUE(summary && summary->calibration.IsUsable())
        << summary->calibration.findings.back().Message();
    const auto& settings = summary->calibration.quality.rests.temperature_settings;
    double largest = 0.0;
    for (const TemperatureSetting& setting : settings) {
      const TriadCalibration& sensor = *summary->calibration.sensors[setting.triad];
      const Eigen::Vector3d fit =
          ModelAtTemperature(sensor.model, *sensor.thermal, setting.degc, 0.0).bias;
      largest = std::max(
          largest,
          (setting.bias_raw - fit).cwiseQuotient(setting.bias_sigma_raw).cwiseAbs().maxCoeff());
    }
    // Fifteen numbers: by chance one is as large in less than one of ten thousand runs.
    if (order == 3) {
      EXPECT_LE(largest, 4.6);
    } else {
      EXPECT_GE(largest, 4.6);
    }
  }
}

TEST(PosesAmong, KeepsTheMovesBetweenNeighbours) {
  PoseSet poses;
  poses.poses.resize(6);
  for (std::size_t from : {0, 1, 2, 3, 4}) {
    RecordedMove move;
    move.from = from;
    move.fault = Finding(FindingCode::kTurnGap, std::to_string(from));
    poses.moves.push_back(move);
  }
  for (std::size_t k = 0; k < 6; ++k) poses.poses[k].number = static_cast<int>(k);
  const PoseSet chosen = PosesAmong(poses, {1, 3, 4, 5});
  ASSERT_EQ(chosen.poses.size(), 4U);
  EXPECT_EQ(chosen.poses[1].number, 3);
  ASSERT_EQ(chosen.moves.size(), 2U);
  EXPECT_EQ(chosen.moves[0].from, 1U);
  EXPECT_EQ(chosen.moves[0].fault->text, "3");
  EXPECT_EQ(chosen.moves[1].from, 2U);
}

TEST(PosesByTemperature, JoinsThoseOfOneSetting) {
  PoseSet poses;
  for (const double degc : {25.1, -20.0, 70.2, 24.9, -19.6, 69.9, 25.0}) {
    poses.poses.emplace_back().temperature_degc = degc;
  }
  poses.poses.emplace_back();
  EXPECT_THAT(PosesByTemperature(poses),
              ::testing::ElementsAre(::testing::ElementsAre(1, 4),
                                     ::testing::ElementsAre(0, 3, 6),
                                     ::testing::ElementsAre(2, 5)));
}

}  // namespace soak_test
}  // namespace truetriad
