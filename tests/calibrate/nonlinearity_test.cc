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

#include "math/dense/cholesky.h"
#include "math/random.h"
#include "support/accel_mag_trials.h"
#include "truetriad/calibrate/calibrate.h"

namespace truetriad {
namespace nonlinearity_test {

using ::testing::HasSubstr;

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
    // The best line by so many points is the exact one up to a share of about 1 / kPoints.
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

enum class Poses { kRandom, kSixFaces };

struct Drawn {
  Poses poses = Poses::kRandom;
  double percent = 0.05;      // in truth
  double stated_share = 1.0;  // of `percent`
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
struct UnitRun {
  Calibration calibration;
  double nees = 0.0;
  int dimension = 0;
};
UnitRun RunUnit(const Drawn& setup, Random* random) {
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
    if (setup.is_stated)
      options.triads[triad].nonlinearity = StatedOf(setup.stated_share * setup.percent)[triad];
    TriadModel<double>& model = *unit.models[triad];
    for (const AxisTerm term :
         {triad == kGyro ? AxisTerm::kAsymmetry : AxisTerm::kQuadratic, AxisTerm::kCubic}) {
      const Eigen::Vector3d drawn = random->Normal3();
      for (int axis = 0; axis < 3; ++axis) {
        model.axis_terms[term][axis] =
            drawn[axis] * stated[triad].SigmaOf(InfoOf(term), model.sensitivity.row(axis).norm());
      }
    }
  }
  const auto attitudes = setup.poses == Poses::kSixFaces ? FaceAttitudes(options.attitudes, random)
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
  UnitRun run;
  EXPECT_TRUE(summary);
  if (!summary || !summary->calibration.IsUsable()) return run;
  run.calibration = summary->calibration;
  run.nees = trials::Nees(
      trials::Errors(run.calibration, unit), run.calibration.covariance.matrix, &run.dimension);
  return run;
}

// Given the readings, what is off has the covariance C + V about d, and C + V + d d^T is stated:
// the mean of NEES is the dimension, whatever its distribution. Within 4 σ of the mean as it
// scatters, 1 in 16 000.
double NeesOff(const Drawn& setup, int runs, std::uint64_t seed) {
  Random random(seed);
  double sum = 0.0, squares = 0.0;
  int usable = 0;
  for (int i = 0; i < runs; ++i) {
    const UnitRun run = RunUnit(setup, &random);
    // Some bends look like a change in the middle of the run, or like poses that are off.
    if (run.dimension == 0) continue;
    const double share = run.nees / run.dimension;
    sum += share;
    squares += share * share;
    ++usable;
  }
  EXPECT_GE(usable, runs * 9 / 10);
  const double mean = sum / usable;
  const double sigma = std::sqrt((squares / usable - mean * mean) / usable);
  ::testing::Test::RecordProperty("mean", std::to_string(mean));
  return (mean - 1.0) / sigma;
}

TEST(Nonlinearity, ThatIsStatedMakesSigmaOfSixFacesHonest) {
  EXPECT_LT(std::abs(NeesOff({.poses = Poses::kSixFaces, .percent = 0.5}, 200, 1)), 4.0);
  // Without the statement σ are too small.
  EXPECT_GT(NeesOff({.poses = Poses::kSixFaces, .percent = 0.5, .is_stated = false}, 50, 1), 4.0);
}

// Bends from a fifth of the noise of a pose to four times the noise.
TEST(Nonlinearity, ThatIsStatedMakesSigmaOfRandomPosesHonest) {
  for (const double percent : {0.01, 0.05, 0.2}) {
    EXPECT_LT(std::abs(NeesOff({.percent = percent}, 100, 2)), 4.0) << percent;
  }
}

// An excess that is estimated takes the bends for noise as well, so that σ are larger than need be.
TEST(Nonlinearity, ThatIsStatedLeavesNoSigmaTooSmallWhereNoiseIsEstimated) {
  for (const double percent : {0.05, 0.5}) {
    const Drawn setup{.percent = percent, .excess = ExcessNoise::kEstimate};
    EXPECT_LT(NeesOff(setup, 100, 2), 4.0) << percent;
  }
}

TEST(Nonlinearity, OfAGyroscopeWidensItToo) {
  EXPECT_LT(std::abs(NeesOff({.percent = 0.05, .has_gyroscope = true}, 50, 3)), 4.0);
}

TEST(Nonlinearity, IsAFindingThatSaysByHowMuchItWidens) {
  Drawn setup{.poses = Poses::kSixFaces, .percent = 0.5};
  Random random(4), again(4);
  const UnitRun stated = RunUnit(setup, &random);
  setup.is_stated = false;
  const UnitRun silent = RunUnit(setup, &again);
  const Finding* finding = Find(stated.calibration.findings, FindingCode::kNonlinearityStated);
  ASSERT_NE(finding, nullptr);
  EXPECT_EQ(finding->severity, Severity::kNote);
  EXPECT_EQ(Find(silent.calibration.findings, FindingCode::kNonlinearityStated), nullptr);
  const Eigen::ArrayXd before = silent.calibration.covariance.matrix.diagonal();
  const Eigen::ArrayXd after = stated.calibration.covariance.matrix.diagonal();
  const double most = (before > 0.0).select(after / before, 0.0).maxCoeff();
  // Both covariances have the curvature of the tilts, which the finding does not count.
  EXPECT_NEAR(*finding->Value("widening"), std::sqrt(most), 0.1 * std::sqrt(most));
}

// Ten times what the data sheet says.
TEST(Nonlinearity, ThatIsBeyondWhatIsStatedIsFound) {
  const Drawn setup{.percent = 0.5, .stated_share = 0.1, .excess = ExcessNoise::kEstimate};
  int found = 0;
  Random random(5);
  for (int run = 0; run < 10; ++run) {
    found += Find(RunUnit(setup, &random).calibration.findings, FindingCode::kFault) != nullptr;
  }
  EXPECT_GE(found, 5);
}

TEST(Nonlinearity, IsRefusedWhereNothingIsLeftOutOrNothingIsWidened) {
  const auto problem = [](const auto& change) {
    CalibrateOptions options;
    options.triads[kAccel].enabled = true;
    options.triads[kAccel].nonlinearity = Nonlinearity{0.5, 2.0 * kStandardGravityMps2};
    change(&options);
    const Status status = options.Validate();
    return status ? std::string() : status.error().message;
  };
  EXPECT_EQ(problem([](CalibrateOptions*) {}), "");
  EXPECT_THAT(problem([](CalibrateOptions* options) { options->initialise.only = true; }),
              HasSubstr("start values have no σ"));
  const auto with_terms = [](CalibrateOptions* options) {
    options->triads[kAccel].axis_terms[AxisTerm::kQuadratic] = Wanted::kYes;
    options->triads[kAccel].axis_terms[AxisTerm::kCubic] = Wanted::kYes;
  };
  EXPECT_THAT(problem(with_terms), HasSubstr("quadratic and cubic terms are estimated"));
  // 2 is in g, not in m/s^2.
  EXPECT_THAT(problem([](CalibrateOptions* options) {
                options->triads[kAccel].nonlinearity->full_scale = 2;
              }),
              HasSubstr("less than the field"));
}

// With exact readings nothing shifts: what is left is the joint covariance of a model that has the
// bends and to which their σ came as one more measurement of them, h = 0.
TEST(Nonlinearity, WidensAsTheJointSolutionWithItsTermsAsParameters) {
  Random random(6);
  const SyntheticUnit unit = trials::RandomUnit({}, &random);
  PoseSet poses = SimulatePoses(unit, RandomAttitudes(30, &random), trials::ModelNoise(), &random);
  const PoseSet exact = [&] {
    Random same(7);
    std::vector<Eigen::Quaterniond> attitudes = RandomAttitudes(30, &same);
    PoseSet set = SimulatePoses(unit, attitudes, SyntheticNoise(), &same);
    for (std::size_t k = 0; k < set.poses.size(); ++k) {
      for (const Triad triad : {kAccel, kMag}) {
        set.poses[k].triads[triad]->has_covariance = true;
        set.poses[k].triads[triad]->mean_covariance_raw =
            poses.poses[k].triads[triad]->mean_covariance_raw;
      }
    }
    return set;
  }();
  CalibrateOptions options = trials::JointOptions(unit);
  for (const Triad triad : {kAccel, kMag}) options.triads[triad].excess = ExcessNoise::kNone;
  CalibrateOptions with_terms = options;
  with_terms.triads[kAccel].axis_terms[AxisTerm::kQuadratic] = Wanted::kYes;
  with_terms.triads[kAccel].axis_terms[AxisTerm::kCubic] = Wanted::kYes;
  const Nonlinearity stated{0.02, 2.0 * kStandardGravityMps2};
  options.triads[kAccel].nonlinearity = stated;
  const auto widened = Calibrate(exact, options), joint = Calibrate(exact, with_terms);
  ASSERT_TRUE(widened && widened->calibration.IsUsable());
  ASSERT_TRUE(joint && joint->calibration.IsUsable());

  const std::vector<std::string>& names = joint->calibration.covariance.parameters;
  Eigen::MatrixXd C = joint->calibration.covariance.matrix;
  const Eigen::Matrix3d& S = unit.models[kAccel]->sensitivity;
  for (const AxisTerm term : {AxisTerm::kQuadratic, AxisTerm::kCubic}) {
    for (int axis = 0; axis < 3; ++axis) {
      const std::string name =
          "accelerometer." + std::string(InfoOf(term).name) + "." + "xyz"[axis];
      const auto at = std::find(names.begin(), names.end(), name) - names.begin();
      ASSERT_LT(at, std::ssize(names)) << name;
      const double sigma = stated.SigmaOf(InfoOf(term), S.row(axis).norm());
      const Eigen::VectorXd column = C.col(at);
      C -= column * column.transpose() / (column[at] + sigma * sigma);
    }
  }
  const auto& found = widened->calibration.covariance;
  for (std::size_t i = 0; i < found.parameters.size(); ++i) {
    const auto at = std::find(names.begin(), names.end(), found.parameters[i]) - names.begin();
    ASSERT_LT(at, std::ssize(names)) << found.parameters[i];
    const auto own = static_cast<Eigen::Index>(i);
    // Both are the same up to the solver's last step, 1e-6 σ, and what that changes in slopes.
    EXPECT_NEAR(
        std::sqrt(found.matrix(own, own)), std::sqrt(C(at, at)), 1e-5 * std::sqrt(C(at, at)))
        << found.parameters[i];
  }
}

}  // namespace nonlinearity_test
}  // namespace truetriad
