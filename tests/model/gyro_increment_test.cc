// SPDX-License-Identifier: Apache-2.0
#include "model/gyro_increment.h"

#include <cmath>

#include <gtest/gtest.h>

#include "math/random.h"
#include "truetriad/math/rotation.h"

namespace truetriad {
namespace gyro_increment_test {

constexpr double kDurationS = 2.0;

// A turn of 2.5 rad about an axis that itself turns by 1.5 rad: Exp(a(t) x) Exp(b(t) y), smooth, at
// rest at both ends.
struct Turning {
  static double Progress(double time_s) {
    const double s = time_s / kDurationS;
    return s * s * s * (10.0 + s * (-15.0 + 6.0 * s));
  }
  static double Speed(double time_s) {
    const double s = time_s / kDurationS;
    return 30.0 * s * s * (1.0 - s) * (1.0 - s) / kDurationS;
  }
  static Eigen::Quaterniond Attitude(double time_s) {
    return RotationExp(2.5 * Progress(time_s) * Eigen::Vector3d::UnitX()) *
           RotationExp(1.5 * Progress(time_s) * Eigen::Vector3d::UnitY());
  }
  static Eigen::Vector3d Rate(double time_s) {
    const Eigen::Quaterniond second =
        RotationExp(1.5 * Progress(time_s) * Eigen::Vector3d::UnitY());
    return second.conjugate() * Eigen::Vector3d(2.5 * Speed(time_s), 0.0, 0.0) +
           Eigen::Vector3d(0.0, 1.5 * Speed(time_s), 0.0);
  }
  static Eigen::Vector3d Force(double time_s) {
    return Attitude(time_s).conjugate() * Eigen::Vector3d(0.3 * Speed(time_s), 0.0, 9.8);
  }
};

// In counts, with everything far from nominal.
GyroModel Model() {
  GyroModel model;
  model.triad.sensitivity << 4700.0, 40.0, -30.0, 90.0, -4800.0, 200.0, -100.0, 60.0, 4600.0;
  model.triad.bias << 32768.0, 32400.0, 32900.0;
  model.triad.axis_terms[AxisTerm::kAsymmetry] << 0.01, -0.02, 0.015;
  model.is_bent = true;
  model.g_sensitivity << 3.0, -1.0, 0.5, 0.2, 2.0, -0.7, 1.1, 0.4, -2.0;
  return model;
}

std::vector<double> EvenTimes(int steps) {
  std::vector<double> times;
  for (int i = 0; i <= steps; ++i) times.push_back(kDurationS * i / steps);
  return times;
}

GyroMove Read(const std::vector<double>& times, RateSampling sampling, bool with_force) {
  const GyroModel model = Model();
  GyroMove move;
  for (std::size_t i = 0; i < times.size(); ++i) {
    Eigen::Vector3d rate = Turning::Rate(times[i]);
    if (sampling == RateSampling::kMeanRate && i > 0 && times[i] > times[i - 1]) {
      rate =
          RotationLog(Turning::Attitude(times[i - 1]).conjugate() * Turning::Attitude(times[i])) /
          (times[i] - times[i - 1]);
    }
    Eigen::Vector3d raw = model.triad.RawFromTruth(rate);
    if (with_force) {
      move.force_mps2.push_back(Turning::Force(times[i]));
      raw += model.g_sensitivity * move.force_mps2.back();
    }
    move.time_s.push_back(times[i]);
    move.reading_raw.push_back(raw);
  }
  return move;
}

double AttitudeError(const GyroMove& move, RateSampling sampling) {
  const GyroIncrement increment = IntegrateMove(move, Model(), Eigen::Vector3d::Ones(), sampling);
  const Eigen::Quaterniond truth =
      Turning::Attitude(move.time_s.front()).conjugate() * Turning::Attitude(move.time_s.back());
  return RotationLog(truth.conjugate() * increment.rotation).norm();
}

TEST(GyroIncrement, OfMeanRatesIsExact) {
  // Jitter, a duplicate and a gap change nothing: time stamps are taken as they are.
  std::vector<double> times = EvenTimes(200);
  times[50] += 0.004;
  times[61] = times[60];
  times.erase(times.begin() + 100, times.begin() + 130);
  EXPECT_LT(AttitudeError(Read(times, RateSampling::kMeanRate, true), RateSampling::kMeanRate),
            1e-12);
}

TEST(GyroIncrement, FollowsAChangingAxisToFourthOrder) {
  const double coarse = AttitudeError(Read(EvenTimes(100), RateSampling::kInstantaneous, true),
                                      RateSampling::kInstantaneous);
  const double fine = AttitudeError(Read(EvenTimes(200), RateSampling::kInstantaneous, true),
                                    RateSampling::kInstantaneous);
  EXPECT_LT(coarse, 1e-6);
  EXPECT_NEAR(coarse / fine, 16.0, 2.0);
}

TEST(GyroIncrement, OfOneReadingIsNoTurn) {
  const GyroIncrement increment = IntegrateMove(Read({0.7}, RateSampling::kInstantaneous, false),
                                                Model(),
                                                Eigen::Vector3d::Ones(),
                                                RateSampling::kInstantaneous);
  EXPECT_EQ(increment.rotation.vec().norm(), 0.0);
  EXPECT_EQ(increment.duration_s, 0.0);
  EXPECT_TRUE(increment.covariance.isZero(0.0));
}

class GyroIncrementOf : public ::testing::TestWithParam<RateSampling> {};

// Central differences: rounding over their step is left. Without the ends, where the unit rests: an
// asymmetric axis has no derivative at zero.
TEST_P(GyroIncrementOf, ItsJacobiansAreTheDerivatives) {
  std::vector<double> times = EvenTimes(200);
  times[50] += 0.004;
  times[61] = times[60];
  times.erase(times.begin() + 100, times.begin() + 130);
  times.pop_back();
  times.erase(times.begin());
  const GyroMove move = Read(times, GetParam(), true);
  const auto turn = [&](const GyroModel& model) {
    return IntegrateMove(move, model, Eigen::Vector3d::Ones(), GetParam()).rotation;
  };
  const GyroIncrement increment = IntegrateMove(move, Model(), Eigen::Vector3d::Ones(), GetParam());
  const auto derivative = [&](auto change, double step) -> Eigen::Vector3d {
    GyroModel up = Model(), down = Model();
    change(&up, step);
    change(&down, -step);
    return RotationLog(turn(down).conjugate() * turn(up)) / (2.0 * step);
  };
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d by_bias =
        derivative([&](GyroModel* m, double h) { m->triad.bias[i] += h; }, 1e-3);
    EXPECT_LT((increment.by_bias.col(i) - by_bias).norm(), 1e-7 * by_bias.norm());
    const Eigen::Vector3d by_asymmetry = derivative(
        [&](GyroModel* m, double h) { m->triad.axis_terms[AxisTerm::kAsymmetry][i] += h; }, 1e-4);
    EXPECT_LT((increment.by_axis_term[AxisTerm::kAsymmetry].col(i) - by_asymmetry).norm(),
              1e-7 * increment.by_axis_term[AxisTerm::kAsymmetry].norm());
  }
  for (int i = 0; i < 9; ++i) {
    const Eigen::Vector3d by_sensitivity =
        derivative([&](GyroModel* m, double h) { m->triad.sensitivity(i % 3, i / 3) += h; }, 1e-3);
    EXPECT_LT((increment.by_sensitivity.col(i) - by_sensitivity).norm(),
              1e-7 * increment.by_sensitivity.norm());
    const Eigen::Vector3d by_g =
        derivative([&](GyroModel* m, double h) { m->g_sensitivity(i % 3, i / 3) += h; }, 1e-4);
    EXPECT_LT((increment.by_g_sensitivity.col(i) - by_g).norm(),
              1e-7 * increment.by_g_sensitivity.norm());
  }
}

// Sample covariance of n draws: each entry within 5 sigma, sigma about sqrt(2 / n) of the largest.
TEST_P(GyroIncrementOf, ItsCovarianceIsThatOfTheErrors) {
  const GyroMove clean = Read(EvenTimes(100), GetParam(), false);
  const Eigen::Vector3d sigma(8.0, 15.0, 4.0);
  const GyroIncrement exact = IntegrateMove(clean, Model(), sigma, GetParam());
  Random random(5);
  constexpr int kDraws = 4000;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (int draw = 0; draw < kDraws; ++draw) {
    GyroMove move = clean;
    for (Eigen::Vector3d& reading : move.reading_raw) {
      for (int i = 0; i < 3; ++i) reading[i] += sigma[i] * random.Normal();
    }
    const GyroIncrement noisy = IntegrateMove(move, Model(), sigma, GetParam());
    const Eigen::Vector3d error = RotationLog(exact.rotation.conjugate() * noisy.rotation);
    covariance += error * error.transpose() / kDraws;
  }
  EXPECT_LT((covariance - exact.covariance).cwiseAbs().maxCoeff(),
            5.0 * std::sqrt(2.0 / kDraws) * exact.covariance.diagonal().maxCoeff());
}

INSTANTIATE_TEST_SUITE_P(EachSampling,
                         GyroIncrementOf,
                         ::testing::Values(RateSampling::kInstantaneous, RateSampling::kMeanRate));

}  // namespace gyro_increment_test
}  // namespace truetriad
