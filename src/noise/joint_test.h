// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>

#include <Eigen/Core>

#include "noise/variance_components.h"

namespace truetriad {

// Covariance of the free parameters. Unlike M^-1, it includes the uncertainty of variances that are
// estimated from the same data: Kenward and Roger 1997,
//
//   M^-1 + 2 sum_st Cov(s, t) M^-1 (J^T D Z_s P Z_t D J) M^-1
//
// (the term in second derivatives of V vanishes, V being linear in the variances).
Eigen::MatrixXd AdjustedCovariance(const ExcessEstimate& estimate, const ReducedSystem& system);

// Reference distribution of the joint test of all q free parameters after Kenward and Roger 1997,
// eq. 5 to 9: with e their error and Φ their adjusted covariance, scale * e^T Φ^-1 e / q ~ F(q,
// dof). If no variance was estimated, dof is infinite and scale is 1.
struct JointTest {
  double dof = std::numeric_limits<double>::infinity();
  double scale = 1.0;
};
JointTest KenwardRogerTest(const ExcessEstimate& estimate, const ReducedSystem& system);

// The degrees of freedom of the estimated noise of a graph; infinite if no variance was estimated.
double NoiseDof(const ExcessEstimate& estimate, const PoseGraph& graph);

// The joint test of a part of the parameters: the columns of `tested` span the tested directions of
// the free coordinates. `estimate` may belong to a larger model than `graph`. `system` belongs to
// `graph` with its present variances. scale * -2 log(likelihood ratio) / columns ~ F(columns, dof).
JointTest KenwardRogerTest(const ExcessEstimate& estimate,
                           const ReducedSystem& system,
                           const PoseGraph& graph,
                           const Eigen::MatrixXd& tested);

}  // namespace truetriad
