// SPDX-License-Identifier: Apache-2.0
//
// MATLAB files (.mat) to a recording. docs/converting.md.
#include "tools/convert/common/converter.h"
#include "tools/convert/common/named_readings.h"
#include "tools/convert/mat/mat_variables.h"

int main(int argc, char** argv) {
  namespace convert = truetriad::convert;
  const convert::Converter converter = {.format = "mat",
                                        .input = "MATLAB files (.mat of version 5, 7 or 7.3)",
                                        .details = convert::NamedReadingsHelp(),
                                        .takes_several = true,
                                        .others = {"columns", "units"},
                                        .run = [](const convert::Arguments& arguments) {
                                          return convert::ConvertNamedReadings(
                                              arguments, "mat", convert::MatFile::Open);
                                        }};
  return convert::RunConverter(converter, argc, argv);
}
