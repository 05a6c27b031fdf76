// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

#include "truetriad/base/result.h"

namespace truetriad {

/// An ellipsoid (y - centre)^T A (y - centre) = 1, A symmetric positive definite.
struct Ellipsoid {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  Eigen::Matrix3d shape = Eigen::Matrix3d::Identity();  ///< A.
  /// Ratio of smallest to largest singular value of the (scaled, centred) design matrix without
  /// its null direction: near zero when the points do not determine the ellipsoid.
  double conditioning = 0.0;
  /// Radii along the axes, for an axis-aligned fit.
  Eigen::Vector3d AxisRadii() const { return shape.diagonal().cwiseInverse().cwiseSqrt(); }
};

/// Six-parameter fit, axes along x, y, z. Needs 6 points. The linear least-squares solution of
/// a x^2 + b y^2 + c z^2 + d x + e y + f z = 1 on centred and scaled data.
/// Error (not enough): too few points, coplanar points, not an ellipsoid.
Result<Ellipsoid> FitAxisAlignedEllipsoid(const std::vector<Eigen::Vector3d>& points);

/// Nine-parameter fit with the ellipsoid constraint kJ > I^2 enforced (Li and Griffiths 2004), on
/// centred and scaled data. Needs 9 points.
Result<Ellipsoid> FitEllipsoid(const std::vector<Eigen::Vector3d>& points);

/// Sensitivity S with |S^-1 (y - centre)| = radius for every y on the ellipsoid:
/// S S^T = radius^-2 A^-1.
Eigen::Matrix3d LowerTriangularSensitivity(const Ellipsoid& ellipsoid, double radius);
Eigen::Matrix3d UpperTriangularSensitivity(const Ellipsoid& ellipsoid, double radius);
Eigen::Matrix3d SymmetricSensitivity(const Ellipsoid& ellipsoid, double radius);

}  // namespace truetriad
