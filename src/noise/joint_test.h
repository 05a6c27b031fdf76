// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>

#include <Eigen/Core>

#include "noise/variance_components.h"

namespace truetriad {

// Covariance of the free parameters. Unlike M^-1, it includes the uncertainty of the variances,
// which are estimated from the same data: Kenward and Roger 1997. With the variance components s
// and t:
//
//   M^-1 + 2 sum_st Cov(s, t) M^-1 (J^T D Z_s P Z_t D J) M^-1
//
// V is linear in the variances, so that there is no term in second derivatives of V.
Eigen::MatrixXd AdjustedCovariance(const ExcessEstimate& estimate, const ReducedSystem& system);

// Distribution of the joint test of all q free parameters after Kenward and Roger 1997, eq. 5 to 9.
// If the parameters have the error e and the adjusted covariance Φ, scale * e^T Φ^-1 e / q ~ F(q,
// dof). If no variance was estimated, dof is infinite and scale is 1.
struct JointTest {
  double dof = std::numeric_limits<double>::infinity();
  double scale = 1.0;
};
JointTest KenwardRogerTest(const ExcessEstimate& estimate, const ReducedSystem& system);

// The degrees of freedom of the estimated noise of a graph; infinite if no variance was estimated.
double NoiseDof(const ExcessEstimate& estimate, const PoseGraph& graph);

// The joint test of some of the parameters: of n directions of the free coordinates, the columns of
// `tested`. scale * -2 log(likelihood ratio) / n ~ F(n, dof). `estimate` may belong to a larger
// model than `graph`; `system` belongs to `graph` with its present variances.
JointTest KenwardRogerTest(const ExcessEstimate& estimate,
                           const ReducedSystem& system,
                           const PoseGraph& graph,
                           const Eigen::MatrixXd& tested);

}  // namespace truetriad
