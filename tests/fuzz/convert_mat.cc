// SPDX-License-Identifier: Apache-2.0
#include "fuzz/conversion.h"
#include "tools/convert/common/named_readings.h"
#include "tools/convert/mat/mat_variables.h"

namespace convert = truetriad::convert;

static truetriad::Status Run(const convert::Arguments& arguments) {
  return convert::ConvertNamedReadings(arguments, "mat", convert::MatFile::Open);
}

TRUETRIAD_FUZZ_TARGET(convert_mat) {
  if (input.empty()) return -1;
  convert::Arguments arguments;
  arguments.input =
      truetriad::fuzz::WriteInput("log.mat", truetriad::fuzz::TextOf(input.subspan(1)));
  arguments.list = (input[0] & 1U) != 0;
  if ((input[0] & 2U) != 0) {
    arguments.others["columns"] =
        "time=t,accelerometer=acc,gyroscope=imu.gyr@100Hz,magnetometer=mag";
    arguments.others["units"] = "s,m/s^2,rad/s,counts";
  }
  truetriad::fuzz::TryConversion(&Run, arguments);
  return 0;
}
