// SPDX-License-Identifier: Apache-2.0
#include "base/companion.h"

#include <cstdlib>
#include <filesystem>
#include <system_error>
#include <vector>

#include <dlfcn.h>

namespace truetriad {
namespace {

namespace fs = std::filesystem;

// The folder of the running program; empty when /proc does not show it.
fs::path ProgramFolder() {
  std::error_code error;
  return fs::read_symlink("/proc/self/exe", error).parent_path();
}

// The folder of the program or shared object that contains this code; empty when unknown.
fs::path CodeFolder() {
  Dl_info info;
  if (::dladdr(reinterpret_cast<const void*>(&CodeFolder), &info) == 0) return {};
  std::error_code error;
  const fs::path file = fs::canonical(info.dli_fname, error);
  return error ? fs::path() : file.parent_path();
}

}  // namespace

std::optional<std::string> FindCompanion(std::string_view file_name) {
  std::vector<fs::path> places;
  if (const char* const stated = std::getenv("TRUETRIAD_LIBEXEC")) places.emplace_back(stated);
  if (const fs::path here = ProgramFolder(); !here.empty()) {
    places.push_back(here);
    places.push_back(here.parent_path() / "libexec" / "truetriad");
  }
  for (const fs::path& place : places) {
    const fs::path candidate = place / file_name;
    std::error_code error;
    if (fs::is_regular_file(candidate, error)) return candidate.string();
  }
  return std::nullopt;
}

Result<void*> CompanionFunction(const char* file_name, const char* function) {
  const auto missing = [&](const std::string& why) {
    return Error(ErrorCode::kMissingProgram, std::string(file_name) + why);
  };
  const std::optional<std::string> file = FindCompanion(file_name);
  if (!file) return missing(" was not found");
  void* const module = ::dlopen(file->c_str(), RTLD_NOW | RTLD_LOCAL);
  void* const address = module == nullptr ? nullptr : ::dlsym(module, function);
  if (address == nullptr) return missing(" cannot be loaded: " + std::string(::dlerror()));
  return address;
}

Result<std::string> FindSharedFile(std::string_view file_name) {
  std::vector<fs::path> places;
  if (const char* folder = std::getenv("TRUETRIAD_SHARE"); folder != nullptr && *folder != '\0') {
    places.emplace_back(folder);
  } else {
    const fs::path here = ProgramFolder();
    if (!here.empty()) {
      places = {here / "share" / "truetriad", here.parent_path() / "share" / "truetriad"};
    }
    // If another program, such as Python, has loaded this code as a module, the data files are
    // beside the module.
    if (const fs::path module = CodeFolder(); !module.empty() && module != here) {
      places.push_back(module / "share" / "truetriad");
    }
  }
  std::string tried;
  for (const fs::path& place : places) {
    const fs::path candidate = place / file_name;
    std::error_code error;
    if (fs::is_regular_file(candidate, error)) return candidate.string();
    tried += (tried.empty() ? "" : " and ") + place.string();
  }
  return Error(ErrorCode::kBrokenInstallation,
               "truetriad's data file " + std::string(file_name) + " is missing from " +
                   (tried.empty() ? "its folder" : tried) +
                   "; reinstall truetriad, or set the environment variable TRUETRIAD_SHARE to "
                   "the folder that contains it");
}

}  // namespace truetriad
