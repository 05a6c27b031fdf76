// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

namespace truetriad {

/// What a result states about an input file as it was read.
struct InputFile {
  std::string file;
  std::string sha256;
  std::int64_t samples = 0;
};

}  // namespace truetriad
