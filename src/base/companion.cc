// SPDX-License-Identifier: Apache-2.0
#include "truetriad/base/companion.h"

#include <array>
#include <filesystem>
#include <system_error>

namespace truetriad {

std::optional<std::string> FindCompanion(std::string_view file_name) {
  namespace fs = std::filesystem;
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  if (error) return std::nullopt;
  const fs::path here = program.parent_path();
  const std::array<fs::path, 2> places = {here, here.parent_path() / "libexec" / "truetriad"};
  for (const fs::path& place : places) {
    const fs::path candidate = place / file_name;
    if (fs::is_regular_file(candidate, error)) return candidate.string();
  }
  return std::nullopt;
}

}  // namespace truetriad
