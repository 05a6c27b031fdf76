// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <filesystem>
#include <system_error>
#include <vector>

#include "io/input_guard.h"
#include "io/whole_file.h"
#include "truetriad/formats/export.h"

namespace truetriad {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kWithdrawn = ".withdrawn";

/// Has one of the names that `calibrate` and `fleet run` give exports.
bool IsExport(const std::string& name, const std::vector<FormatInfo>& formats) {
  return !name.ends_with(kWithdrawn) && !IsTemporaryName(name) &&
         std::any_of(formats.begin(), formats.end(), [&](const FormatInfo& format) {
           return name.starts_with(format.file_name);
         });
}

}  // namespace

Result<std::vector<std::string>> WithdrawExports(
    const std::string& folder, const std::map<std::string, std::string>& written) {
  const std::vector<FormatInfo> formats = Formats();
  std::vector<std::string> withdrawn;
  std::vector<fs::path> folders = {folder};
  std::error_code failure;
  for (std::size_t i = 0; i < folders.size(); ++i) {
    fs::directory_iterator entry(folders[i], failure);
    for (const fs::directory_iterator end; !failure && entry != end; entry.increment(failure)) {
      const std::string path = entry->path().string(), name = entry->path().filename().string();
      std::error_code vanished;
      if (i == 0 && name.starts_with("instance-") && entry->is_directory(vanished)) {
        folders.push_back(entry->path());
      }
      const bool is_file = entry->is_regular_file(vanished);
      // A file that this command reads is an input and no export.
      if (!is_file || !IsExport(name, formats) || written.contains(path) || InputGuard::Holds(path))
        continue;
      fs::rename(path, path + std::string(kWithdrawn), vanished);
      if (vanished) return Error(ErrorCode::kCannotWrite, {path}, vanished.message());
      withdrawn.push_back(path + std::string(kWithdrawn));
    }
    if (failure) {
      return Error(
          ErrorCode::kCannotWrite, {folders[i].string()}, "cannot be listed: " + failure.message());
    }
  }
  return withdrawn;
}

}  // namespace truetriad
