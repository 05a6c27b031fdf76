// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Geometry>

#include "math/dense/cholesky.h"
#include "math/random.h"
#include "model/world.h"
#include "truetriad/base/triad.h"
#include "truetriad/calibrate/calibrate.h"
#include "truetriad/data/static_pose.h"
#include "truetriad/math/rotation.h"

namespace truetriad::trials {

// A unit that is turned slowly six times, once each way about each of its axes, without a rest:
// a magnetometer with a matrix in microtesla per unit field beside an accelerometer and a gyroscope
// in true units.
struct SixTurns {
  int samples = 25'700;
  double rate_hz = 80.0;
  double accelerometer_density = 0.02;  // m/s^2/sqrt(Hz)
  double gyroscope_density = 8.7e-4;    // rad/s/sqrt(Hz)
  double magnetometer_density = 0.003;  // uT/sqrt(Hz)
  double dip_rad = 72.0 * kRadPerDeg;

  TriadModel<double> accelerometer, gyroscope, magnetometer;

  double spacing_s() const { return 1.0 / rate_hz; }
};

inline Eigen::Vector3d UniformVector(double half_width, Random* random) {
  return {half_width * (2.0 * random->Uniform() - 1.0),
          half_width * (2.0 * random->Uniform() - 1.0),
          half_width * (2.0 * random->Uniform() - 1.0)};
}

// Gains within 10 % of 27 uT, skews within 10 deg, rotation within 5 deg; biases of consumer parts.
inline SixTurns DrawSixTurns(Random* random) {
  SixTurns unit;
  unit.accelerometer = {Eigen::Matrix3d::Identity(), UniformVector(0.1, random)};
  unit.gyroscope = {Eigen::Matrix3d::Identity(), UniformVector(0.02, random)};
  const Eigen::Vector3d gain = Eigen::Vector3d::Ones() + UniformVector(0.1, random);
  const Eigen::Vector3d skew = UniformVector(10.0 * kRadPerDeg, random);
  Eigen::Matrix3d axes;
  axes << 1.0, 0.0, 0.0, std::sin(skew[0]), std::cos(skew[0]), 0.0,
      -std::cos(skew[0]) * std::sin(skew[1]), std::sin(skew[2]),
      std::sqrt(1.0 - std::pow(std::cos(skew[0]) * std::sin(skew[1]), 2) -
                std::pow(std::sin(skew[2]), 2));
  const Eigen::Quaterniond rotation = RotationExp(UniformVector(5.0 * kRadPerDeg, random));
  unit.magnetometer = {27.0 * gain.asDiagonal() * axes * rotation.toRotationMatrix(),
                       UniformVector(10.0, random)};
  return unit;
}

// The exact attitude at a share of the recording, in which one turn follows the other.
inline Eigen::Quaterniond SixTurnsAttitude(double share) {
  Eigen::Quaterniond attitude = Eigen::Quaterniond::Identity();
  for (int turn = 0; turn < 6; ++turn) {
    const double done = std::min(std::max(6.0 * share - turn, 0.0), 1.0);
    // From rest to rest, so that rates are smooth: u - sin(2 pi u) / 2 pi.
    const double angle = 2.0 * std::numbers::pi * done - std::sin(2.0 * std::numbers::pi * done);
    // Turns forward go a quarter beyond the full circle, turns backward one full circle, so that
    // every axis comes to be vertical.
    const double whole = turn % 2 == 0 ? 1.25 : -1.0;
    attitude = attitude * RotationExp(whole * angle * Eigen::Vector3d::Unit(turn % 3));
  }
  return attitude;
}

inline Eigen::Vector3d SixTurnsRate(double share, double duration_s) {
  const int turn = std::min(static_cast<int>(6.0 * share), 5);
  const double done = 6.0 * share - turn;
  const double whole = turn % 2 == 0 ? 1.25 : -1.0;
  const double rate =
      2.0 * std::numbers::pi * (1.0 - std::cos(2.0 * std::numbers::pi * done)) * 6.0 / duration_s;
  return whole * rate * Eigen::Vector3d::Unit(turn % 3);
}

// The recording of a unit. `noise`: factor of its noise. `push`: further specific force in the
// world at a time, m/s^2.
template <typename Push>
PoseSet RecordSixTurns(const SixTurns& unit, double noise, Push push, Random* random) {
  PoseSet set;
  set.source = "six turns";
  const double duration_s = (unit.samples - 1) * unit.spacing_s();
  const double root_rate = std::sqrt(unit.rate_hz);
  const Eigen::Vector3d force = ForceInWorld(kStandardGravityMps2);
  const Eigen::Vector3d field = FieldInWorld(1.0, unit.dip_rad, 0.0);
  for (int i = 0; i < unit.samples; ++i) {
    const double share = static_cast<double>(i) / (unit.samples - 1);
    const double time_s = share * duration_s;
    const Eigen::Quaterniond body_from_world = SixTurnsAttitude(share).conjugate();
    const auto add = [&](Triad triad,
                         const TriadModel<double>& model,
                         const Eigen::Vector3d& truth,
                         double density) {
      ReadingTrack& track = set.tracks[triad];
      track.time_ns.push_back(std::llround(1e9 * i * unit.spacing_s()));
      track.reading_raw.emplace_back(model.RawFromTruth(truth) +
                                     noise * density * root_rate * random->Normal3());
    };
    add(Triad::kAccelerometer,
        unit.accelerometer,
        body_from_world * (force + push(time_s)),
        unit.accelerometer_density);
    add(Triad::kGyroscope, unit.gyroscope, SixTurnsRate(share, duration_s), unit.gyroscope_density);
    add(Triad::kMagnetometer,
        unit.magnetometer,
        body_from_world * field,
        unit.magnetometer_density);
  }
  for (const Triad triad : kTriads) {
    StreamSummary stream;
    stream.triad = triad;
    stream.unit = {std::string(TruthUnitName(triad)), 1.0, false};
    stream.samples = unit.samples;
    stream.rate_hz = unit.rate_hz;
    stream.minimum_raw.setConstant(-1e9);
    stream.maximum_raw.setConstant(1e9);
    set.streams.push_back(stream);
  }
  return set;
}

// Options as an experiment states them: the noise is known, and with `held` the matrices of
// accelerometer and gyroscope are held.
inline CalibrateOptions SixTurnsOptions(const SixTurns& unit, bool held, double spacing_s) {
  CalibrateOptions options;
  options.motion = MotionOptions{spacing_s};
  options.cross_validation_folds = 0;
  options.robust.enabled = false;
  options.reference.gravity_mps2 = {kStandardGravityMps2, 0.0};
  options.reference.field_ut = {1.0, 0.0};
  options.check_units = false;  // A field of 1 uT is not real.
  const double root_rate = std::sqrt(unit.rate_hz);
  for (const auto& [triad, density] :
       {std::pair(Triad::kAccelerometer, unit.accelerometer_density),
        std::pair(Triad::kGyroscope, unit.gyroscope_density),
        std::pair(Triad::kMagnetometer, unit.magnetometer_density)}) {
    TriadOptions& sensor = options.triads[triad];
    sensor.enabled = true;
    sensor.excess = ExcessNoise::kNone;
    sensor.noise_sigma_raw = Eigen::Vector3d::Constant(density * root_rate);
    if (held && triad != Triad::kMagnetometer) {
      sensor.fixed_sensitivity = Eigen::Matrix3d::Identity();
    }
  }
  return options;
}

// Errors of one unit in the order of the covariance's list, which begins with each sensor's bias
// and the rows of its matrix and ends with the dip.
inline Eigen::VectorXd SixTurnsErrors(const SixTurns& unit, const Calibration& found) {
  Eigen::VectorXd error = Eigen::VectorXd::Zero(found.covariance.matrix.rows());
  const PerTriad<TriadModel<double>> truth{{unit.accelerometer, unit.gyroscope, unit.magnetometer}};
  Eigen::Index at = 0;
  for (const Triad triad : kTriads) {
    const TriadModel<double>& model = found.sensors[triad]->model;
    error.segment<3>(at) = model.bias - truth[triad].bias;
    const Eigen::Matrix3d by_rows = (model.sensitivity - truth[triad].sensitivity).transpose();
    error.segment<9>(at + 3) = by_rows.reshaped();
    at += 12;
  }
  if (at < error.size()) error[at] = *found.reference.dip_rad - unit.dip_rad;
  return error;
}

// e^T Cov^+ e and its degrees of freedom, the number of entries that are not held.
struct JointError {
  double chi2 = 0.0;
  double dof = 0.0;
};
inline JointError JointErrorOf(const Eigen::VectorXd& error, const Eigen::MatrixXd& covariance) {
  std::vector<Eigen::Index> free;
  for (Eigen::Index i = 0; i < error.size(); ++i) {
    if (covariance(i, i) > 0.0) free.push_back(i);
  }
  const Eigen::MatrixXd block = covariance(free, free);
  const Eigen::VectorXd inverse_sigma = block.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::VectorXd scaled = inverse_sigma.cwiseProduct(error(free).eval());
  const Eigen::MatrixXd correlation =
      inverse_sigma.asDiagonal() * block * inverse_sigma.asDiagonal();
  return {scaled.dot(PivotedCholesky(correlation).SolveVector(scaled)),
          static_cast<double>(free.size())};
}

}  // namespace truetriad::trials
