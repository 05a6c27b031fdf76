// SPDX-License-Identifier: Apache-2.0
#include "fuzz/conversion.h"
#define main Ros1ConverterMain  // The program's own, whose functions are wanted.
#include "tools/convert/ros/ros1.cc"
#undef main

TRUETRIAD_FUZZ_TARGET(convert_ros1) {
  if (input.empty()) return -1;
  truetriad::convert::Arguments arguments;
  arguments.inputs = {
      truetriad::fuzz::WriteInput("log.bag", truetriad::fuzz::TextOf(input.subspan(1)))};
  arguments.list = (input[0] & 1U) != 0;
  if ((input[0] & 2U) != 0) arguments.topics = {"/imu", "/mag", "/temperature"};
  truetriad::fuzz::TryConversion(
      [](const truetriad::convert::Arguments& all) {
        return truetriad::convert::ConvertBags(truetriad::convert::kFormat, all);
      },
      arguments);
  return 0;
}
