// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

#include "truetriad/base/result.h"
#include "truetriad/model/triad_model.h"
#include "truetriad/problem/options.h"

namespace truetriad {

// Fits the bias of a triad whose matrix is fixed. After multiplication by the inverse matrix, the
// readings lie on a sphere, and the problem is linear in its centre c and in r^2 - |c|^2.
TriadModel<double> FitBias(const std::vector<Eigen::Vector3d>& readings,
                           const Eigen::Matrix3d& sensitivity);

// Fits an ellipsoid twice: first without up to three outliers that keep the other readings from
// fitting, then also without readings whose norm error exceeds 6 σ.
Result<TriadModel<double>> FitModelTrimmed(std::vector<Eigen::Vector3d> readings,
                                           MatrixModel model,
                                           double radius);

// Like FitKnownField (init/fixture_fit.h), but returns an error (not enough) if the fields lie in
// one plane.
Result<TriadModel<double>> FitInKnownField(const std::vector<Eigen::Vector3d>& readings,
                                           const std::vector<Eigen::Vector3d>& fields);

}  // namespace truetriad
