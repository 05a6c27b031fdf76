// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <system_error>

#include <sys/resource.h>

#include "tools/convert/common/converter.h"

namespace truetriad::convert {

void BoundMemory([[maybe_unused]] const std::vector<std::string>& paths) {
#ifndef __SANITIZE_ADDRESS__                   // The sanitizer reserves terabytes.
  constexpr rlim_t kLeast = rlim_t{2} << 30U;  // For the program and its libraries.
  constexpr rlim_t kPerByte = 64;              // 8 bytes a double, times 8 for compression.
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
