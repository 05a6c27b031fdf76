// SPDX-License-Identifier: Apache-2.0
//
// A non-linearity that a data sheet states, of a sensor whose bends are not estimated.

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <Eigen/Cholesky>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "math/random.h"
#include "support/accel_mag_trials.h"
#include "support/finding_matchers.h"
#include "truetriad/calibrate/calibrate.h"
#include "verdict/term_search.h"

namespace truetriad {
namespace {

using ::testing::Contains;
using ::testing::Not;

constexpr Triad kAccel = Triad::kAccelerometer, kMag = Triad::kMagnetometer,
                kGyro = Triad::kGyroscope;

// The largest distance of f from the line that fits it best over -1 to 1, by many points.
double BeyondLine(AxisTerm term) {
  constexpr int kPoints = 20'001;
  Eigen::MatrixX2d line(kPoints, 2);
  Eigen::VectorXd bent(kPoints);
  for (int i = 0; i < kPoints; ++i) {
    const double u = -1.0 + 2.0 * i / (kPoints - 1);
    line.row(i) << 1.0, u;
    bent[i] = ValueOf(term, u);
  }
  const Eigen::Vector2d best = (line.transpose() * line).ldlt().solve(line.transpose() * bent);
  return (bent - line * best).cwiseAbs().maxCoeff();
}

TEST(Nonlinearity, IsTheDistanceFromTheBestStraightLine) {
  for (const AxisTermInfo& info : kAxisTerms) {
    // The line through so many points is that of all to a share of one over their number.
    EXPECT_NEAR(info.beyond_line, BeyondLine(info.term), 3e-4) << info.name;
  }
  // 0.5 % of ± 2 g is 0.1 m/s^2, in counts of 1/800 m/s^2 78 of 15 690.
  const Nonlinearity stated{0.5, 2.0 * kStandardGravityMps2};
  const double end_raw = 800.0 * stated.full_scale;
  for (const AxisTermInfo& info : kAxisTerms) {
    const double at_end = ValueOf(info.term, end_raw) * stated.SigmaOf(info, 800.0);
    EXPECT_NEAR(at_end * info.beyond_line, 0.005 * end_raw, 1e-9 * end_raw) << info.name;
  }
}

// Of b and h by one inverse of the whole: the last of three h cannot be told from b at all.
TEST(TermSearch, AllowsForAPriorAsTheJointSolutionDoes) {
  Random random(1);
  const Eigen::Index rows = 12, size = 5, extra = 3;
  Eigen::MatrixXd slope(rows, size + extra);
  for (double& entry : slope.reshaped()) entry = random.Normal();
  slope.col(7) = slope.leftCols(5).rowwise().sum();
  Eigen::VectorXd noise(rows);
  for (double& entry : noise) entry = random.Normal();
  const Eigen::MatrixXd information = slope.transpose() * slope;
  // At the b that is best without h.
  const Eigen::MatrixXd B = slope.leftCols(size);
  const Eigen::VectorXd left = noise - B * (B.transpose() * B).ldlt().solve(B.transpose() * noise);
  const Eigen::VectorXd gradient = slope.transpose() * left;
  const Eigen::Vector3d sigmas(0.3, 5.0, 2.0);

  TermSearch search(*ConditionOn(information, gradient, {0, 1, 2, 3, 4}, {5, 6, 7}));
  search.AllowFor({0, 1, 2}, sigmas);

  Eigen::MatrixXd joint = information;
  joint.diagonal().tail<3>() += sigmas.cwiseAbs2().cwiseInverse();
  const Eigen::MatrixXd covariance = joint.inverse();
  const Eigen::VectorXd moved = (covariance * gradient).head(size);
  const Eigen::MatrixXd alone = information.topLeftCorner(size, size).inverse();
  const Eigen::MatrixXd wider =
      covariance.topLeftCorner(size, size) - alone + moved * moved.transpose();
  EXPECT_LT((search.Covariance() - wider).norm(), 1e-9 * wider.norm());
  EXPECT_LT((search.CovarianceBy({0, 1, 2}) - wider).norm(), 1e-9 * wider.norm());

  // What one of them has beyond its σ: u and I of readings whose noise has it.
  const Eigen::MatrixXd allowed =
      Eigen::MatrixXd::Identity(rows, rows) +
      slope.rightCols(3) * sigmas.cwiseAbs2().asDiagonal() * slope.rightCols(3).transpose();
  const Eigen::MatrixXd weight = allowed.inverse();
  const auto best_cost = [&](const Eigen::MatrixXd& columns) {
    const Eigen::VectorXd off =
        noise - columns * (columns.transpose() * weight * columns)
                              .ldlt()
                              .solve(columns.transpose() * weight * noise);
    return off.dot(weight * off);
  };
  const double fall = best_cost(B) - best_cost(slope.leftCols(size + 1));
  EXPECT_NEAR(search.Test({0}).chi2, fall, 1e-9 * fall);
}

enum class Poses { kRandom, kSixFaces };

struct Setup {
  Poses poses = Poses::kRandom;
  double percent = 0.05;  // in truth
  bool is_stated = true;
  ExcessNoise excess = ExcessNoise::kNone;
  bool has_gyroscope = false;
};

PerTriad<Nonlinearity> StatedOf(double percent) {
  PerTriad<Nonlinearity> stated;
  stated[kAccel] = {percent, 2.0 * kStandardGravityMps2};
  stated[kMag] = {percent, 100.0};
  stated[kGyro] = {percent, 250.0 * kRadPerDeg};
  return stated;
}

// Four rests on each face.
std::vector<Eigen::Quaterniond> FaceAttitudes(const AttitudeOptions& block, Random* random) {
  std::vector<Eigen::Quaterniond> attitudes;
  for (int face = 0; face < 6; ++face) {
    const int axis = face / 2, next = (axis + 1) % 3, last = (axis + 2) % 3;
    const Eigen::Vector3d tilt = block.tilt_sigma_deg * kRadPerDeg * random->Normal3();
    for (int rest = 0; rest < 4; ++rest) {
      const Eigen::Vector3d off = tilt + block.seat_sigma_deg * kRadPerDeg * random->Normal3();
      Eigen::Vector3d up = Eigen::Vector3d::Zero();
      up[next] = off[next];
      up[last] = off[last];
      up[axis] = (face % 2 == 0 ? 1.0 : -1.0) * std::sqrt(1.0 - up.squaredNorm());
      attitudes.push_back(Eigen::Quaterniond::FromTwoVectors(up, Eigen::Vector3d::UnitZ()));
    }
  }
  return attitudes;
}

// A unit that bends as the data sheet lets it, calibrated; NEES over its degrees of freedom.
struct Outcome1 {
  Calibration calibration;
  double nees = 0.0;
  int dimension = 0;
};
Outcome1 RunUnit(const Setup& setup, Random* random) {
  SyntheticUnit unit = trials::RandomUnit({}, random);
  CalibrateOptions options = trials::JointOptions(unit);
  if (setup.poses == Poses::kSixFaces) {
    unit.models[kMag].reset();
    options.triads[kMag].enabled = false;
    options.attitudes.kind = AttitudeKind::kSixFace;
    options.gauge = Gauge::kFixture;
  }
  if (setup.has_gyroscope) {
    unit.models[kGyro] = trials::RandomModel({}, 1e-3, random);
    unit.units[kGyro] = trials::UnitOf(kGyro, false);
    options.triads[kGyro].enabled = true;
  }
  const PerTriad<Nonlinearity> stated = StatedOf(setup.percent);
  for (const Triad triad : kTriads) {
    if (!unit.models[triad]) continue;
    options.triads[triad].excess = setup.excess;
    if (setup.is_stated) options.triads[triad].nonlinearity = stated[triad];
    TriadModel<double>& model = *unit.models[triad];
    for (const AxisTerm term :
         {triad == kGyro ? AxisTerm::kAsymmetry : AxisTerm::kQuadratic, AxisTerm::kCubic}) {
      const Eigen::Vector3d drawn = random->Normal3();
      for (int axis = 0; axis < 3; ++axis) {
        model.axis_terms[term][axis] =
            drawn[axis] *
            stated[triad].SigmaOf(InfoOf(term), model.sensitivity.row(axis).norm());
      }
    }
  }
  const auto attitudes = setup.poses == Poses::kSixFaces
                             ? FaceAttitudes(options.attitudes, random)
                             : RandomAttitudes(24, random);
  SyntheticNoise noise = trials::ModelNoise();
  noise.rest_sigma[kGyro] = 1e-4;
  PoseSet poses = SimulatePoses(unit, attitudes, noise, random);
  if (setup.has_gyroscope) {
    AddTurns(unit,
             attitudes,
             {.gyroscope_sigma_radps = 2e-3, .accelerometer_sigma_mps2 = 0.02},
             random,
             &poses);
  }
  const auto summary = Calibrate(poses, options);
  Outcome1 run;
  EXPECT_TRUE(summary && summary->calibration.IsUsable());
  if (!summary || !summary->calibration.IsUsable()) return run;
  run.calibration = summary->calibration;
  run.nees = trials::Nees(trials::Errors(run.calibration, unit),
                          run.calibration.covariance.matrix,
                          &run.dimension);
  return run;
}

// Given the readings, what is off has the covariance C + V about d, and C + V + d d^T is stated: the
// mean of NEES is the dimension, whatever its distribution. Within 4 σ of the mean as it scatters,
// 1 in 16 000.
double NeesOff(const Setup& setup, int runs, std::uint64_t seed) {
  Random random(seed);
  double sum = 0.0, squares = 0.0;
  for (int i = 0; i < runs; ++i) {
    const Outcome1 run = RunUnit(setup, &random);
    const double share = run.nees / run.dimension;
    sum += share;
    squares += share * share;
  }
  const double mean = sum / runs;
  const double sigma = std::sqrt((squares / runs - mean * mean) / runs);
  ::testing::Test::RecordProperty("mean", std::to_string(mean));
  std::printf("nees %g +- %g\n", mean, sigma);
  return (mean - 1.0) / sigma;
}

TEST(Nonlinearity, ThatIsStatedMakesSigmaOfSixFacesHonest) {
  EXPECT_LT(std::abs(NeesOff({.poses = Poses::kSixFaces, .percent = 0.5}, 200, 1)), 4.0);
  // What it were otherwise.
  EXPECT_GT(NeesOff({.poses = Poses::kSixFaces, .percent = 0.5, .is_stated = false}, 50, 1), 4.0);
}

TEST(Nonlinearity, ThatIsStatedMakesSigmaOfRandomPosesHonest) {
  for (const double percent : {0.01, 0.05, 0.5}) {
  for (const ExcessNoise e : {ExcessNoise::kNone, ExcessNoise::kEstimate})
    EXPECT_LT(std::abs(NeesOff({.percent = percent, .excess = e}, 100, 2)), 4.0) << percent;
  }
}

TEST(Nonlinearity, OfAGyroscopeWidensItToo) {
  for (const double percent : {0.01, 0.05, 0.5})
  for (const ExcessNoise e : {ExcessNoise::kNone, ExcessNoise::kEstimate})
  EXPECT_LT(std::abs(NeesOff({.percent = percent, .excess=e, .has_gyroscope = true}, 100, 3)), 4.0);
}

}  // namespace
}  // namespace truetriad
