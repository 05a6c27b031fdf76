// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

#include "truetriad/base/result.h"
#include "truetriad/model/triad_model.h"
#include "truetriad/problem/options.h"

namespace truetriad {

// Sphere through readings of a triad whose matrix is held: linear in the centre and in
// r^2 - |c|^2, after undoing the matrix.
TriadModel<double> FitBias(const std::vector<Eigen::Vector3d>& readings,
                           const Eigen::Matrix3d& sensitivity);

// Ellipsoid start without up to three readings that alone spoil it, refitted without those whose
// norm error stands out from the others'.
Result<TriadModel<double>> FitModelTrimmed(std::vector<Eigen::Vector3d> readings,
                                           MatrixModel model,
                                           double radius);

// FitKnownField. Error (not enough): the fields lie in one plane.
Result<TriadModel<double>> FitInKnownField(const std::vector<Eigen::Vector3d>& readings,
                                           const std::vector<Eigen::Vector3d>& fields);

}  // namespace truetriad
