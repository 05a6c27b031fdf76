// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "noise/noise_settling.h"
#include "problem/graph.h"
#include "truetriad/model/finding.h"
#include "truetriad/problem/options.h"

namespace truetriad {

// Whether the readings contradict the dip that is stated, as they say it with the dip free. Held to
// a wrong one they scatter over the poses, as if something else had changed. Unset where they do
// not, or do not tell it.
std::optional<Finding> FindContradictedDip(const CalibrateOptions& options,
                                           const NoiseState& noise,
                                           const PoseGraph& solved);

}  // namespace truetriad
