// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "truetriad/formats/export.h"

namespace truetriad {

// "PASS by R. Roe on 2026-11-25T10:00:00Z: concession 17".
std::string DecisionText(const Decision& decision);

}  // namespace truetriad
