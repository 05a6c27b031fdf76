// SPDX-License-Identifier: Apache-2.0
#include "fuzz/conversion.h"
#include "tools/convert/common/named_readings.h"
#include "tools/convert/json/json_variables.h"

namespace convert = truetriad::convert;

static truetriad::Status Run(const convert::Arguments& arguments) {
  return convert::ConvertNamedReadings(arguments, "json", convert::JsonFile::Open);
}

TRUETRIAD_FUZZ_TARGET(convert_json) {
  return truetriad::fuzz::TryNamedReadings(&Run, "log.json", input);
}
