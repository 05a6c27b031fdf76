// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "truetriad/base/result.h"
#include "truetriad/data/static_pose.h"

namespace truetriad {

/// The text of a program file (`program: 1`): one line per pose with its number, attitude [qw, qx,
/// qy, qz] (world <- body), chamber temperature if it has one, and its label.
std::string PoseProgramToYaml(const PoseProgram& program);

/// Reads a program file. Errors (bad input) with their line: no poses, quaternions far from unit
/// length, unknown keys.
Result<PoseProgram> ReadPoseProgram(const std::string& path);

}  // namespace truetriad
