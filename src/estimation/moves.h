// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "truetriad/data/static_pose.h"
#include "truetriad/model/gyro_increment.h"
#include "truetriad/model/triad_model.h"

namespace truetriad {

// A recorded move as it is integrated, with the specific force that the accelerometer shows.
GyroMove MoveOf(const RecordedMove& recorded, const TriadModel<double>& accelerometer);

}  // namespace truetriad
