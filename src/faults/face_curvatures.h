// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include <Eigen/Core>

#include "faults/search.h"

namespace truetriad {

// One fault that stands for what the linear model leaves out of readings on stated faces. With
// tilts t of a face and S both unknown, reading r of S u(t) has second derivatives H_r by the free
// coordinates, whose covariance is P, and is off by d^T H_r d / 2: by tr(H_r P) / 2 on average,
// with covariances tr(H_r P H_s P) / 2 (of products of normal errors). The fault's unknowns are the
// axes in which these are independent. A seat is ten times better known than a face, so that it
// counts as linear. Unset where faces are not stated.
std::optional<StatedFault> FaceCurvatures(const PoseGraph& graph,
                                          const Eigen::MatrixXd& covariance);

}  // namespace truetriad
