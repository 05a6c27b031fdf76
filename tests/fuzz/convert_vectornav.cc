// SPDX-License-Identifier: Apache-2.0
#include "fuzz/conversion.h"
#define main VectornavConverterMain  // The program's own, whose functions are wanted.
#include "tools/convert/vectornav.cc"
#undef main

TRUETRIAD_FUZZ_TARGET(convert_vectornav) {
  if (input.empty()) return -1;
  truetriad::convert::Arguments arguments;
  arguments.inputs = {
      truetriad::fuzz::WriteInput("log.txt", truetriad::fuzz::TextOf(input.subspan(1)))};
  arguments.list = (input[0] & 1U) != 0;
  arguments.others["columns"] = "time=100Hz";
  if ((input[0] & 2U) != 0) arguments.topics = {"VNIMU", "VNYMR"};
  truetriad::fuzz::TryConversion(&truetriad::convert::Run, arguments);
  return 0;
}
