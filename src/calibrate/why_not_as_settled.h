// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "noise/noise_settling.h"
#include "problem/graph.h"
#include "truetriad/model/finding.h"
#include "truetriad/problem/options.h"

namespace truetriad {

// Why a solution must be refused though it looks settled; unset if there is no reason:
//
//   The readings contradict the stated dip, as a solution with a free dip shows. With a wrong dip
//   the residuals scatter over the poses, as if something else had changed.
//
//   Another alignment of accelerometer and magnetometer explains the poses as well: if few poses
//   have both sensors, the constant angle between gravity and field has several solutions, each
//   locally determined. Turns or given attitudes determine the alignment. Or no alignment explains
//   them: the angle is not constant.
std::optional<Finding> WhyNotAsSettled(const CalibrateOptions& options,
                                       const NoiseState& noise,
                                       const PoseGraph& solved);

}  // namespace truetriad
