// SPDX-License-Identifier: Apache-2.0
//
// A temperature sweep as a user would calibrate it: simulate, calibrate, apply, evaluate.

#include <cmath>
#include <sstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cli/command_line_run.h"
#include "truetriad/io/calibration_file.h"
#include "truetriad/model/calibration.h"

namespace truetriad {
namespace sweep_test {

using ::testing::AllOf;
using ::testing::HasSubstr;

const std::string kConfigs = TRUETRIAD_SOURCE_DIR "/configs/";

class TemperatureSweep : public ::testing::Test {
 protected:
  TemperatureSweep() {
    const Finished run = RunTruetriad({"simulate",
                                       "--config=" + kConfigs + "scenarios/thermal-sweep.yaml",
                                       "--output=" + folder_.Path("sweep")});
    EXPECT_EQ(run.exit_code, 0) << run.err;
  }
  Finished Calibrate(const std::string& set, const std::string& output = "found") {
    return RunTruetriad({"calibrate",
                         "--config=" + kConfigs + "experiments/thermal-sweep.yaml",
                         "--input=" + folder_.Path("sweep/recording.yaml"),
                         "--output=" + folder_.Path(output),
                         "--set=" + set});
  }
  TemporaryFolder folder_;
};

TEST_F(TemperatureSweep, IsCalibratedAppliedAndEvaluated) {
  const Finished run = Calibrate("gauge=accel-x");
  ASSERT_EQ(run.exit_code, 0) << run.out << run.err;
  EXPECT_THAT(run.out,
              AllOf(HasSubstr("Temperature sweep"),
                    HasSubstr("held out, cubic"),
                    HasSubstr("bias by temperature and its rate"),
                    HasSubstr("Choice of terms"),
                    HasSubstr("`static: FILE.yaml`")));
  EXPECT_THAT(TemporaryFolder::Read(folder_.Path("found/report.html")),
              AllOf(HasSubstr("bias and fit"), HasSubstr("bias over temperature and rate")));
  const Result<Calibration> found = ReadCalibration(folder_.Path("found/calibration.yaml"));
  ASSERT_TRUE(found) << found.error().message;
  for (const SweepAxis& axis : found->quality.sweep.axes) {
    // Nothing but noise is left.
    EXPECT_LE(axis.rms_after, 1.1 * axis.noise_sigma);
    EXPECT_LE(axis.held_out, 1.2 * axis.noise_sigma);
    EXPECT_GT(axis.rms_before, 10.0 * axis.rms_after);
  }
  const Finished apply = RunTruetriad({"apply",
                                       "--calibration=" + folder_.Path("found/calibration.yaml"),
                                       "--input=" + folder_.Path("sweep/recording.yaml"),
                                       "--output=" + folder_.Path("corrected.csv")});
  EXPECT_EQ(apply.exit_code, 0) << apply.err;
  const Finished evaluate = RunTruetriad({"evaluate",
                                          "--calibration=" + folder_.Path("found/calibration.yaml"),
                                          "--input=" + folder_.Path("sweep/recording.yaml"),
                                          "--poses=sweep"});
  EXPECT_EQ(evaluate.exit_code, 0) << evaluate.err;
  EXPECT_THAT(evaluate.out, HasSubstr("Gyroscope"));
  // The truth's rate is that of the element, the fit's that of the thermometer.
  const Finished compare = RunTruetriad({"compare",
                                         "--a=" + folder_.Path("found/calibration.yaml"),
                                         "--b=" + folder_.Path("sweep/truth.yaml")});
  EXPECT_EQ(compare.exit_code, 0) << compare.err;
  EXPECT_THAT(
      compare.out,
      AllOf(HasSubstr("AGREE"), HasSubstr("accelerometer.thermal.rate.linear.x (one relates to")));
  // A calibration is its own experiment.
  const Finished again = RunTruetriad({"calibrate",
                                       "--config=" + folder_.Path("found/calibration.yaml"),
                                       "--input=" + folder_.Path("sweep/recording.yaml"),
                                       "--output=" + folder_.Path("again"),
                                       "--report=false"});
  EXPECT_EQ(again.exit_code, 0) << again.err;
}

TEST_F(TemperatureSweep, TakesBiasAndSensitivityFromAStaticCalibration) {
  // What the unit really is, without its temperature terms.
  Result<Calibration> truth = ReadCalibration(folder_.Path("sweep/truth.yaml"));
  ASSERT_TRUE(truth) << truth.error().message;
  for (const Triad triad : kTriads) {
    if (truth->sensors[triad]) truth->sensors[triad]->thermal.reset();
  }
  ASSERT_TRUE(WriteFileAtomically(folder_.Path("static.yaml"), CalibrationToYaml(*truth)));
  const std::string stated = "static=" + folder_.Path("static.yaml");
  const Finished run = Calibrate(stated);
  ASSERT_EQ(run.exit_code, 0) << run.out << run.err;
  const Result<Calibration> found = ReadCalibration(folder_.Path("found/calibration.yaml"));
  ASSERT_TRUE(found) << found.error().message;
  const auto& sensor = *found->sensors[Triad::kAccelerometer];
  EXPECT_EQ(sensor.model.bias, truth->sensors[Triad::kAccelerometer]->model.bias);
  EXPECT_EQ(sensor.model.sensitivity, truth->sensors[Triad::kAccelerometer]->model.sensitivity);
  const Finished elsewhere = Calibrate(stated + ",reference.temperature_degc=20", "elsewhere");
  EXPECT_EQ(elsewhere.exit_code, 2);
  EXPECT_THAT(elsewhere.err, HasSubstr("was made at 25"));
}

TEST_F(TemperatureSweep, RefusesTheStaticCalibrationOfAnotherUnit) {
  Result<Calibration> other = ReadCalibration(folder_.Path("sweep/truth.yaml"));
  ASSERT_TRUE(other) << other.error().message;
  for (const Triad triad : kTriads) {
    if (other->sensors[triad]) other->sensors[triad]->thermal.reset();
  }
  // Under its own name, and then under this unit's: gravity comes out 3 % off.
  const std::string serial = other->serial;
  other->serial = "another";
  other->sensors[Triad::kAccelerometer]->model.sensitivity *= 1.03;
  ASSERT_TRUE(WriteFileAtomically(folder_.Path("static.yaml"), CalibrationToYaml(*other)));
  const Finished named = Calibrate("static=" + folder_.Path("static.yaml"));
  EXPECT_EQ(named.exit_code, 2);
  EXPECT_THAT(named.err, HasSubstr("is the calibration of another"));
  other->serial = serial;
  ASSERT_TRUE(WriteFileAtomically(folder_.Path("static.yaml"), CalibrationToYaml(*other)));
  const Finished unnamed = Calibrate("static=" + folder_.Path("static.yaml"));
  EXPECT_EQ(unnamed.exit_code, 3);
  EXPECT_THAT(unnamed.out, HasSubstr("is the calibration of another unit"));
}

// Gravity comes out 0.3 % off: ageing, or a thermometer that was changed. Which axis it is does not
// show.
TEST_F(TemperatureSweep, AllowsForAUnitThatHasChangedSinceItsStaticCalibration) {
  Result<Calibration> aged = ReadCalibration(folder_.Path("sweep/truth.yaml"));
  ASSERT_TRUE(aged) << aged.error().message;
  for (const Triad triad : kTriads) {
    if (aged->sensors[triad]) aged->sensors[triad]->thermal.reset();
  }
  TriadCalibration& sensor = *aged->sensors[Triad::kAccelerometer];
  sensor.model.sensitivity *= 1.003;
  sensor.bias_sigma.setConstant(1e-3);
  ASSERT_TRUE(WriteFileAtomically(folder_.Path("static.yaml"), CalibrationToYaml(*aged)));
  const Finished run = Calibrate("static=" + folder_.Path("static.yaml"));
  ASSERT_EQ(run.exit_code, 0) << run.out << run.err;
  const Result<Calibration> found = ReadCalibration(folder_.Path("found/calibration.yaml"));
  ASSERT_TRUE(found) << found.error().message;
  const Finding* missed = Find(found->findings, FindingCode::kGravityMissed);
  ASSERT_NE(missed, nullptr);
  EXPECT_EQ(missed->treatment, Treatment::kWidened);
  const double off = std::abs(*missed->Value("error"));
  EXPECT_NEAR(off, 0.003 * 9.81, 0.003);
  for (int axis = 0; axis < 3; ++axis) {
    const double sigma = found->sensors[Triad::kAccelerometer]->bias_sigma[axis];
    EXPECT_GT(sigma, off);
    EXPECT_LT(sigma, 1.1 * off);
    EXPECT_NEAR(std::sqrt(found->covariance.matrix(axis, axis)), sigma, 0.1 * sigma);
  }
}

// Its bias is that of 20 degC, whatever temperature it calls its reference.
TEST_F(TemperatureSweep, TakesAStaticCalibrationForTheTemperatureItWasRecordedAt) {
  Result<Calibration> known = ReadCalibration(folder_.Path("sweep/truth.yaml"));
  ASSERT_TRUE(known) << known.error().message;
  const TriadCalibration truth = *known->sensors[Triad::kAccelerometer];
  for (const Triad triad : kTriads) {
    if (!known->sensors[triad]) continue;
    TriadCalibration& sensor = *known->sensors[triad];
    sensor.model = ModelAtTemperature(sensor.model, *sensor.thermal, 20.0);
    sensor.thermal.reset();
  }
  known->reference.recorded_degc = Eigen::Vector3d(19.5, 20.0, 21.0);
  const auto with = [&](const std::string& more) {
    EXPECT_TRUE(WriteFileAtomically(folder_.Path("static.yaml"), CalibrationToYaml(*known)));
    return Calibrate("static=" + folder_.Path("static.yaml") + more);
  };
  const Finished run = with("");
  ASSERT_EQ(run.exit_code, 0) << run.out << run.err;
  EXPECT_THAT(run.out, HasSubstr("was recorded at 20.0 degC (19.5 to 21.0), not at its"));
  const Result<Calibration> found = ReadCalibration(folder_.Path("found/calibration.yaml"));
  ASSERT_TRUE(found) << found.error().message;
  // It is stated where the experiment says, with the bias of there.
  EXPECT_EQ(found->reference.temperature_degc, 25.0);
  const TriadCalibration& sensor = *found->sensors[Triad::kAccelerometer];
  EXPECT_EQ(sensor.thermal->reference_degc, 25.0);
  // At 25 degC the bias is another one by 5 degC of up to 1 mg each: its tilt error where the
  // reference is taken at its word. 10 % of it is far above sigma, and below the miss.
  const Eigen::Vector3d bias = sensor.model.bias;
  const double miss = 5.0 * 1.0e-3 * 9.80665;
  EXPECT_LT((bias - truth.model.bias).norm(), 0.1 * miss);

  // Two temperatures; one that the sweep did not pass; another place's gravity.
  known->reference.recorded_degc = Eigen::Vector3d(15.0, 20.0, 25.0);
  const Finished wide = with("");
  EXPECT_EQ(wide.exit_code, 2);
  EXPECT_THAT(wide.err, HasSubstr("belongs to no single temperature"));
  known->reference.recorded_degc = Eigen::Vector3d(80.0, 80.0, 80.0);
  const Finished outside = with("");
  EXPECT_EQ(outside.exit_code, 2);
  EXPECT_THAT(outside.err, HasSubstr("over a range that includes it"));
  known->reference.recorded_degc.reset();
  const Finished elsewhere = with(",reference.gravity_mps2=9.78");
  EXPECT_EQ(elsewhere.exit_code, 2);
  EXPECT_THAT(elsewhere.err, HasSubstr("was made with gravity"));
}

TEST_F(TemperatureSweep, IsJudgedByItsLimits) {
  const Finished tight = Calibrate("limits={accelerometer.residual_rms: 1e-9}");
  EXPECT_EQ(tight.exit_code, 4) << tight.err;
  EXPECT_THAT(tight.out, HasSubstr("FAIL"));
  // At the reference temperature it is held.
  const Finished held = Calibrate("limits={accelerometer.bias: 0.5}");
  EXPECT_EQ(held.exit_code, 1);
  EXPECT_THAT(held.err, HasSubstr("limits a quantity that a sweep does not measure"));
}

TEST_F(TemperatureSweep, RefusesKnotsThatItDidNotPass) {
  const Finished outside = Calibrate("sensors.accelerometer.thermal.knots=[200]");
  EXPECT_EQ(outside.exit_code, 1);
  EXPECT_THAT(outside.err, HasSubstr("lies outside of the sweep's"));
  const Finished twice = Calibrate("sensors.accelerometer.thermal.knots=[30, 30]");
  EXPECT_NE(twice.exit_code, 0);
  EXPECT_THAT(twice.err, HasSubstr("each once"));
}

TEST_F(TemperatureSweep, SaysThatTheTemperatureEnded) {
  // The last column of the second half is empty: a thermometer that fell off.
  std::istringstream log(TemporaryFolder::Read(folder_.Path("sweep/recording.csv")));
  std::ostringstream cut;
  int row = 0;
  for (std::string line; std::getline(log, line); ++row) {
    if (row > 14'000) line.resize(line.rfind(',') + 1);
    cut << line << '\n';
  }
  const std::string path = folder_.Write("cut.csv", cut.str());
  const Finished run = RunTruetriad({"calibrate",
                                     "--config=" + kConfigs + "experiments/thermal-sweep.yaml",
                                     "--input=" + path,
                                     "--output=" + folder_.Path("found")});
  EXPECT_THAT(run.out, HasSubstr("% of the time, without a temperature"));
}

// The element takes three tenths of its temperature from outside; bias_mg_degc is 0.5, -0.3, 1.0.
TEST_F(TemperatureSweep, RegressesOnTheAmbientTemperatureToo) {
  const Finished made =
      RunTruetriad({"simulate",
                    "--config=" + kConfigs + "scenarios/thermal-sweep.yaml",
                    "--output=" + folder_.Path("ambient"),
                    "--set=temperature.ambient_logged=true,temperature.ambient_lag_s=300,"
                    "temperature.ambient_noise_degc=0.02,temperature.element_lag_s=30,"
                    "temperature.element_ambient_share=0.3,"
                    "sensors.accelerometer.thermal.rate_mps2_degcps=[0, 0, 0]"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_THAT(TemporaryFolder::Read(folder_.Path("ambient/recording.csv")).substr(0, 400),
              HasSubstr("temperature[degC],ambient_temperature[degC]"));
  const auto calibrate = [&](const std::string& input, const std::string& factors) {
    return RunTruetriad({"calibrate",
                         "--config=" + kConfigs + "experiments/thermal-sweep.yaml",
                         "--input=" + folder_.Path(input),
                         "--output=" + folder_.Path("regressed"),
                         "--set=sensors.accelerometer.thermal.regression=" + factors});
  };
  const Finished run = calibrate("ambient/recording.yaml", "full");
  ASSERT_EQ(run.exit_code, 0) << run.out << run.err;
  EXPECT_THAT(run.out,
              AllOf(HasSubstr("Second-order regression: Accelerometer x"),
                    HasSubstr("The regression is reported,"),
                    HasSubstr("calibration determines it")));
  EXPECT_THAT(TemporaryFolder::Read(folder_.Path("regressed/report.html")),
              HasSubstr("Second-order regression"));
  Result<Calibration> found = ReadCalibration(folder_.Path("regressed/calibration.yaml"));
  ASSERT_TRUE(found) << found.error().message;
  ASSERT_TRUE(found->quality.sweep.axes.front().regression);
  EXPECT_EQ(found->quality.sweep.axes.front().regression->terms.size(), 21U);
  // Where everything follows one chamber, A is tau and the two rates: without A' it is told.
  ASSERT_EQ(calibrate("ambient/recording.yaml", "[temperature, rate, ambient]").exit_code, 0);
  found = ReadCalibration(folder_.Path("regressed/calibration.yaml"));
  ASSERT_TRUE(found) << found.error().message;
  const SweepAxis& axis = found->quality.sweep.axes.front();
  ASSERT_TRUE(axis.regression);
  EXPECT_EQ(axis.regression->terms.size(), 10U);
  const auto chosen = [&](const std::string& name) {
    for (const RegressionTerm& term : axis.regression->terms) {
      if (term.name == name && term.chosen) return term.coefficient;
    }
    return 0.0;
  };
  // 0.5 mg/degC: 4.9e-3 m/s^2/degC, of which three tenths are the ambient's.
  EXPECT_NEAR(chosen("A") / (chosen("tau") + chosen("A")), 0.3, 0.05);
  EXPECT_NEAR(chosen("tau") + chosen("A"), 4.9e-3, 0.2e-3);
  EXPECT_LT(axis.regression->rms, 1.2 * axis.noise_sigma);
  // The plain recording has no such column.
  const Finished without = calibrate("sweep/recording.yaml", "full");
  EXPECT_EQ(without.exit_code, 2);
  EXPECT_THAT(without.err, HasSubstr("ambient_temperature[degC]"));
  const Finished two = calibrate("sweep/recording.yaml", "[temperature, rate]");
  EXPECT_EQ(two.exit_code, 0) << two.err;
  const Finished unknown = calibrate("sweep/recording.yaml", "[humidity]");
  EXPECT_NE(unknown.exit_code, 0);
  EXPECT_THAT(unknown.err, HasSubstr("ambient_rate"));
}

TEST_F(TemperatureSweep, RefusesWhatOnlyASoakTells) {
  const Finished run = Calibrate("sensors.accelerometer.thermal.matrix_order=1");
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err, HasSubstr("cannot separate sensitivity from bias"));
}

}  // namespace sweep_test
}  // namespace truetriad
