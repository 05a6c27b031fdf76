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
  /// Ratio of smallest to largest singular value of the design matrix (a row of squares, products
  /// and coordinates per point) in the frame in which the fitted ellipsoid is the unit sphere. 0.3
  /// for directions all over the sphere; near zero if the points do not determine the ellipsoid.
  double conditioning = 0.0;
  double relative_rms = 0.0;  ///< RMS of |A^1/2 (y - centre)| - 1 over the points.
  /// Radii along the axes, for an axis-aligned fit.
  Eigen::Vector3d AxisRadii() const { return shape.diagonal().cwiseInverse().cwiseSqrt(); }
};

/// A six-parameter fit with axes along x, y, z. Needs 6 points. It is the linear least-squares
/// solution of a x^2 + b y^2 + c z^2 + d x + e y + f z = 1 on centred and scaled data. It is
/// repeated with the centre and the radii just found until they converge, so that offset and units
/// of the data do not matter. Error (bad input): a point that is not finite. Error (not enough):
/// too few points, coplanar points, not an ellipsoid.
Result<Ellipsoid> FitAxisAlignedEllipsoid(const std::vector<Eigen::Vector3d>& points);

/// Nine-parameter fit with the ellipsoid constraint 4 J > I^2 enforced (Li and Griffiths 2004), on
/// centred and scaled data, repeated in the frame where the ellipsoid found is a sphere. A second
/// fit is made without the constraint, and the fit with the smaller geometric residual is returned.
/// Needs 9 points. Errors as above; also an error (not enough) if `conditioning` is below
/// `relative_rms`, since the ellipsoid then follows from scatter, not from the shape of the cloud.
Result<Ellipsoid> FitEllipsoid(const std::vector<Eigen::Vector3d>& points);

/// Symmetric sensitivity S with |S^-1 (y - centre)| = radius for every y on the ellipsoid: S S^T =
/// radius^-2 A^-1. Diagonal positive. Fails a CHECK unless `radius` > 0 and shape positive
/// definite.
Eigen::Matrix3d SymmetricSensitivity(const Ellipsoid& ellipsoid, double radius);

}  // namespace truetriad
