// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "tools/truetriad/command.h"

namespace truetriad {

/// The overview of all verbs.
std::string OverviewText();

/// Everything about one verb, example first.
std::string HelpText(const Command& command);

}  // namespace truetriad
