// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace truetriad {

/// A script for bash that completes verbs, flags and their values, of the same table as the help.
std::string BashCompletion();

}  // namespace truetriad
