// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include <Eigen/Core>

#include "faults/search.h"

namespace truetriad {

// One fault for the nonlinear part that linearisation neglects in readings on stated faces. With
// tilts t of a face and S both unknown, reading r of S u(t) has second derivatives H_r by the free
// coordinates, whose covariance is P, and an error d^T H_r d / 2: its mean is tr(H_r P) / 2, its
// covariances are tr(H_r P H_s P) / 2 (products of normal errors). The fault's unknowns are the
// axes in which these are independent. A seat has a tenth of a face's σ, so that it is taken as
// linear. Unset where faces are not stated.
std::optional<StatedFault> FaceCurvatures(const PoseGraph& graph,
                                          const Eigen::MatrixXd& covariance);

}  // namespace truetriad
