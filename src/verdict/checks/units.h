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

// What readings are in by the size that they turn out to have: the unit or device whose one raw
// unit is `truth_per_raw` true units, to a quarter: "deg/s". Unset where none is, or that of
// `stated`.
std::optional<std::string> LooksLike(Triad triad, double truth_per_raw, const Unit& stated);

// True units to one raw unit, of all that are known of a sensor.
std::vector<double> KnownUnitsOf(Triad triad);

// Why the recording cannot be calibrated as it is stated, before anything is fitted: a field, a
// clock, a temperature or turns that no unit could have seen; readings that were normalised.
std::optional<Finding> WhyNotAsStated(const PoseSet& poses, const CalibrateOptions& options);

// That of the turns alone: the gyroscope against how gravity turned, whatever its axes are called.
std::optional<Finding> WhyTurnsAreNotAsStated(const PoseSet& poses,
                                              const CalibrateOptions& options);

// Gains that the unit of the readings does not have, and a field that is none.
Findings CheckGains(const PoseSet& poses,
                    const CalibrateOptions& options,
                    const PerTriad<Eigen::Matrix3d>& sensitivity,
                    const ReferenceValues& reference);

}  // namespace truetriad
