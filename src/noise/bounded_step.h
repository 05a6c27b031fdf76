// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

namespace truetriad {

// The inverse of an information matrix, scaled to unit diagonal first: variances of turns (rad^2)
// and of magnetometers (uT^2) differ by so much that elimination would take small pivots for zeros.
Eigen::MatrixXd BalancedInverse(const Eigen::MatrixXd& information);

// The step to the maximum of a likelihood with this score and (positive definite) information,
// among the steps with no component below its limit (≤ 0),
//
//   max score^T d - 1/2 d^T information d      d >= limit
//
// by an active set: Lawson and Hanson 1974, ch. 23.
Eigen::VectorXd StepAbove(const Eigen::VectorXd& limit,
                          const Eigen::MatrixXd& information,
                          const Eigen::VectorXd& score);

}  // namespace truetriad
