// SPDX-License-Identifier: Apache-2.0
#include "truetriad/base/companion.h"

#include <cstdlib>
#include <filesystem>
#include <system_error>
#include <vector>

namespace truetriad {

std::optional<std::string> FindCompanion(std::string_view file_name) {
  namespace fs = std::filesystem;
  std::error_code error;
  std::vector<fs::path> places;
  if (const char* const stated = std::getenv("TRUETRIAD_LIBEXEC")) places.emplace_back(stated);
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  if (!error) {
    const fs::path here = program.parent_path();
    places.push_back(here);
    places.push_back(here.parent_path() / "libexec" / "truetriad");
  }
  for (const fs::path& place : places) {
    const fs::path candidate = place / file_name;
    if (fs::is_regular_file(candidate, error)) return candidate.string();
  }
  return std::nullopt;
}

}  // namespace truetriad
