// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

#include "math/dense/cholesky.h"

namespace truetriad::line {

// Of units that are columns, each row in robust σ about its median.

/// Centre and the root of the covariance about it.
struct CentreAndRoot {
  Eigen::VectorXd centre;
  Cholesky root;
  double count = 0.0;  ///< Units that it is from.
};
CentreAndRoot MomentsOf(const Eigen::MatrixXd& values, const std::vector<Eigen::Index>& some);

/// Mahalanobis distances, squared.
Eigen::VectorXd SquaredDistances(const Eigen::MatrixXd& values, const CentreAndRoot& about);

/// Centre and covariance of the three quarters of the units that are nearest to each other, scaled
/// so that the median distance of all is that of normal values: from some starts that chance has no
/// part in (as Hubert, Rousseeuw and Verdonck 2012 do) the units with the smallest distances, found
/// again and again (Rousseeuw and Van Driessen 1999); of these cores the one of the least
/// determinant. Of many units some 5,000 are looked at. Its root is not positive where most units
/// are the same in some direction.
CentreAndRoot RobustCore(const Eigen::MatrixXd& values);

}  // namespace truetriad::line
