// SPDX-License-Identifier: Apache-2.0
#include "fuzz/conversion.h"

#include <filesystem>
#include <system_error>

#include "tools/convert/common/converter.h"
#include "truetriad/io/recording.h"

namespace truetriad::convert {

/// In place of common/memory_bound.cc: fuzzers map much, and bound memory by themselves.
void BoundMemory(const std::vector<std::string>& /*paths*/) {}

}  // namespace truetriad::convert

namespace truetriad::fuzz {
namespace {

/// Rows that a recording holds must be readable; that its readings say nothing may be.
void MustRead(const std::string& manifest) {
  Result<std::unique_ptr<SampleSource>> source = OpenRecording(manifest);
  if (!source) {
    // `applied: unknown` and the like are for a person to complete.
    MustSay(source.error());
    return;
  }
  std::vector<SampleBlock> blocks;
  for (;;) {
    const Result<bool> more = (*source)->Next(&blocks);
    if (!more) Must(false, "a row that was written can be read", more.error().message);
    if (!*more) break;
  }
}

}  // namespace

void TryConversion(const std::function<Status(const convert::Arguments& arguments)>& run,
                   convert::Arguments arguments) {
  std::error_code failure;
  if (!arguments.list) arguments.output = FreshOutput();
  Status status;
  try {
    status = run(arguments);
  } catch (const std::exception& thrown) {
    status = Error(ErrorCode::kDamagedFile, thrown.what());  // As RunConverter has it.
  }
  if (status && arguments.list) return;
  if (status) {
    MustRead(arguments.output + "/recording.yaml");
  } else {
    MustSay(status.error());
    Must(arguments.list || !std::filesystem::exists(arguments.output, failure),
         "a failed conversion leaves nothing");
  }
}

int TryNamedReadings(const convert::NamedFormat& format, const char* file, Bytes input) {
  if (input.empty()) return -1;
  convert::Arguments arguments;
  arguments.inputs = {WriteInput(file, TextOf(input.subspan(1)))};
  arguments.list = (input[0] & 1U) != 0;
  if ((input[0] & 2U) != 0) {
    arguments.others["columns"] =
        "time=t,accelerometer=acc,gyroscope=imu.gyr@100Hz,magnetometer=mag";
    arguments.others["units"] = "s,m/s^2,rad/s,counts";
  }
  TryConversion(
      [&](const convert::Arguments& all) { return convert::ConvertNamedReadings(format, all); },
      arguments);
  return 0;
}

}  // namespace truetriad::fuzz
