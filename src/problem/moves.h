// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

#include "model/gyro_increment.h"
#include "truetriad/data/static_pose.h"
#include "truetriad/model/triad_model.h"

namespace truetriad {

// Converts a recorded move for integration; with forces if `accelerometer` is not null.
GyroMove MoveOf(const RecordedMove& recorded, const TriadModel<double>* accelerometer);

// What a magnetometer or accelerometer measured during a move, true unit; empty if not recorded.
std::vector<Eigen::Vector3d> FieldsDuring(const RecordedMove& recorded,
                                          Triad triad,
                                          const TriadModel<double>& model);

// σ of one gyroscope reading for a sum over a turn, raw unit: the noise inside the rests, increased
// for its correlation in time.
Eigen::Vector3d ReadingSigma(const StreamSummary& gyroscope);

}  // namespace truetriad
