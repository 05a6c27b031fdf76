// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

#include "model/gyro_increment.h"
#include "verdict/lost_rows.h"

namespace truetriad {

// What a turn misses by, in the body frame at its end.
struct TurnMiss {
  Eigen::Matrix3d information;  // of the turn by itself
  Eigen::Matrix3d projector;    // its block of P: what the attitudes and parameters leave of that
  Eigen::Vector3d projected;    // P r
  Eigen::Matrix3d steps;        // sum (w_i dt)(w_i dt)^T
};

Eigen::Matrix3d SquaredSteps(const GyroReadings& readings, const TriadModel<double>& gyroscope);

// By which share turns are too long or too short, one more and one less: what misses along their
// axis beyond what does across it, over what rows lost one by one (or times that are off by as
// much) make of a turn of rates w a row apart,
//
//   p = sum [(e^T P r)^2 - s (e^T P e)] / sum (e^T P e)^2 sum_i (w_i dt)^2
//
// e the axis, P the projector of the turn's rows, s the scatter across. Of rows that are lost the
// mean turn is short by the same share.
ShareOfRows ShareOfTurnScatter(const std::vector<TurnMiss>& misses);

}  // namespace truetriad
