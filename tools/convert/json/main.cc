// SPDX-License-Identifier: Apache-2.0
//
// Arrays in JSON files to a recording. docs/converting.md.
#include "tools/convert/common/converter.h"
#include "tools/convert/common/named_readings.h"
#include "tools/convert/json/json_variables.h"

int main(int argc, char** argv) {
  namespace convert = truetriad::convert;
  const convert::Converter converter = {
      .format = "json",
      .input = "JSON files with arrays of readings, or with one object a line",
      .details = convert::NamedReadingsHelp(),
      .takes_several = true,
      .others = {"columns", "units"},
      .run = [](const convert::Arguments& arguments) {
        return convert::ConvertNamedReadings(arguments, "json", convert::JsonFile::Open);
      }};
  return convert::RunConverter(converter, argc, argv);
}
