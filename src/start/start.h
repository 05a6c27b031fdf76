// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "problem/start_values.h"
#include "truetriad/base/result.h"
#include "truetriad/data/static_pose.h"
#include "truetriad/problem/options.h"

namespace truetriad {

// Error (not enough) when a triad has fewer poses than its wanted model has parameters.
Status CheckPoseCounts(const PoseSet& poses, const CalibrateOptions& options);

// All distinct starts worth trying, best first: one, or several when the magnetometer's rotation
// has rival solutions.
// Error: too few poses for the wanted model, poses that do not determine it (not enough); readings
// that cannot be in the stated unit (bad input).
Result<std::vector<StartValues>> FindStartValues(const PoseSet& poses,
                                                 const CalibrateOptions& options);

// For a magnetometer without stated mounting, beside a gyroscope with one and no accelerometer: the
// options with the magnetometer's axis map that brings the gyroscope of `start` to its stated axes.
// Unset where that does not apply or the map is the identity.
std::optional<CalibrateOptions> WithMagnetometerMap(const CalibrateOptions& options,
                                                    const StartValues& start);

}  // namespace truetriad
