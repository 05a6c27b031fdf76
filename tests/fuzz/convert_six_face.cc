// SPDX-License-Identifier: Apache-2.0
//
// A folder with a recording for each face; a 0xFF byte ends one and begins the next.
#include <filesystem>

#include "fuzz/conversion.h"
#define main SixFaceConverterMain  // The program's own, whose functions are wanted.
#include "tools/convert/six_face.cc"
#undef main

TRUETRIAD_FUZZ_TARGET(convert_six_face) {
  namespace fs = std::filesystem;
  const std::string folder = truetriad::fuzz::Folder() + "/faces";
  fs::remove_all(folder);
  fs::create_directory(folder);
  std::string_view text = truetriad::fuzz::TextOf(input);
  for (const char* const name : {"+x.csv", "x_down.csv", "+z.csv"}) {
    const std::size_t end = text.find('\xFF');
    truetriad::fuzz::WriteInput(std::string("faces/") + name, text.substr(0, end));
    if (end == std::string_view::npos) break;
    text.remove_prefix(end + 1);
  }
  truetriad::convert::Arguments arguments;
  arguments.inputs = {folder};
  truetriad::fuzz::TryConversion(&truetriad::convert::Run, arguments);
  return 0;
}
