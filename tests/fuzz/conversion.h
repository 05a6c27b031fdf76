// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "fuzz/fuzz_target.h"
#include "tools/convert/common/converter.h"
#include "truetriad/base/result.h"

namespace truetriad::fuzz {

/// Runs a converter in this process, to a fresh folder. What it wrote must be a recording whose
/// rows can all be read; where it failed it must say why and leave nothing.
void TryConversion(Status (*run)(const convert::Arguments& arguments),
                   convert::Arguments arguments);

}  // namespace truetriad::fuzz
