// SPDX-License-Identifier: Apache-2.0
//
// A table whose rate is known, but not about which axis of the unit: |C (y - b)| = rate.

#include <cmath>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "math/distributions.h"
#include "math/random.h"
#include "support/accel_mag_trials.h"
#include "support/finding_matchers.h"
#include "truetriad/calibrate/calibrate.h"
#include "truetriad/model/calibration.h"
#include "truetriad/verdict/summary.h"

namespace truetriad {
namespace known_speeds_test {

using ::testing::Contains;

constexpr Triad kGyro = Triad::kGyroscope;

struct Table {
  std::vector<double> speeds_radps;  // a stretch each, about a random axis
  int rests = 0;
  double sigma_raw = 0.0;    // of a mean
  double sigma_radps = 0.0;  // of the table's rate
};

// A gyroscope in counts, stated in its own axes: lower triangular.
TriadModel<double> DrawGyroscope(Random* random) {
  TriadModel<double> model;
  model.sensitivity =
      900.0 * (Eigen::Matrix3d::Identity() +
               0.03 * Eigen::Matrix3d::NullaryExpr([&] { return random->Normal(); }));
  model.sensitivity *= GaugeRotation(Gauge::kAccelX, model.sensitivity);
  model.bias = 30.0 * random->Normal3();
  return model;
}

PoseSet Record(const TriadModel<double>& unit, const Table& table, Random* random) {
  PoseSet set;
  set.source = "table";
  StreamSummary stream;
  stream.triad = kGyro;
  stream.unit = {"counts", 1.0, true};
  set.streams.push_back(stream);
  int number = 0;
  const auto means = [&](const Eigen::Vector3d& rate_radps) {
    StaticPose pose;
    pose.number = ++number;
    TriadPose seen;
    seen.samples = 100;
    seen.mean_raw = unit.RawFromTruth(rate_radps) + table.sigma_raw * random->Normal3();
    seen.mean_covariance_raw = table.sigma_raw * table.sigma_raw * Eigen::Matrix3d::Identity();
    seen.has_covariance = table.sigma_raw > 0.0;
    pose.triads[kGyro] = seen;
    return pose;
  };
  for (int rest = 0; rest < table.rests; ++rest) {
    set.poses.push_back(means(Eigen::Vector3d::Zero()));
  }
  for (const double speed : table.speeds_radps) {
    const Eigen::Vector3d axis = random->Normal3().normalized();
    KnownRate rate;
    rate.stated.is_axis_known = false;
    rate.stated.rate_radps = speed * Eigen::Vector3d::UnitX();  // of which only the size is known
    rate.stated.covariance_radps2 =
        table.sigma_radps * table.sigma_radps * Eigen::Matrix3d::Identity();
    rate.means = means((speed + table.sigma_radps * random->Normal()) * axis);
    set.rates.push_back(std::move(rate));
  }
  return set;
}

CalibrateOptions OptionsForSpeeds() {
  CalibrateOptions options;
  options.triads[kGyro].enabled = true;
  options.triads[kGyro].excess = ExcessNoise::kNone;
  options.triads[kGyro].mounting = Eigen::Matrix3d::Identity();
  options.has_stated_axes = false;
  options.cross_validation_folds = 0;
  return options;
}

Eigen::VectorXd ErrorsOf(const Calibration& calibration, const TriadModel<double>& truth) {
  const TriadModel<double>& found = calibration.sensors[kGyro]->model;
  Eigen::VectorXd errors(12);
  errors.head<3>() = found.bias - truth.bias;
  const Eigen::Matrix3d off = (found.sensitivity - truth.sensitivity).transpose();
  errors.tail<9>() = off.reshaped();  // by rows
  return errors;
}

// With rests or without, at one speed or several.
TEST(KnownSpeeds, GiveTheGyroscopeExactlyWithoutNoise) {
  Random random(1);
  for (const auto& [speeds, rests] :
       {std::pair(std::vector<double>(14, 2.0), 0),
        std::pair(std::vector<double>(14, 2.0), 3),
        std::pair(std::vector<double>{1, 2, 1, 2, 1, 2, 1, 2, 1, 2, 1, 2, 1, 2}, 2)}) {
    const TriadModel<double> unit = DrawGyroscope(&random);
    const PoseSet poses = Record(unit, {speeds, rests, 0.0, 0.0}, &random);
    const auto summary = Calibrate(poses, OptionsForSpeeds());
    ASSERT_TRUE(summary) << summary.error().message;
    ASSERT_TRUE(summary->calibration.IsUsable());
    EXPECT_EQ(summary->calibration.gauge_sensor, kGyro);
    // As a share of the gain: rounding, and weights by a nominal noise of 1e-7 of the signal.
    EXPECT_LT(ErrorsOf(summary->calibration, unit).norm(), 1e-6 * 900.0);
  }
}

TEST(KnownSpeeds, GiveErrorsAsTheirCovarianceSays) {
  Random random(2);
  double sum = 0.0;
  int dimension = 0;
  for (int trial = 0; trial < 100; ++trial) {
    const TriadModel<double> unit = DrawGyroscope(&random);
    // The noise of the readings and that of the table are 1e-4 of the signal each.
    const Table table{std::vector<double>(16, 2.0), 4, 0.2, 2e-4};
    const auto summary = Calibrate(Record(unit, table, &random), OptionsForSpeeds());
    ASSERT_TRUE(summary && summary->calibration.IsUsable());
    int size = 0;
    sum += trials::Nees(ErrorsOf(summary->calibration, unit),
                        summary->calibration.covariance.matrix.topLeftCorner(12, 12),
                        &size);
    EXPECT_EQ(size, 9);  // three entries of the matrix are the gauge
    dimension += size;
  }
  // χ² with `dimension` degrees of freedom, 1 in 10 000 on each side.
  EXPECT_GT(ChiSquareCdf(sum, dimension), 1e-4) << sum << " of " << dimension;
  EXPECT_LT(ChiSquareCdf(sum, dimension), 1.0 - 1e-4) << sum << " of " << dimension;
}

TEST(KnownSpeeds, AreSolvedByPlainCeresAlike) {
  Random random(3);
  const TriadModel<double> unit = DrawGyroscope(&random);
  const PoseSet poses = Record(unit, {std::vector<double>(16, 2.0), 4, 0.2, 2e-4}, &random);
  CalibrateOptions options = OptionsForSpeeds();
  const auto eliminated = Calibrate(poses, options);
  options.solver = Solver::kCeres;
  const auto ceres = Calibrate(poses, options);
  ASSERT_TRUE(eliminated && ceres);
  const TriadCalibration& a = *eliminated->calibration.sensors[kGyro];
  const TriadCalibration& b = *ceres->calibration.sensors[kGyro];
  EXPECT_LT((a.model.bias - b.model.bias).cwiseQuotient(a.bias_sigma).norm(), 1e-4);
}

TEST(KnownSpeeds, OfFewerThanNineAttitudesAreNotEnough) {
  Random random(4);
  const TriadModel<double> unit = DrawGyroscope(&random);
  const PoseSet poses = Record(unit, {std::vector<double>(8, 2.0), 0, 0.2, 0.0}, &random);
  const auto summary = Calibrate(poses, OptionsForSpeeds());
  ASSERT_TRUE(summary);
  EXPECT_FALSE(summary->calibration.IsUsable());
  EXPECT_THAT(summary->calibration.findings, Contains(HasCode(FindingCode::kTooFewPoses)));
}

// A table that turned at another rate for a while.
TEST(KnownSpeeds, LeaveOutAStretchThatContradicts) {
  Random random(5);
  const TriadModel<double> unit = DrawGyroscope(&random);
  PoseSet poses = Record(unit, {std::vector<double>(20, 2.0), 4, 0.2, 0.0}, &random);
  poses.rates[7].stated.rate_radps *= 1.01;
  CalibrateOptions options = OptionsForSpeeds();
  options.triads[kGyro].excess = ExcessNoise::kEstimate;
  const auto summary = Calibrate(poses, options);
  ASSERT_TRUE(summary) << summary.error().message;
  ASSERT_TRUE(summary->calibration.IsUsable()) << summary->calibration.findings.back().Message();
  const Eigen::VectorXd off = ErrorsOf(summary->calibration, unit);
  const TriadCalibration& found = *summary->calibration.sensors[kGyro];
  // Five σ of a gain: what the wrong rate would shift is a hundred.
  EXPECT_LT(std::abs(off[3]), 5.0 * found.sensitivity_sigma(0, 0));
  EXPECT_LT(std::abs(off[11]), 5.0 * found.sensitivity_sigma(2, 2));
}

}  // namespace known_speeds_test
}  // namespace truetriad
