// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "problem/parameter_name.h"
#include "support/accel_mag_trials.h"
#include "truetriad/calibrate/calibrate.h"
#include "truetriad/model/calibration.h"

namespace truetriad::trials {

inline constexpr std::array kStaticTriads = {Triad::kAccelerometer, Triad::kMagnetometer};
inline constexpr std::array kSoakDegc = {-20.0, 0.0, 25.0, 45.0, 65.0};
inline constexpr double kReferenceDegc = 25.0;

// A unit with temperature terms, in a chamber.
struct Soak {
  SyntheticUnit unit;
  PerTriad<std::optional<ThermalTerms>> thermal;
  std::vector<Eigen::Quaterniond> attitudes;
  std::vector<double> temperatures_degc, rates_degcps;
  CalibrateOptions options;
};

inline Eigen::Matrix3d RandomMatrix(Random* random) {
  return Eigen::Matrix3d::NullaryExpr([random] { return random->Normal(); });
}

// Random terms: over the range biases drift by about 2 % of the signal, and gains by about 1 %.
inline ThermalTerms RandomTerms(const ThermalOptions& terms, double strength, Random* random) {
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
  if (terms.rate[RateTerm::kLinear]) thermal.rate[RateTerm::kLinear] = per_rate * random->Normal3();
  if (terms.rate[RateTerm::kQuadratic])
    thermal.rate[RateTerm::kQuadratic] = per_rate / 0.02 * random->Normal3();
  if (terms.rate[RateTerm::kCross])
    thermal.rate[RateTerm::kCross] = per_rate / kSpanDegc * random->Normal3();
  return thermal;
}

// `attitudes_each` attitudes at each chamber temperature, gauge `accel-x`.
inline Soak MakeSoak(const ThermalOptions& terms, int attitudes_each, bool joint, Random* random) {
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
  // The body frame is that of the accelerometer at every temperature.
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
      soak.rates_degcps.push_back(terms.rate.any() ? random->Uniform(-0.02, 0.02) : 0.0);
    }
  }
  return soak;
}

// The poses that the estimator is given, with noise by `noise` and covariances by `stated`.
inline PoseSet PosesOf(const Soak& soak,
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

inline PoseSet ExactSoakPoses(const Soak& soak) {
  Random unused(0);
  return PosesOf(soak, SyntheticNoise{}, ModelNoise(), &unused);
}

// Estimate minus truth, in the order of the covariance, of every entry of a sensor's model and of
// the dip; NaN for other parameters.
inline Eigen::VectorXd SoakErrors(const Calibration& calibration, const Soak& soak) {
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
      if (const auto rate = InfoOf(name->kind).rate) return (*thermal->rate[*rate])[name->row];
      return name->kind == ParameterKind::kBias
                 ? (name->power > 0 ? thermal->bias[term] : model.bias)[name->row]
                 : (name->power > 0 ? thermal->sensitivity[term] : model.sensitivity)(name->row,
                                                                                      name->col);
    };
    const TriadCalibration& sensor = *calibration.sensors[name->triad];
    error = value(sensor.model, sensor.thermal) -
            value(*soak.unit.models[name->triad], soak.thermal[name->triad]);
  }
  return errors;
}

}  // namespace truetriad::trials
