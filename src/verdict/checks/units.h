// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "model/gyro_increment.h"
#include "problem/parameters.h"
#include "truetriad/data/static_pose.h"
#include "truetriad/model/finding.h"
#include "truetriad/problem/options.h"

namespace truetriad {

// The name of the known unit, or of the counts of a usual range, that equals `truth_per_raw` true
// units within 25 %: "deg/s". Unset if there is none, or if it is `stated`.
std::optional<std::string> LooksLike(Triad triad, double truth_per_raw, const Unit& stated);

// True units per raw unit, for all known units of a sensor.
std::vector<double> KnownUnitsOf(Triad triad);

// Why the recording cannot be calibrated as stated: normalised readings, or an impossible
// temperature, force, field, sampling rate or turn. No fit is needed for this.
std::optional<Finding> WhyNotAsStated(const PoseSet& poses, const CalibrateOptions& options);

// The check of turns alone, which compares the gyroscope's turns with those of gravity or field.
std::optional<Finding> WhyTurnsAreNotAsStated(const PoseSet& poses,
                                              const CalibrateOptions& options);

// Findings for gains that do not fit the readings' unit, and for a field unlike the Earth's.
Findings CheckGains(const PoseSet& poses,
                    const CalibrateOptions& options,
                    const PerTriad<Eigen::Matrix3d>& sensitivity,
                    const ReferenceValues& reference);

}  // namespace truetriad
