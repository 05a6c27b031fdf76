// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "truetriad/base/result.h"

namespace truetriad {

/// A candidate for the rotation of a second triad relative to the leading triad.
struct FrameAlignment {
  /// Orthogonal, det ±1: body vector = rotation * (vector in the triad's own ellipsoid frame).
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  /// Cosine of the angle between the two fields; -sin(dip) for field against up.
  double cosine = 0.0;
  double rms = 0.0;  ///< RMS of u^T R m - cosine over the pairs.
};

/// Finds orthogonal R (det = `determinant`, +1 or -1) and cosine c with u_k^T R m_k = c for unit
/// vectors u_k (up, in body) and m_k (field, in the magnetometer's own symmetric-ellipsoid frame).
///
/// Method: homogeneous linear least squares in the nine elements and the cosine, projected to an
/// orthogonal matrix; then Levenberg-Marquardt on SO(3) from that matrix and from the 24 signed
/// axis maps of the wanted determinant. Returns the distinct minima, best first. (R, c) and (-R,
/// -c) explain the same data; the caller asks for each determinant. If `known_cosine` is set, c is
/// fixed at that value. Error (not enough): fewer than 4 pairs or directions that do not determine
/// R.
Result<std::vector<FrameAlignment>> AlignFrames(const std::vector<Eigen::Vector3d>& up_in_body,
                                                const std::vector<Eigen::Vector3d>& field_in_triad,
                                                int determinant,
                                                const double* known_cosine = nullptr);

/// Attitude world <- body from two vector observations, exact for the first. TRIAD;
/// Shuster and Oh 1981, eq. 3-8.
Eigen::Quaterniond TriadAttitude(const Eigen::Vector3d& first_in_world,
                                 const Eigen::Vector3d& second_in_world,
                                 const Eigen::Vector3d& first_in_body,
                                 const Eigen::Vector3d& second_in_body);

}  // namespace truetriad
