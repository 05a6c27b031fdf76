// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "math/fast_random.h"
#include "sim/chamber.h"
#include "truetriad/sim/scenario.h"
#include "truetriad/sim/simulation.h"

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
  /// The part of the last sample's noise that is not white: the bias less the model's.
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
  /// `decimals`: those the readings are written with.
  SimulatedSensor(const SimulatedTriad& triad,
                  const TrueTriad& truth,
                  int decimals,
                  std::uint64_t seed,
                  int unit,
                  Triad kind);

  /// The next sample. `temperature` is that on which bias and matrix depend.
  Eigen::Vector3d Read(const Eigen::Vector3d& truth,
                       const Eigen::Vector3d& force_mps2,
                       const TemperatureState& temperature);
  /// NoiseProcess::wander of it.
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

/// Decimals with which a reading is written: all of a resolution that is a short decimal number,
/// else so many that a step is within a twentieth of the resolution or of one sample's noise (it
/// then adds less than 0.03 % to the noise's variance); RecordingFormat::kShortest without either.
int ReadingDecimals(double resolution, double noise_sigma);
int ReadingDecimals(const SimulatedTriad& triad);

}  // namespace truetriad
