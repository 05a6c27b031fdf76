// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "math/fast_random.h"
#include "sim/chamber.h"
#include "truetriad/sim/scenario.h"

namespace truetriad {

/// The noise of one triad, sample after sample at its rate: exact discretisations of the three
/// processes of SensorNoise, in the raw unit.
class NoiseProcess {
 public:
  NoiseProcess(const SimulatedTriad& triad, std::uint64_t seed, int unit, Triad kind);

  Eigen::Vector3d Next() {
    Eigen::Vector3d noise = Eigen::Vector3d::Zero();
    if (has_white_) noise += white_sigma_.cwiseProduct(white_.Normal3());
    wander_ = instability_value_ + walk_value_;
    if (has_instability_) {
      noise += instability_value_;
      instability_value_ = instability_decay_ * instability_value_ +
                           instability_step_.cwiseProduct(instability_.Normal3());
    }
    if (has_walk_) {
      noise += walk_value_;
      walk_value_ += walk_step_.cwiseProduct(walk_.Normal3());
    }
    return noise;
  }
  /// The part of the last sample's noise that is not white; it acts like an addition to the model's
  /// bias.
  const Eigen::Vector3d& wander() const { return wander_; }

 private:
  Eigen::Vector3d white_sigma_;
  Eigen::Vector3d instability_step_;
  Eigen::Vector3d instability_value_;
  Eigen::Vector3d walk_step_;
  Eigen::Vector3d walk_value_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d wander_ = Eigen::Vector3d::Zero();
  double instability_decay_;
  bool has_white_, has_instability_, has_walk_;
  FastRandom white_, instability_, walk_;
};

/// Converts the true quantity to the readings of the log.
class SimulatedSensor {
 public:
  /// `decimals`: the number of decimals with which readings are written.
  SimulatedSensor(const SimulatedTriad& triad,
                  const TrueTriad& truth,
                  int decimals,
                  std::uint64_t seed,
                  int unit,
                  Triad kind);

  /// The reading of the next sample. Bias and matrix depend on `temperature`.
  Eigen::Vector3d Read(const Eigen::Vector3d& truth,
                       const Eigen::Vector3d& force_mps2,
                       const TemperatureState& temperature);
  /// NoiseProcess::wander of the last sample.
  const Eigen::Vector3d& wander() const { return noise_.wander(); }

 private:
  void SetTemperature(const TemperatureState& temperature);

  TrueTriad truth_;
  TriadModel<double> model_;  ///< At the last temperature.
  TemperatureState temperature_;
  NoiseProcess noise_;
  double resolution_raw_;
  std::optional<Eigen::Vector2d> range_raw_;
  int decimals_;
};

/// The number of decimals with which readings are written. If the resolution is a short decimal
/// number, it is that number's. Otherwise one unit of the last decimal is at most a twentieth of
/// the resolution or of a sample's σ, which adds less than 0.03 % to the variance. Without
/// resolution and noise: RecordingFormat::kShortest.
int ReadingDecimals(double resolution, double noise_sigma);
int ReadingDecimals(const SimulatedTriad& triad);

}  // namespace truetriad
