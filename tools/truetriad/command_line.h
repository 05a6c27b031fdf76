// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace truetriad {

/// Runs `truetriad ARGUMENTS`; returns the exit code. Errors are one message on stderr.
int RunCommandLine(const std::vector<std::string>& arguments);

}  // namespace truetriad
