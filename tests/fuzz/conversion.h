// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

#include "fuzz/fuzz_target.h"
#include "tools/convert/common/named_readings.h"
#include "truetriad/base/result.h"

namespace truetriad::fuzz {

/// Runs a converter in this process, to a fresh folder. What it wrote must be a recording whose
/// rows can all be read; where it failed it must say why and leave nothing.
void TryConversion(const std::function<Status(const convert::Arguments& arguments)>& run,
                   convert::Arguments arguments);

/// The same of a converter of named variables: what listing or naming them makes of `input`,
/// written to `file`. The target's answer.
int TryNamedReadings(const convert::NamedFormat& format, const char* file, Bytes input);

}  // namespace truetriad::fuzz
