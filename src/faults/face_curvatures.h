// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include <Eigen/Core>

#include "faults/search.h"

namespace truetriad {

// A fault that stands for what linearisation neglects in readings on stated faces. A reading r of S
// u(t) is not linear, since the sensitivity S and the tilts t of the face are both unknown. H_r are
// its second derivatives with respect to the free coordinates; the errors d of these coordinates
// have the covariance P. The neglected error d^T H_r d / 2 has the mean tr(H_r P) / 2. The errors
// of two readings r and s have the covariance tr(H_r P H_s P) / 2 (products of normal errors). The
// fault's unknowns are independent combinations of these errors. The tilt of a pose on its face has
// only a tenth of the face's σ, so that it is linearised. Unset if there are no stated faces.
std::optional<StatedFault> FaceCurvatures(const PoseGraph& graph,
                                          const Eigen::MatrixXd& covariance);

}  // namespace truetriad
