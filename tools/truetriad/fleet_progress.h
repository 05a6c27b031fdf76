// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include <gflags/gflags.h>

#include "fleet/fleet_run.h"
#include "fleet/store.h"
#include "tools/truetriad/command.h"
#include "tools/truetriad/progress.h"
#include "tree/json.h"

// Flags that several verbs of `fleet` share.
DECLARE_string(store);
DECLARE_string(where);
DECLARE_bool(csv);

namespace truetriad {

/// The verb by which `fleet run` starts its worker processes; not for users.
inline constexpr std::string_view kFleetWorker = "fleet-worker";
/// The value of --fail-on for verbs that calibrate.
inline constexpr char kFailOnUnit[] = "unit";
/// The only value of --progress.
inline constexpr char kProgressLines[] = "jsonl";

/// The value of --store; without it, fleet.db in the output folder.
std::string StatedStore();

/// Opens the store of --store for reading. `asks`: SQL that the user wrote will run. With --where
/// this is known without `asks`.
Result<std::unique_ptr<fleet::Store>> OpenStatedToRead(bool asks = false);

/// Messages of `fleet run` and `fleet watch` on stderr. With --progress=jsonl, each run and note is
/// a line of JSON. Otherwise notes are text, and a terminal shows a line of progress (rate, time
/// left, failures).
class FleetTalk {
 public:
  /// `names_all`: prints a line for the operator about each unit, also about good ones.
  explicit FleetTalk(bool names_all = false);

  fleet::FleetListener Listener();

 private:
  void OnRun(const fleet::UnitRun& run, const fleet::FleetProgress& progress);
  /// `print`: Note or Warn.
  void OnNote(const std::string& note, void (*print)(const std::string&));

  bool is_lines_;  ///< Messages are lines of JSON.
  bool names_all_;
  ProgressLine line_{""};
};

/// The summary of the units. Exit code 4: a unit is not good (with --fail-on=unit), or files of a
/// unit that may not be delivered could not be changed.
VerbResult FleetResult(const fleet::FleetProgress& progress);

}  // namespace truetriad
