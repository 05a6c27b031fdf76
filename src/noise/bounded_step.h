// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

namespace truetriad {

// Inverts an information matrix, after scaling it to unit diagonal. Variances of turns (rad^2) and
// of magnetometers (uT^2) differ so much that without scaling, small pivots would pass for zeros.
Eigen::MatrixXd BalancedInverse(const Eigen::MatrixXd& information);

// The step to the maximum of a likelihood with this score and (positive definite) information. Only
// steps are allowed whose components are not below their limits (≤ 0):
//
//   max score^T d - 1/2 d^T information d      d >= limit
//
// The method is an active set: Lawson and Hanson 1974, ch. 23.
Eigen::VectorXd StepAbove(const Eigen::VectorXd& limit,
                          const Eigen::MatrixXd& information,
                          const Eigen::VectorXd& score);

}  // namespace truetriad
