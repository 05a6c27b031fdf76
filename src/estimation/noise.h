// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "estimation/graph.h"
#include "estimation/reduced_system.h"

namespace truetriad {

// Pose-to-pose excess variance of each triad, true unit squared.
using ExcessVariance = PerTriad<double>;

// Sets every observation's variance to rest + excess * S S^T at the graph's sensitivities.
void ApplyExcess(const ExcessVariance& excess, PoseGraph* graph);

// Variance components by restricted maximum likelihood (Patterson and Thompson 1971) on the
// linearised graph: Fisher scoring with
//
//   score_s  = -1/2 tr(P Z_s) + 1/2 r^T P Z_s P r       Z_s = dV/d excess_s
//   F_st     =  1/2 tr(P Z_s P Z_t)
//
// all traces through the reduced system, so that the cost is linear in the number of poses.
// Rejected observations do not count.
struct ExcessEstimate {
  ExcessVariance variance{};
  // Inverse Fisher information of the components, rows and columns in the order of `triads`.
  std::vector<Triad> triads;
  Eigen::MatrixXd covariance;
  // C_s = sum J^T D Z_s D J, so that d M^-1 / d excess_s = M^-1 C_s M^-1.
  std::vector<Eigen::MatrixXd> sensitivities;
  // J^T D Z_s P Z_t D J for every pair (s, t), row by row.
  std::vector<Eigen::MatrixXd> curvatures;
};
// `floor`: no component goes below it (zero where rest noise keeps the weights finite).
ExcessEstimate EstimateExcess(const std::vector<Triad>& triads,
                              const ExcessVariance& start,
                              const ExcessVariance& floor,
                              PoseGraph* graph,
                              ReducedSystem* system);

// Covariance of the free parameters that allows for the variances having been estimated from the
// same data, which M^-1 alone does not: Kenward and Roger 1997,
//
//   M^-1 + 2 sum_st Cov(s, t) M^-1 (J^T D Z_s P Z_t D J) M^-1
//
// (the term in second derivatives of V vanishes, V being linear in the variances).
Eigen::MatrixXd AdjustedCovariance(const ExcessEstimate& estimate, const ReducedSystem& system);

// Degrees of freedom of an estimated variance: 2 v^2 / Var(v). Satterthwaite 1946.
double ExcessDegreesOfFreedom(const ExcessEstimate& estimate, const PoseGraph& graph, Triad triad);

// Reference distribution of the joint test of all free parameters after Kenward and Roger 1997,
// eq. 5 to 9: with e the error and Φ the adjusted covariance, scale * e^T Φ^-1 e / q ~ F(q, dof).
// Infinite dof, scale 1 when no variance was estimated.
struct JointTest {
  double dof = std::numeric_limits<double>::infinity();
  double scale = 1.0;
};
JointTest KenwardRogerTest(const ExcessEstimate& estimate, const ReducedSystem& system);

// How badly one triad at one pose fits the prediction from everything else: χ² of the deletion
// residual, with `rank` degrees of freedom (what remains after its pose took its share).
struct DeletionTest {
  std::size_t node = 0;
  std::size_t observation = 0;
  double chi2 = 0.0;
  int rank = 0;
};
std::vector<DeletionTest> DeletionTests(const PoseGraph& graph, const ReducedSystem& system);

}  // namespace truetriad
