// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "problem/graph.h"
#include "solve/reduced_system.h"

namespace truetriad {

// Noise that comes on top of what the samples of a pose or of a turn show by themselves: of each
// triad's pose means, of the gyroscope's means at known rates, and of the turns between poses.
enum class NoiseComponent { kAccelerometer, kGyroscope, kMagnetometer, kRate, kTurn };
inline constexpr std::size_t kNoiseComponents = 5;
constexpr NoiseComponent PoseNoise(Triad triad) {
  return triad == Triad::kAccelerometer ? NoiseComponent::kAccelerometer
         : triad == Triad::kGyroscope   ? NoiseComponent::kGyroscope
                                        : NoiseComponent::kMagnetometer;
}

// The triad whose pose means it belongs to; unset for rates and turns.
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

// The component of an observation; unset where the operator alone says how well it is known.
std::optional<NoiseComponent> ComponentOf(const PoseNode& node, const Observation& observation);

// Sets every observation's variance to rest + S (excess + that of a known rate) S^T at the graph's
// sensitivities, and every turn's to that of its readings + excess + what is stated.
void ApplyExcess(const ExcessVariance& excess, PoseGraph* graph);

// Variance components by restricted maximum likelihood (Patterson and Thompson 1971) on the
// linearised graph: Fisher scoring, and near the optimum Newton's method, with
//
//   score_s  = -1/2 tr(P Z_s) + 1/2 r^T P Z_s P r       Z_s = dV/d excess_s
//   F_st     =  1/2 tr(P Z_s P Z_t)
//
// all traces through the reduced system, so that the cost is linear in the number of poses.
// Rejected observations and turns do not count.
struct ExcessEstimate {
  ExcessVariance variance{};
  // Fisher information of the components and its inverse, rows and columns in the order of
  // `components`; good to first order in the last steps until StateCurvatures was called.
  std::vector<NoiseComponent> components;
  Eigen::MatrixXd fisher, covariance;
  // StateCurvatures sets these. C_s = sum J^T D Z_s D J, so that d M^-1 / d excess_s = M^-1 C_s
  // M^-1.
  std::vector<Eigen::MatrixXd> sensitivities;
  // J^T D Z_s P Z_t D J for every pair (s, t), row by row.
  std::vector<Eigen::MatrixXd> curvatures;
};
// `system`: of the graph as it is, with the variances `start`; in the end with those found.
// `before`: an estimate of a system like this one, or empty. `floor`: no component goes below it
// (zero where rest noise keeps the weights finite).
ExcessEstimate EstimateExcess(const std::vector<NoiseComponent>& components,
                              const ExcessEstimate& before,
                              const ExcessVariance& start,
                              const ExcessVariance& floor,
                              PoseGraph* graph,
                              ReducedSystem* system);

// Completes an estimate at its variances; `system`: the graph as EstimateExcess left it.
void StateCurvatures(const PoseGraph& graph, const ReducedSystem& system, ExcessEstimate* estimate);

// Mean over what is accepted of a component's variance without excess, true unit squared.
double MeanKnownVariance(const PoseGraph& graph, NoiseComponent component);

// Covariance of the free parameters that allows for the variances having been estimated from the
// same data, which M^-1 alone does not: Kenward and Roger 1997,
//
//   M^-1 + 2 sum_st Cov(s, t) M^-1 (J^T D Z_s P Z_t D J) M^-1
//
// (the term in second derivatives of V vanishes, V being linear in the variances).
Eigen::MatrixXd AdjustedCovariance(const ExcessEstimate& estimate, const ReducedSystem& system);

// Degrees of freedom of an estimated variance: 2 v^2 / Var(v). Satterthwaite 1946.
double ExcessDegreesOfFreedom(const ExcessEstimate& estimate,
                              const PoseGraph& graph,
                              NoiseComponent component);

// Reference distribution of the joint test of all free parameters after Kenward and Roger 1997,
// eq. 5 to 9: with e the error and Φ the adjusted covariance, scale * e^T Φ^-1 e / q ~ F(q, dof).
// Infinite dof, scale 1 when no variance was estimated.
struct JointTest {
  double dof = std::numeric_limits<double>::infinity();
  double scale = 1.0;
};
JointTest KenwardRogerTest(const ExcessEstimate& estimate, const ReducedSystem& system);

// The same for some of them: `tested` spans, by its columns, the directions of the free coordinates
// that are tested; the variances may come from a larger model than `graph`, with whose present
// variances `system` was made. scale * -2 log(likelihood ratio) / columns ~ F(columns, dof).
JointTest KenwardRogerTest(const ExcessEstimate& estimate,
                           const ReducedSystem& system,
                           const PoseGraph& graph,
                           const Eigen::MatrixXd& tested);

// A rejected observation keeps this weight: nothing against the rest (an error of 1000 σ moves the
// fit by 1e-5 σ), but its pose stays determined.
inline constexpr double kRejectedWeight = 1e-8;

// How badly one triad at one pose, or one turn, fits the prediction from everything else: χ² of the
// deletion residual, with `rank` degrees of freedom (what remains after its pose took its share).
struct DeletionTest {
  NoiseComponent component = NoiseComponent::kAccelerometer;
  std::size_t node = 0;         // of a turn the first
  std::size_t observation = 0;  // of a turn: which increment
  double chi2 = 0.0;
  int rank = 0;
};
// Those of the poses in order, observation by observation, then those of the turns.
std::vector<DeletionTest> DeletionTests(const PoseGraph& graph, const ReducedSystem& system);

}  // namespace truetriad
