// SPDX-License-Identifier: Apache-2.0
#include "statistical/regimes.h"

#include <cmath>
#include <cstdint>
#include <utility>

#include "problem/pose_node.h"
#include "truetriad/base/triad.h"

namespace truetriad::trials {
namespace {

constexpr Triad kAccel = Triad::kAccelerometer;
constexpr Triad kGyro = Triad::kGyroscope;
constexpr Triad kMag = Triad::kMagnetometer;

Eigen::Quaterniond SmallTurn(double sigma_rad, Random* random) {
  const Eigen::Vector3d turn = sigma_rad * random->Normal3();
  return Eigen::Quaterniond(Eigen::AngleAxisd(turn.norm(), turn.normalized()));
}

void Drop(Triad triad, Trial* trial) {
  trial->options.triads[triad].enabled = false;
  trial->unit.models[triad].reset();
}

void MagnetometerAlone(Trial* trial, Random* /*random*/) {
  Drop(kAccel, trial);
  // It leads now: truth stands in the frame of its own axes.
  Eigen::Matrix3d& S = trial->unit.models[kMag]->sensitivity;
  S *= GaugeRotation(Gauge::kAccelX, S);
}

// Four rests on each face of a block. The block's faces are off by their own tilts, each rest by
// its seat, both as the experiment says.
void SixFaces(Trial* trial, Random* random) {
  Drop(kMag, trial);
  // The unit's axes stand in the block as they were built in.
  trial->unit.models[kAccel]->sensitivity *= SmallTurn(2.0 * kRadPerDeg, random).toRotationMatrix();
  trial->options.attitudes.kind = AttitudeKind::kSixFace;
  trial->options.gauge = Gauge::kFixture;
  const AttitudeOptions& block = trial->options.attitudes;
  trial->attitudes.clear();
  for (int face = 0; face < kFaceCount; ++face) {
    const Eigen::Matrix3d axes = FaceAxes(face);
    const auto scatter = [random](double sigma_deg) {
      const Eigen::Vector3d normal = random->Normal3();
      return Eigen::Vector2d(sigma_deg * kRadPerDeg * normal.head<2>());
    };
    const Eigen::Vector2d tilt = scatter(block.tilt_sigma_deg);
    for (int rest = 0; rest < 4; ++rest) {
      const Eigen::Vector2d off = tilt + scatter(block.seat_sigma_deg);
      const Eigen::Vector3d up =
          axes * Eigen::Vector3d(std::sqrt(1.0 - off.squaredNorm()), off[0], off[1]);
      // Some attitude that has this direction up.
      trial->attitudes.push_back(Eigen::Quaterniond::FromTwoVectors(up, Eigen::Vector3d::UnitZ()));
    }
  }
}

// A fixture whose own x axis stands anywhere, so that the heading of the field is unknown.
void OnFixture(Trial* trial, double sigma_rad, Random* random) {
  trial->options.attitudes.kind = AttitudeKind::kGiven;
  trial->options.gauge = Gauge::kFixture;
  const Eigen::Quaterniond fixture_from_world(
      Eigen::AngleAxisd(random->Uniform(-3.0, 3.0), Eigen::Vector3d::UnitZ()));
  for (const Eigen::Quaterniond& attitude : trial->attitudes) {
    const Eigen::Quaterniond stated = fixture_from_world * attitude * SmallTurn(sigma_rad, random);
    trial->stated_attitudes.push_back({stated, Eigen::Vector3d::Constant(sigma_rad)});
  }
}

TriadPrior PriorAbout(const TriadModel<double>& truth,
                      double bias_sigma,
                      double sensitivity_sigma,
                      Random* random) {
  TriadPrior prior;
  prior.bias = truth.bias + bias_sigma * random->Normal3();
  prior.bias_sigma.setConstant(bias_sigma);
  prior.sensitivity = truth.sensitivity;
  for (double& entry : prior.sensitivity.reshaped()) entry += sensitivity_sigma * random->Normal();
  prior.sensitivity_sigma.setConstant(sensitivity_sigma);
  return prior;
}

// A gyroscope of a consumer unit beside the two: 0.06 deg/s a reading at 100 Hz, rests of 4 s.
void AddGyroscope(Trial* trial, Random* random) {
  trial->unit.models[kGyro] = RandomModel({}, 1.0, random);
  trial->unit.units[kGyro] = UnitOf(kGyro, false);
  trial->options.triads[kGyro].enabled = true;
  trial->noise.rest_sigma[kGyro] = 5e-5;
  trial->turns.gyroscope_sigma_radps = 1e-3;
  trial->turns.accelerometer_sigma_mps2 = 0.06;
}

void SetModel(MatrixModel model, Trial* trial) {
  for (const Triad triad : {kAccel, kMag}) trial->options.triads[triad].model = model;
}

}  // namespace

const std::vector<Regime>& Regimes() {
  static const std::vector<Regime> kRegimes = {
      {"Joint", "joint, SI, B known, dip unknown"},
      {"EstimatedExcess",
       "excess 0.006 m/s² and 0.1 µT, estimated",
       {},
       [](Trial* trial, Random*) {
         trial->noise.excess_sigma[kAccel] = 0.006;
         trial->noise.excess_sigma[kMag] = 0.1;
         for (TriadOptions& triad : trial->options.triads) triad.excess = ExcessNoise::kEstimate;
       }},
      {"Counts", "counts, offsets to 8 × the signal", {.offset = 8.0, .counts_per_unit = 400.0}},
      {"Permuted", "magnetometer permuted and mirrored", {.permute_magnetometer = true}},
      {"FieldUnknown",
       "B unknown",
       {},
       [](Trial* trial, Random*) { trial->options.reference.field_ut = {}; }},
      {"DipKnown",
       "dip known",
       {},
       [](Trial* trial, Random*) {
         trial->options.reference.dip_rad = {kDip, 0.0};
       }},
      {"GravityWithSigma",
       "gravity ± 0.005 m/s²",
       {},
       [](Trial* trial, Random* random) {
         const double sigma = 0.005;
         const double stated = trial->unit.gravity_mps2 + sigma * random->Normal();
         trial->options.reference.gravity_mps2 = {stated, sigma};
       }},
      {"ReportsGravity",
       "accelerometer reports gravity",
       {},
       [](Trial* trial, Random*) {
         trial->options.triads[kAccel].sign = AccelerometerSign::kGravity;
         trial->unit.models[kAccel]->sensitivity *= -1.0;
       }},
      {"Prior",
       "priors as wide as the σ of the fit",
       {},
       [](Trial* trial, Random* random) {
         trial->options.triads[kAccel].prior =
             PriorAbout(*trial->unit.models[kAccel], 1e-3, 1e-4, random);
         trial->options.triads[kMag].prior =
             PriorAbout(*trial->unit.models[kMag], 0.02, 4e-4, random);
       }},
      {"AccelerometerAlone",
       "accelerometer alone",
       {},
       [](Trial* trial, Random*) { Drop(kMag, trial); }},
      {"MagnetometerAlone", "magnetometer alone", {}, MagnetometerAlone},
      {"Diagonal",
       "model diagonal",
       {.cross_axis = 0.0},
       [](Trial* trial, Random*) { SetModel(MatrixModel::kDiagonal, trial); }},
      {"Symmetric",
       "model symmetric",
       {},
       [](Trial* trial, Random*) {
         SetModel(MatrixModel::kSymmetric, trial);
         Eigen::Matrix3d& S = trial->unit.models[kMag]->sensitivity;
         S = (0.5 * (S + S.transpose())).eval();
       }},
      {"Quadratic",
       "quadratic terms of 100 µg/g² estimated",
       {},
       [](Trial* trial, Random* random) {
         trial->options.triads[kAccel].axis_terms[AxisTerm::kQuadratic] = Wanted::kYes;
         trial->unit.models[kAccel]->axis_terms[AxisTerm::kQuadratic] = 1e-5 * random->Normal3();
       }},
      {"SixFace",
       "accelerometer on six faces, tilt 0.1°, seat 0.05°",
       {},
       [](Trial* trial, Random* random) {
         trial->options.attitudes.tilt_sigma_deg = 0.1;
         SixFaces(trial, random);
       }},
      // What is loose by an angle θ moves the gains by terms in θ², which count beside their σ.
      {"SixFaceLoose", "the same, tilt 0.5°", {}, SixFaces, false},
      {"Fixture",
       "attitudes given, ± 0.1°",
       {},
       [](Trial* trial, Random* random) { OnFixture(trial, 0.1 * kRadPerDeg, random); }},
      {"ExactFixture",
       "attitudes given exactly",
       {},
       [](Trial* trial, Random* random) { OnFixture(trial, 0.0, random); }},
      {"Allan",
       "noise from an Allan deviation, rests of 1 to 20 s",
       {},
       [](Trial* trial, Random* random) {
         trial->noise = SyntheticNoise{};
         trial->options.triads[kAccel].allan =
             AllanNoise{Eigen::Vector3d(0.005, 0.008, 0.012), Eigen::Vector3d(0.004, 0.002, 0.003)};
         trial->options.triads[kMag].allan =
             AllanNoise{Eigen::Vector3d(0.1, 0.15, 0.1), Eigen::Vector3d(0.03, 0.06, 0.1)};
         for (std::size_t k = 0; k < trial->attitudes.size(); ++k) {
           trial->durations_s.push_back(random->Uniform(1.0, 20.0));
         }
       }},
      {"SigmaColumns",
       "σ stated pose by pose, 0.3 to 3 × the usual",
       {},
       [](Trial* trial, Random* random) {
         for (std::size_t k = 0; k < trial->attitudes.size(); ++k) {
           trial->rest_factors.push_back(std::pow(10.0, random->Uniform(-0.5, 0.5)));
         }
       }},
      {"Residuals",
       "noise not stated: from the residuals",
       {},
       [](Trial* trial, Random*) { trial->states_covariances = false; }},
      {"StatedExcess",
       "excess 0.006 m/s² and 0.1 µT, stated",
       {},
       [](Trial* trial, Random*) {
         trial->noise.excess_sigma[kAccel] = 0.006;
         trial->noise.excess_sigma[kMag] = 0.1;
         for (const Triad triad : {kAccel, kMag}) {
           trial->options.triads[triad].excess = ExcessNoise::kGiven;
           trial->options.triads[triad].excess_sigma = trial->noise.excess_sigma[triad];
         }
       }},
      // Last, so that the seeds of the others stay as they are.
      {"NineAxis", "nine axes, turns of 2.5 s at 100 Hz", {}, AddGyroscope},
      {"Cubic",
       "quadratic and cubic terms of 100 µg/g² and 1000 µg/g³ estimated",
       {},
       [](Trial* trial, Random* random) {
         for (const auto& [term, size] :
              {std::pair(AxisTerm::kQuadratic, 1e-5), std::pair(AxisTerm::kCubic, 1e-5)}) {
           trial->options.triads[kAccel].axis_terms[term] = Wanted::kYes;
           trial->unit.models[kAccel]->axis_terms[term] = size * random->Normal3();
         }
       }},
  };
  return kRegimes;
}

void PrintTo(const Regime& regime, std::ostream* out) { *out << regime.name; }

Trial MakeTrial(const Regime& regime, Random* random) {
  constexpr int kPoses = 24;
  Trial trial;
  trial.unit = RandomUnit(regime.spread, random);
  trial.attitudes = RandomAttitudes(kPoses, random);
  trial.options = JointOptions(trial.unit);
  for (TriadOptions& triad : trial.options.triads) triad.excess = ExcessNoise::kNone;
  if (regime.change != nullptr) regime.change(&trial, random);
  return trial;
}

namespace {

// Rest noise of one pose, true unit.
PerTriad<double> RestSigma(const Trial& trial, std::size_t pose) {
  PerTriad<double> sigma = trial.noise.rest_sigma;
  if (!trial.rest_factors.empty()) {
    for (double& value : sigma) value *= trial.rest_factors[pose];
  }
  return sigma;
}

PoseSet Readings(const Trial& trial, Random* random) {
  PoseSet poses;
  for (std::size_t k = 0; k < trial.attitudes.size(); ++k) {
    const SyntheticNoise noise{RestSigma(trial, k), trial.noise.excess_sigma};
    PoseSet one = SimulatePoses(trial.unit, {trial.attitudes[k]}, noise, random);
    one.poses.front().number = static_cast<int>(k) + 1;
    if (k == 0) {
      poses = std::move(one);
    } else {
      poses.poses.push_back(std::move(one.poses.front()));
    }
  }
  return poses;
}

// What is told of each pose beside its readings.
void TellPoses(const Trial& trial, PoseSet* poses) {
  constexpr std::int64_t kSamples = 1'000'000'000;  // so many that one spacing is nothing
  for (std::size_t k = 0; k < poses->poses.size(); ++k) {
    StaticPose& pose = poses->poses[k];
    if (!trial.stated_attitudes.empty()) pose.attitude = trial.stated_attitudes[k];
    if (trial.durations_s.empty()) continue;
    pose.end_ns = std::llround(trial.durations_s[k] * 1e9);
    for (Boxed<TriadPose>& seen : pose.triads) {
      if (seen) seen->samples = kSamples;
    }
  }
}

}  // namespace

PoseSet NoisyPoses(const Trial& trial, Random* random) {
  // Floor of an Allan deviation in terms of the bias instability. IEEE Std 952-1997, C.1.3.
  constexpr double kFloor = 0.664;
  PoseSet poses = Readings(trial, random);
  TellPoses(trial, &poses);
  if (trial.unit.models[kGyro]) {
    AddTurns(trial.unit, trial.attitudes, trial.turns, random, &poses);
  }
  for (std::size_t k = 0; k < poses.poses.size(); ++k) {
    for (const Triad triad : kTriads) {
      Boxed<TriadPose>& seen = poses.poses[k].triads[triad];
      if (seen && !trial.states_covariances) {
        seen->mean_covariance_raw.setZero();
        seen->has_covariance = false;
      }
      const std::optional<AllanNoise>& allan = trial.options.triads[triad].allan;
      if (!allan) continue;
      const Eigen::Vector3d white = allan->white_density_raw / std::sqrt(trial.durations_s[k]);
      const Eigen::Vector3d wander = kFloor * allan->instability_raw;
      seen->mean_raw +=
          white.cwiseProduct(random->Normal3()) + wander.cwiseProduct(random->Normal3());
    }
  }
  return poses;
}

PoseSet ExactPoses(const Trial& trial) {
  Random unused(0);
  PoseSet poses = SimulatePoses(trial.unit, trial.attitudes, SyntheticNoise{}, &unused);
  TellPoses(trial, &poses);
  if (trial.unit.models[kGyro]) {
    AddTurns(trial.unit, trial.attitudes, trial.turns, nullptr, &poses);
  }
  for (std::size_t k = 0; k < poses.poses.size(); ++k) {
    for (const Triad triad : kTriads) {
      Boxed<TriadPose>& seen = poses.poses[k].triads[triad];
      if (!seen) continue;
      const Eigen::Matrix3d& S = trial.unit.models[triad]->sensitivity;
      const double variance =
          std::pow(RestSigma(trial, k)[triad], 2) + std::pow(trial.noise.excess_sigma[triad], 2);
      seen->mean_covariance_raw = variance * S * S.transpose();
      seen->has_covariance = true;
    }
  }
  return poses;
}

}  // namespace truetriad::trials
