// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

namespace truetriad {

/// One input file as it was read, for the result.
struct InputFile {
  std::string file;
  std::string sha256;
  std::int64_t samples = 0;
};

}  // namespace truetriad
