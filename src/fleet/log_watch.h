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
  double look_s = 1.0;              ///< Between looks at what events do not say all about.
  /// Look so often instead of being told; set where nothing tells.
  std::optional<double> poll_s = {};
  /// Ends when nothing has happened for so long; what is still incomplete is given as it is.
  std::optional<double> until_idle_s = {};
};

/// Logs of a folder and below as they arrive, and those that are there without a run; a log that
/// arrives again changed is given again. Keeps in memory what waits, a few numbers of each log that
/// is done, the names of folders, and those of tables that a recording.yaml elsewhere names.
///
/// Given at once: a table that was closed after writing or renamed. When nobody writes to it and
/// two looks (`look_s` or `poll_s` apart) have found it the same: what was there already or was
/// linked, and any table where no event tells. In a folder that has not had a log yet the whole
/// folder must have stayed so, since a recording.yaml may follow; that is given when it and all
/// files that it names are there and have stayed so.
/// Error (bad input): the folder or one below cannot be read. Error (usage): the serial pattern.
Result<std::unique_ptr<OrderSource>> OpenLogWatch(WatchOptions options,
                                                  DoneLogs done,
                                                  std::function<void(const std::string&)> tell);

}  // namespace truetriad::fleet
