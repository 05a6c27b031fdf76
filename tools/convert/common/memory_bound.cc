// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <system_error>

#include <sys/resource.h>

#include "tools/convert/common/converter.h"

namespace truetriad::convert {

void BoundMemory([[maybe_unused]] const std::vector<std::string>& paths) {
#ifndef __SANITIZE_ADDRESS__                   // Which maps terabytes.
  constexpr rlim_t kLeast = rlim_t{2} << 30U;  // Of the program and its libraries.
  constexpr rlim_t kPerByte = 64;              // Of numbers of a byte, 8 as doubles, packed 8 to 1.
  rlim_t bytes = kLeast;
  for (const std::string& path : paths) {
    std::error_code missing;
    const rlim_t size = std::filesystem::file_size(path, missing);
    if (!missing) bytes += kPerByte * size;
  }
  const rlimit limit = {bytes, bytes};
  setrlimit(RLIMIT_AS, &limit);
#endif
}

}  // namespace truetriad::convert
