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

// All distinct starts that are worth trying; the best one comes first. There are several only if
// the magnetometer's rotation has rival solutions. Error (not enough): too few poses for the wanted
// model, or poses that do not determine the model. Error (bad input): stated attitudes, faces,
// forces or turns that are missing or contradict the readings.
Result<std::vector<StartValues>> FindStartValues(const PoseSet& poses,
                                                 const CalibrateOptions& options);

// If magnetometer and gyroscope are calibrated without accelerometer and only the gyroscope has a
// stated mounting: `options` with a mounting of the magnetometer for which the gyroscope of `start`
// has its stated axes. Unset in other cases, or if that mounting is the identity or a mirror.
std::optional<CalibrateOptions> WithMagnetometerMap(const CalibrateOptions& options,
                                                    const StartValues& start);

}  // namespace truetriad
