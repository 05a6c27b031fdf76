// SPDX-License-Identifier: Apache-2.0
#include "fuzz/conversion.h"
#define main JsonConverterMain  // The program's own, whose functions are wanted.
#include "tools/convert/json.cc"
#undef main

TRUETRIAD_FUZZ_TARGET(convert_json) {
  return truetriad::fuzz::TryNamedReadings(truetriad::convert::kFormat, "log.json", input);
}
