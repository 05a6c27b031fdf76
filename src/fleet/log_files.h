// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "truetriad/base/result.h"

namespace truetriad::fleet {

/// Where this is in a folder, it stands for what is there and below.
inline constexpr std::string_view kManifestName = "recording.yaml";

/// *.csv and *.csv.gz that are neither hidden nor being written under another name.
bool IsTable(const std::filesystem::path& path);
/// A folder that is looked into: not hidden, no results (*.truetriad), not being written.
bool IsEntered(const std::filesystem::path& folder);

/// Every log in a folder and below: tables, and recording.yaml of a folder instead of what is in
/// it. `enters` is asked of each folder (the first, too) before it is read. What vanishes meanwhile
/// is left out. Error (bad input): `folder` cannot be read.
Status ForEachLog(const std::filesystem::path& folder,
                  const std::function<bool(const std::filesystem::path&)>& enters,
                  const std::function<void(const std::filesystem::path&)>& on_log);

/// By which a log is known to be as it was: its bytes and when it was last written.
struct LogStamp {
  std::int64_t bytes = 0, modified_ns = 0;

  bool operator==(const LogStamp&) const = default;
};

/// Of a recording.yaml: with all tables in its folder, bytes of all, and the last time. Unset:
/// there is no such file.
std::optional<LogStamp> StampOf(const std::string& log);
/// Of all tables of a folder and its recording.yaml.
LogStamp StampOfFolder(const std::filesystem::path& folder);

/// Whether some process has the file open to write; false where the system does not say (network
/// folders, another user's file).
bool IsBeingWritten(const std::string& file);

}  // namespace truetriad::fleet
