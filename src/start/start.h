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

// Of a magnetometer beside a gyroscope alone, whose mounting is not stated: the options with the
// body axes along which it senses where the gyroscope's are as stated, from a start without. Unset
// where that does not apply or they are the body's.
std::optional<CalibrateOptions> WithMagnetometerMap(const CalibrateOptions& options,
                                                    const StartValues& start);

}  // namespace truetriad
