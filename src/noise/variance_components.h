// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "noise/components.h"
#include "solve/reduced_system.h"

namespace truetriad {

// Estimates of variance components by restricted maximum likelihood (REML; Patterson and Thompson
// 1971) on the linearised graph. Far from the optimum, steps are Fisher's, and near it Newton's:
//
//   score_s  = -1/2 tr(P Z_s) + 1/2 r^T P Z_s P r       Z_s = dV/d excess_s
//   F_st     =  1/2 tr(P Z_s P Z_t)
//
// All traces are computed with the reduced system, so that the cost is linear in the number of
// poses. Rejected observations and turns are left out.
struct ExcessEstimate {
  ExcessVariance variance{};
  // Fisher information of the components and its inverse; rows and columns are in the order of
  // `components`. Before StateCurvatures is called, both are only approximate: they are correct to
  // first order in the last steps.
  std::vector<NoiseComponent> components;
  Eigen::MatrixXd fisher, covariance;
  // Set by StateCurvatures. For each component s: C_s = sum J^T D Z_s D J, so that d M^-1 / d
  // excess_s = M^-1 C_s M^-1.
  std::vector<Eigen::MatrixXd> sensitivities;
  // J^T D Z_s P Z_t D J for every pair (s, t), row by row.
  std::vector<Eigen::MatrixXd> curvatures;
};

// The variance component that is furthest from its optimum, which is the one with the largest score
// in units of the score's σ (the root of its information). A component at its floor is at its
// optimum if its score is negative.
struct OffOptimum {
  // If the score is at most this, the component has settled: the variance is off by at most a tenth
  // of its σ, and the error of results is far smaller.
  static constexpr double kMostSigmas = 0.1;

  std::optional<NoiseComponent> component;  // Unset: none is estimated.
  double score_sigmas = 0.0;

  bool IsSettled() const { return !component || score_sigmas <= kMostSigmas; }
};

// Estimates the excess of `components`. `system` belongs to the graph with the variances `start`;
// on return, it has the estimated variances. `before`: an estimate for a similar system, or empty.
// `floor`: least value of each component (zero if rest noise keeps the weights finite).
ExcessEstimate EstimateExcess(const std::vector<NoiseComponent>& components,
                              const ExcessEstimate& before,
                              const ExcessVariance& start,
                              const ExcessVariance& floor,
                              PoseGraph* graph,
                              ReducedSystem* system);

// The component of `estimate` that is furthest from its optimum. `system` belongs to the graph with
// the variances of `estimate`.
OffOptimum FurthestOff(const ExcessEstimate& estimate,
                       const ExcessVariance& floor,
                       const PoseGraph& graph,
                       const ReducedSystem& system);

// tr(P Z_s) and the Fisher information at the graph's variances; `system`: that of `graph`.
struct VarianceTraces {
  Eigen::VectorXd traces;
  Eigen::MatrixXd fisher;
};
VarianceTraces TracesOf(const std::vector<NoiseComponent>& components,
                        const PoseGraph& graph,
                        const ReducedSystem& system);

// Sets the Fisher information, sensitivities and curvatures of an estimate at its variances.
// `system`: that of `graph` after EstimateExcess.
void StateCurvatures(const PoseGraph& graph, const ReducedSystem& system, ExcessEstimate* estimate);

// Degrees of freedom of an estimated variance: 2 v^2 / Var(v). Satterthwaite 1946.
double ExcessDegreesOfFreedom(const ExcessEstimate& estimate,
                              const PoseGraph& graph,
                              NoiseComponent component);

}  // namespace truetriad
