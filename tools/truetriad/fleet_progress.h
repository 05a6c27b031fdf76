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

/// What `fleet run` starts itself as, once a process; not for people.
inline constexpr std::string_view kFleetWorker = "fleet-worker";
/// What --fail-on of the verbs that calibrate takes.
inline constexpr char kFailOnUnit[] = "unit";
/// What --progress takes.
inline constexpr char kProgressLines[] = "jsonl";

/// The value of --store, or the one in the output folder.
std::string StatedStore();

/// The store of --store, to be read. `asks`: a user's own SQL is asked of it, if --where is not.
Result<std::unique_ptr<fleet::Store>> OpenStatedToRead(bool asks = false);

/// What `fleet run` and `fleet watch` say on stderr meanwhile: with --progress=jsonl a line of JSON
/// about each run and each note, else notes, and on a terminal a line with rate, time left and
/// failures.
class FleetTalk {
 public:
  /// `names_all`: a line for an operator about each unit, good ones, too.
  explicit FleetTalk(bool names_all = false);

  fleet::FleetListener Listener();

 private:
  void OnRun(const fleet::UnitRun& run, const fleet::FleetProgress& progress);
  /// `print`: Note or Warn.
  void OnNote(const std::string& note, void (*print)(const std::string&));

  bool is_lines_;  ///< Of JSON.
  bool names_all_;
  ProgressLine line_{""};
};

/// What has become of the units. Exit code 4 with --fail-on=unit and one that is not good.
VerbResult FleetResult(const fleet::FleetProgress& progress);

}  // namespace truetriad
