// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <system_error>
#include <vector>

#include "base/utf8.h"
#include "formats/text.h"
#include "io/input_guard.h"
#include "io/whole_file.h"
#include "truetriad/formats/export.h"

namespace truetriad {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kWithdrawn = ".withdrawn";

/// NAME.withdrawn, or the first free NAME.withdrawn-2, -3, ...
fs::path FreeName(const fs::path& path) {
  std::error_code none;
  const std::string first = path.string() + std::string(kWithdrawn);
  if (!fs::exists(first, none)) return first;
  for (int i = 2;; ++i) {
    const std::string name = first + "-" + std::to_string(i);
    if (!fs::exists(name, none)) return name;
  }
}

}  // namespace

Result<bool> IsExport(const fs::path& path, const std::optional<std::string>& serial) {
  constexpr std::streamoff kLooked = 1 << 16;
  const std::string name = path.filename().string();
  if (name.find(kWithdrawn) != std::string::npos || IsTemporaryName(name)) return false;
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  if (!file)
    return Error(
        ErrorCode::kUnreadableFile, {path.string()}, "cannot be read, so it may be an export");
  const std::streamoff size = file.tellg();
  for (const std::streamoff at : {std::streamoff{0}, std::max(size - kLooked, kLooked)}) {
    if (at >= size || !file.seekg(at)) break;
    std::string part(static_cast<std::size_t>(std::min(kLooked, size - at)), '\0');
    file.read(part.data(), static_cast<std::streamsize>(part.size()));
    const std::size_t said = part.find(kExportedBy);
    if (said != std::string::npos && part.find(kWasCalibrated, said) != std::string::npos) {
      // If the file may hold the serial number in escaped form, every export counts as one of this
      // unit.
      if (!serial || serial->find_first_of("\"\\*") != std::string::npos ||
          PrintableLine(*serial) != *serial)
        return true;
      for (const std::string& its : {*serial, std::string()}) {  // Or no serial.
        for (const std::string_view next : {" (", ", for "}) {   // A model or a format follows.
          if (part.find(UnitPhrase(its).append(next)) != std::string::npos) return true;
        }
      }
    }
  }
  return false;
}

Result<std::vector<std::string>> WithdrawExports(
    const std::string& folder, const std::map<std::string, std::string>& written) {
  std::vector<std::string> withdrawn;
  std::vector<fs::path> folders = {folder};
  std::error_code failure;
  for (std::size_t i = 0; i < folders.size(); ++i) {
    fs::directory_iterator entry(folders[i], failure);
    for (const fs::directory_iterator end; !failure && entry != end; entry.increment(failure)) {
      const std::string path = entry->path().string();
      std::error_code vanished;
      if (i == 0 && entry->path().filename().string().starts_with("instance-") &&
          entry->is_directory(vanished)) {
        folders.push_back(entry->path());
      }
      const bool is_file = entry->is_regular_file(vanished);
      // Files that this command itself reads as inputs are not renamed.
      if (!is_file || written.contains(path) || InputGuard::Holds(path)) continue;
      TRUETRIAD_ASSIGN_OR_RETURN(const bool is_export, IsExport(path));
      if (!is_export) continue;
      const fs::path to = FreeName(path);
      fs::rename(path, to, vanished);
      if (vanished) return Error(ErrorCode::kCannotWrite, {path}, vanished.message());
      withdrawn.push_back(to.string());
    }
    if (failure) {
      return Error(
          ErrorCode::kCannotWrite, {folders[i].string()}, "cannot be listed: " + failure.message());
    }
  }
  return withdrawn;
}

}  // namespace truetriad
