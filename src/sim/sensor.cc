// SPDX-License-Identifier: Apache-2.0
#include "sim/sensor.h"

#include <algorithm>
#include <cmath>

#include "sim/seeds.h"
#include "truetriad/model/calibration.h"

namespace truetriad {

NoiseProcess::NoiseProcess(const SimulatedTriad& triad, std::uint64_t seed, int unit, Triad kind)
    : has_white_((triad.noise.density.array() > 0.0).any()),
      has_instability_((triad.noise.instability_sigma.array() > 0.0).any()),
      has_walk_((triad.noise.random_walk.array() > 0.0).any()),
      white_(TriadRandom(seed, unit, Purpose::kWhiteNoise, kind)),
      instability_(TriadRandom(seed, unit, Purpose::kBiasInstability, kind)),
      walk_(TriadRandom(seed, unit, Purpose::kRandomWalk, kind)) {
  const SensorNoise& noise = triad.noise;
  const double rate_hz = triad.sampling.rate_hz;
  const Eigen::Vector3d gain = triad.nominal.sensitivity.diagonal().cwiseAbs();
  white_sigma_ = std::sqrt(rate_hz) * gain.cwiseProduct(noise.density);
  walk_step_ = gain.cwiseProduct(noise.random_walk) / std::sqrt(rate_hz);
  // x' = phi x + sigma sqrt(1 - phi^2) w keeps the variance; -expm1 keeps 1 - phi^2 accurate if phi
  // is near 1.
  const double steps = 1.0 / (rate_hz * noise.correlation_time_s);
  const Eigen::Vector3d sigma = gain.cwiseProduct(noise.instability_sigma);
  instability_decay_ = std::exp(-steps);
  instability_step_ = std::sqrt(-std::expm1(-2.0 * steps)) * sigma;
  instability_value_ = sigma.cwiseProduct(instability_.Normal3());
}

SimulatedSensor::SimulatedSensor(const SimulatedTriad& triad,
                                 const TrueTriad& truth,
                                 int decimals,
                                 std::uint64_t seed,
                                 int unit,
                                 Triad kind)
    : truth_(truth),
      model_(truth.model),
      noise_(triad, seed, unit, kind),
      resolution_raw_(triad.resolution_raw),
      range_raw_(triad.range_raw),
      decimals_(decimals) {
  if (truth_.thermal) {
    temperature_ = {truth_.thermal->reference_degc, 0.0};
  }
}

void SimulatedSensor::SetTemperature(const TemperatureState& temperature) {
  if (temperature.degc == temperature_.degc &&
      temperature.rate_degcps == temperature_.rate_degcps) {
    return;
  }
  temperature_ = temperature;
  model_ =
      ModelAtTemperature(truth_.model, *truth_.thermal, temperature.degc, temperature.rate_degcps);
}

Eigen::Vector3d SimulatedSensor::Read(const Eigen::Vector3d& truth,
                                      const Eigen::Vector3d& force_mps2,
                                      const TemperatureState& temperature) {
  if (truth_.thermal) SetTemperature(temperature);
  Eigen::Vector3d raw = model_.RawFromTruth(truth) + noise_.Next();
  if (truth_.g_sensitivity) raw += *truth_.g_sensitivity * force_mps2;
  for (double& reading : raw) {
    if (resolution_raw_ > 0.0) {
      reading = WrittenNumber(reading / resolution_raw_, 0) * resolution_raw_;
    }
    if (range_raw_) reading = std::clamp(reading, (*range_raw_)[0], (*range_raw_)[1]);
    reading = WrittenNumber(reading, decimals_);
  }
  return raw;
}

int ReadingDecimals(double resolution, double noise_sigma) {
  // The smallest steps that logs contain, picotesla in tesla, have twelve decimals.
  constexpr int kMost = 12;
  if (resolution <= 0.0 && noise_sigma <= 0.0) return RecordingFormat::kShortest;
  // Rounding to a twentieth of a step or σ adds 1/12/400 to the variance: 0.02 %.
  constexpr double kShare = 20.0;
  const double step = resolution > 0.0 ? resolution : noise_sigma;
  double unit = 1.0;  // 10^-decimals
  int decimals = 0;
  for (; decimals < kMost && unit * kShare > step; ++decimals, unit /= 10.0) {
    const double steps = resolution / unit;
    // The tolerance covers only the rounding of the division, so that 0.1 is one step of 10^-1.
    if (resolution > 0.0 && std::abs(steps - std::round(steps)) < 1e-9 * steps) {
      break;
    }
  }
  return decimals;
}

int ReadingDecimals(const SimulatedTriad& triad) {
  const Eigen::Vector3d sigma =
      std::sqrt(triad.sampling.rate_hz) *
      triad.noise.density.cwiseProduct(triad.nominal.sensitivity.diagonal().cwiseAbs());
  return ReadingDecimals(triad.resolution_raw, sigma.minCoeff());
}

}  // namespace truetriad
