// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

#include "model/gyro_increment.h"
#include "truetriad/data/static_pose.h"
#include "truetriad/model/triad_model.h"

namespace truetriad {

// Converts a recorded move for integration. If `accelerometer` is not null, also computes the
// forces.
GyroMove MoveOf(const RecordedMove& recorded, const TriadModel<double>* accelerometer);

// What a magnetometer or accelerometer measured during a move, true unit; empty if the sensor was
// not recorded.
std::vector<Eigen::Vector3d> FieldsDuring(const RecordedMove& recorded,
                                          Triad triad,
                                          const TriadModel<double>& model);

// σ of one gyroscope reading for use in the noise of a turn, raw unit: the noise within the rests,
// increased by its correlation in time.
Eigen::Vector3d ReadingSigma(const StreamSummary& gyroscope);

}  // namespace truetriad
