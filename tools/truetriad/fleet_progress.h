// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "fleet/fleet_run.h"
#include "json/json.h"
#include "tools/truetriad/command.h"
#include "tools/truetriad/progress.h"

namespace truetriad {

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
  void OnNote(const std::string& note);

  bool is_lines_;  ///< Of JSON.
  bool names_all_;
  ProgressLine line_{""};
};

/// "42 of 300 runs, 3 not good; 4.2 a second, 61 s left".
std::string ProgressText(const fleet::FleetProgress& progress);

/// What has become of the units. Exit code 4 with --fail-on=unit and one that is not good.
VerbResult FleetResult(const fleet::FleetProgress& progress);

}  // namespace truetriad
