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

/// The same of a converter of named variables: what listing or naming them makes of `input`,
/// written to `file`. The target's answer.
int TryNamedReadings(Status (*run)(const convert::Arguments& arguments),
                     const char* file,
                     Bytes input);

}  // namespace truetriad::fuzz
