// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include <Eigen/Core>

#include "faults/search.h"

namespace truetriad {

// One fault that stands for what linearisation neglects in readings on stated faces. Since the
// tilts t of a face and the sensitivity S are both unknown, reading r of S u(t) has second
// derivatives H_r by the free coordinates, whose errors d have covariance P. Its error d^T H_r d /
// 2 has the mean tr(H_r P) / 2 and the covariances tr(H_r P H_s P) / 2 (products of normal errors).
// The fault's unknowns are along the axes in which these errors are independent. How a pose is
// seated on its face has a tenth of the face's σ, so that it is taken as linear. Unset without
// stated faces.
std::optional<StatedFault> FaceCurvatures(const PoseGraph& graph,
                                          const Eigen::MatrixXd& covariance);

}  // namespace truetriad
