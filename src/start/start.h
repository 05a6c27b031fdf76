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

// Error (not enough): a triad has fewer poses than its wanted model needs.
Status CheckPoseCounts(const PoseSet& poses, const CalibrateOptions& options);

// All distinct starts worth trying, best first: one, or several when the magnetometer's rotation
// has rival solutions.
// Error: too few poses for the wanted model, poses that do not determine it (not enough); readings
// that cannot be in the stated unit (bad input).
Result<std::vector<StartValues>> FindStartValues(const PoseSet& poses,
                                                 const CalibrateOptions& options);

// If magnetometer and gyroscope are calibrated without accelerometer, and only the gyroscope has a
// stated mounting: `options` with the axis map of the magnetometer that brings the gyroscope of
// `start` to its stated axes. Unset in other cases, or if the map is the identity.
std::optional<CalibrateOptions> WithMagnetometerMap(const CalibrateOptions& options,
                                                    const StartValues& start);

}  // namespace truetriad
