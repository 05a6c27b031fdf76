// SPDX-License-Identifier: Apache-2.0
#include "fuzz/conversion.h"
#define main DataflashConverterMain  // The program's own, whose functions are wanted.
#include "tools/convert/dataflash/main.cc"
#undef main

TRUETRIAD_FUZZ_TARGET(convert_dataflash) {
  if (input.empty()) return -1;
  truetriad::convert::Arguments arguments;
  arguments.inputs = {
      truetriad::fuzz::WriteInput("log.bin", truetriad::fuzz::TextOf(input.subspan(1)))};
  arguments.list = (input[0] & 1U) != 0;
  if ((input[0] & 2U) != 0) arguments.instance = input[0] >> 6U;
  if ((input[0] & 4U) != 0) arguments.topics = {"IMU", "MAG"};
  truetriad::fuzz::TryConversion(&truetriad::convert::Run, arguments);
  return 0;
}
