// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <vector>

#include <Eigen/Core>

#include "truetriad/base/result.h"
#include "truetriad/model/triad_model.h"

namespace truetriad {

/// Calibrates from the extremes of each axis: the bias is half the sum of its largest and smallest
/// reading, the gain half their difference over g; no misalignment. Error (not enough): an axis was
/// not within 45 degrees of up in one reading and of down in another.
Result<TriadModel<double>> SixFaceExtremes(const std::vector<Eigen::Vector3d>& readings,
                                           double gravity_mps2);

/// The signed axis that points up in a rest on a face, by the face's number.
inline constexpr std::array<const char*, 6> kFaceNames = {"+x", "-x", "+y", "-y", "+z", "-z"};

/// Assigns each reading to the face whose signed axis is nearest after an axis-aligned ellipsoid
/// start. Error (bad input): a reading, named by its number from 1, is nearer to one axis than to
/// another by less than 20 degrees. Error (not enough): a face is missing, or no ellipsoid is
/// determined.
Result<std::vector<int>> AssignFaces(const std::vector<Eigen::Vector3d>& readings);

/// Six-position analytic full matrix with nominal forces ±g along each axis:
/// b = mean over opposite faces, column j of S = (y_{+j} - y_{-j}) / (2 g). Several rests of a
/// face are averaged. `faces`: one per reading. Error (not enough): a face is missing.
Result<TriadModel<double>> SixPosition(const std::vector<Eigen::Vector3d>& readings,
                                       const std::vector<int>& faces,
                                       double gravity_mps2);

/// Six-position analytic solution with known forces f_k: delta_k = y_k - f_k;
/// b = mean of delta over the ±z faces, E(:,j) = (delta_{+j} - b) / g or (b - delta_{-j}) / g:
/// z and y from their negative faces, x from its positive one; S = I + E. For readings and forces
/// in the same unit. Order of rows: -z, +z, -y, +y, +x, -x.
TriadModel<double> SixPositionKnownForce(const std::array<Eigen::Vector3d, 6>& readings,
                                         const std::array<Eigen::Vector3d, 6>& forces,
                                         double gravity);

}  // namespace truetriad
