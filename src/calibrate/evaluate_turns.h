// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <set>
#include <vector>

#include "calibrate/evaluated_reading.h"
#include "truetriad/calibrate/calibrate.h"
#include "truetriad/calibrate/evaluate.h"
#include "truetriad/data/static_pose.h"

namespace truetriad {

// Of one error at least.
double RootMeanSquareOf(const std::vector<double>& errors);

// Predicts gravity at each next rest by the turn into it; in a calibration without accelerometer
// the field. `vectors`: the calibrated accelerometer, or magnetometer, at each pose of `poses`.
// `left_out`: numbers of the poses into which a turn is not to count.
// Unset without a gyroscope, or without a turn between two of them.
//
// The error is a direction in the plane across gravity; what lets expect it: the noise of both
// accelerometer means and of the gyroscope's readings, the excess of turns, and the parameters of
// both sensors with their correlation.
std::optional<EvaluatedTurns> EvaluateTurns(
    const Calibration& calibration,
    const PoseSet& poses,
    const std::vector<std::optional<EvaluatedReading>>& vectors,
    const std::set<int>& left_out);

}  // namespace truetriad
