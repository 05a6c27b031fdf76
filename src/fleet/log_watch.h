// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "fleet/fleet_run.h"
#include "fleet/log_files.h"
#include "truetriad/base/result.h"

namespace truetriad::fleet {

/// What is watched, and how.
struct WatchOptions {
  std::string folder = {};
  std::string without = {};         ///< A folder whose files are results, no logs; or empty.
  std::string serial_pattern = {};  ///< As ListUnits.
  /// Between looks; unset: 1 s, or 5 s on a file system that does not say who writes to a file.
  /// Looks take at most a twentieth of the time, however large the folder is.
  std::optional<double> look_s = {};
  /// Ends when nothing has happened for so long; what is still incomplete is given as it is.
  std::optional<double> until_idle_s = {};
};

/// Logs of a folder and below as they arrive, and those that are there without a run; a log that
/// arrives again changed is given again. Keeps in memory what waits and a few numbers of each log
/// that is done.
///
/// A log is given when nobody writes to it and two looks have found it the same; a recording.yaml
/// when the same is true of all files that it names. In a folder that has not given a table yet the
/// whole folder must have stayed so, since a recording.yaml may follow.
/// Error (bad input): the folder or one below cannot be read. Error (usage): the serial pattern.
Result<std::unique_ptr<OrderSource>> OpenLogWatch(WatchOptions options,
                                                  DoneLogs done,
                                                  std::function<void(const std::string&)> tell);

}  // namespace truetriad::fleet
