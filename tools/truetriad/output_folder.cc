// SPDX-License-Identifier: Apache-2.0
#include "tools/truetriad/output_folder.h"

#include <system_error>

#include "truetriad/io/calibration_file.h"

namespace truetriad {

Status CheckCanWriteBelow(std::filesystem::path directory) {
  directory = std::filesystem::absolute(directory).lexically_normal();
  std::error_code missing;
  while (!std::filesystem::exists(directory, missing) && directory.has_relative_path()) {
    directory = directory.parent_path();
  }
  return EnsureWritableDirectory(directory.string());
}

}  // namespace truetriad
