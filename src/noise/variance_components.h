// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "noise/components.h"
#include "solve/reduced_system.h"

namespace truetriad {

// Variance components by restricted maximum likelihood (Patterson and Thompson 1971) on the
// linearised graph: Fisher scoring, and near the optimum Newton's method, with
//
//   score_s  = -1/2 tr(P Z_s) + 1/2 r^T P Z_s P r       Z_s = dV/d excess_s
//   F_st     =  1/2 tr(P Z_s P Z_t)
//
// All traces are computed with the reduced system, so that the cost is linear in the number of
// poses. Rejected observations and turns are left out.
struct ExcessEstimate {
  ExcessVariance variance{};
  // Fisher information of the components and its inverse, rows and columns in the order of
  // `components`. Until StateCurvatures is called, they are accurate only to first order in the
  // last steps.
  std::vector<NoiseComponent> components;
  Eigen::MatrixXd fisher, covariance;
  // StateCurvatures sets these. C_s = sum J^T D Z_s D J, so that d M^-1 / d excess_s = M^-1 C_s
  // M^-1.
  std::vector<Eigen::MatrixXd> sensitivities;
  // J^T D Z_s P Z_t D J for every pair (s, t), row by row.
  std::vector<Eigen::MatrixXd> curvatures;
};

// The component furthest from its optimum: its score in units of the score's σ, the root of the
// component's information. A component at its floor is at its optimum if its score is negative.
struct OffOptimum {
  // If the score is at most this, the component has settled: its variance is off by at most a tenth
  // of its σ, results by far less.
  static constexpr double kMostSigmas = 0.1;

  std::optional<NoiseComponent> component;  // Unset: there is none.
  double score_sigmas = 0.0;

  bool IsSettled() const { return !component || score_sigmas <= kMostSigmas; }
};

// `system` belongs to the graph with the variances `start`; on return, it has the estimated
// variances. `before`: an estimate for a similar system, or empty. `floor`: least value of each
// component (zero if rest noise keeps the weights finite).
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

// tr(P Z_s) and the Fisher information at the graph's variances; `system`: of the graph.
struct VarianceTraces {
  Eigen::VectorXd traces;
  Eigen::MatrixXd fisher;
};
VarianceTraces TracesOf(const std::vector<NoiseComponent>& components,
                        const PoseGraph& graph,
                        const ReducedSystem& system);

// Sets the Fisher information, sensitivities and curvatures of an estimate at its variances;
// `system`: of the graph after EstimateExcess.
void StateCurvatures(const PoseGraph& graph, const ReducedSystem& system, ExcessEstimate* estimate);

// Degrees of freedom of an estimated variance: 2 v^2 / Var(v). Satterthwaite 1946.
double ExcessDegreesOfFreedom(const ExcessEstimate& estimate,
                              const PoseGraph& graph,
                              NoiseComponent component);

}  // namespace truetriad
