// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "truetriad/data/pose_program.h"

namespace truetriad {

// The poses in an order that needs little turning: temperature by temperature, rising; in each the
// shortest round that nearest neighbours and 2-opt find, from the attitude of the pose before it.
//
//   `heading_counts`  false: only what is up matters, so headings are turned freely
std::vector<ProgramPose> OrderForOperator(std::vector<ProgramPose> poses, bool heading_counts);

}  // namespace truetriad
