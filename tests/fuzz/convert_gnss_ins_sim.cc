// SPDX-License-Identifier: Apache-2.0
//
// A folder of gnss-ins-sim; a 0xFF byte ends a file and begins the next.
#include <filesystem>

#include "fuzz/conversion.h"
#define main GnssInsSimConverterMain  // The program's own, whose functions are wanted.
#include "tools/convert/gnss_ins_sim.cc"
#undef main

TRUETRIAD_FUZZ_TARGET(convert_gnss_ins_sim) {
  namespace fs = std::filesystem;
  const std::string folder = truetriad::fuzz::Folder() + "/run";
  fs::remove_all(folder);
  fs::create_directory(folder);
  std::string_view text = truetriad::fuzz::TextOf(input);
  for (const char* const name : {"time.csv", "accel-0.csv", "gyro-0.csv", "mag-0.csv"}) {
    const std::size_t end = text.find('\xFF');
    truetriad::fuzz::WriteInput(std::string("run/") + name, text.substr(0, end));
    if (end == std::string_view::npos) break;
    text.remove_prefix(end + 1);
  }
  truetriad::convert::Arguments arguments;
  arguments.inputs = {folder};
  truetriad::fuzz::TryConversion(&truetriad::convert::Run, arguments);
  return 0;
}
