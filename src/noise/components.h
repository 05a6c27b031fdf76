// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "problem/graph.h"

namespace truetriad {

// Kinds of excess noise. Excess noise is added to the noise that the samples within a pose or a
// turn show. There is one kind for each triad's pose means, one for the gyroscope's means at known
// rates, and one for the turns between poses.
enum class NoiseComponent { kAccelerometer, kGyroscope, kMagnetometer, kRate, kTurn };
inline constexpr std::size_t kNoiseComponents = 5;  // the values of NoiseComponent
constexpr NoiseComponent PoseNoise(Triad triad) {
  return triad == Triad::kAccelerometer ? NoiseComponent::kAccelerometer
         : triad == Triad::kGyroscope   ? NoiseComponent::kGyroscope
                                        : NoiseComponent::kMagnetometer;
}

// The triad whose pose means have this noise; unset for rates and turns.
constexpr std::optional<Triad> TriadOf(NoiseComponent component) {
  for (const Triad triad : kTriads) {
    if (PoseNoise(triad) == component) return triad;
  }
  return std::nullopt;
}
// "accelerometer", …, "rates", "turns".
std::string NoiseComponentName(NoiseComponent component);

// Excess variance of each component: pose means in true unit squared, turns in rad^2.
struct ExcessVariance {
  std::array<double, kNoiseComponents> items{};
  double& operator[](NoiseComponent component) {
    return items[static_cast<std::size_t>(component)];
  }
  double operator[](NoiseComponent component) const {
    return items[static_cast<std::size_t>(component)];
  }
  double& operator[](Triad triad) { return (*this)[PoseNoise(triad)]; }
  double operator[](Triad triad) const { return (*this)[PoseNoise(triad)]; }
};

// The noise component of an observation; unset for moments of motion and for mean rates of turns.
std::optional<NoiseComponent> ComponentOf(const PoseNode& node, const Observation& observation);

// Sets all variances. That of an observation is rest + S (excess + variance of the known rate) S^T,
// with the graph's sensitivity S. That of a turn is the sum of the variance of its readings, its
// excess and its stated variance.
void ApplyExcess(const ExcessVariance& excess, PoseGraph* graph);

// The mean variance of a component's accepted observations without the excess, true unit squared.
double MeanKnownVariance(const PoseGraph& graph, NoiseComponent component);

// The rows of a factor that have a common variance. Their covariance is V = known + excess * unit,
// divided by the robust weight.
struct VariancePart {
  std::size_t factor = 0;
  Eigen::Index row = 0;
  NoiseComponent component = NoiseComponent::kAccelerometer;
  std::size_t index = 0;  // index of the observation in its node, or of the increment
  Eigen::Matrix3d unit = Eigen::Matrix3d::Identity();
  Eigen::Matrix3d variance = Eigen::Matrix3d::Identity();
  double weight = 1.0;
  bool rejected = false;
};

// All parts, in the order of the factors. `unit` is computed with the graph's sensitivities.
std::vector<VariancePart> PartsOf(const PoseGraph& graph);

}  // namespace truetriad
