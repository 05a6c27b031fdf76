// SPDX-License-Identifier: Apache-2.0
#include <string>
#include <vector>

#include <gflags/gflags.h>

#include "fleet/store.h"
#include "fleet/unit_folders.h"
#include "tools/truetriad/command.h"
#include "tools/truetriad/flags.h"
#include "tools/truetriad/fleet_flags.h"
#include "truetriad/io/calibration_file.h"

DEFINE_string(unit, "", "the serial number of a unit in the store");
DEFINE_string(who, "", "who decides");
DEFINE_string(verdict, "", "what the unit is from now on");
DEFINE_string(why, "", "why, in one line");

namespace truetriad {
namespace {

std::vector<std::string> VerdictsOfPeople() {
  std::vector<std::string> names;
  for (const Verdict verdict : fleet::kVerdictsOfPeople) {
    names.emplace_back(VerdictName(verdict));
  }
  return names;
}

Result<VerbResult> RunFleetDispose(const std::vector<std::string>&) {
  const std::optional<Verdict> verdict = VerdictFromName(FLAGS_verdict);
  if (!verdict) {
    std::string names;
    for (const std::string& name : VerdictsOfPeople()) names += (names.empty() ? "" : ", ") + name;
    return Error(ErrorCode::kInvalidArgument,
                 "--verdict=" + FLAGS_verdict + " is not known; expected one of " + names);
  }
  // No store is made of a misspelt name.
  TRUETRIAD_RETURN_IF_ERROR(fleet::OpenStoreToRead(FLAGS_store));
  TRUETRIAD_ASSIGN_OR_RETURN(const std::unique_ptr<fleet::Store> store,
                             fleet::OpenStore(FLAGS_store));
  const fleet::Disposition disposition = {.id = fleet::NewRunId(),
                                          .serial = FLAGS_unit,
                                          .created = TimestampUtc(),
                                          .who = FLAGS_who,
                                          .why = FLAGS_why,
                                          .verdict = *verdict};
  TRUETRIAD_ASSIGN_OR_RETURN(const fleet::Disposition added, store->Dispose(disposition));
  for (const std::string& folder : added.folders) {
    const Status told =
        fleet::StateDecision(folder, {added.verdict, added.who, added.why, added.created});
    if (!told) Warn(told.error().message + "; `export` does not know of this decision there");
  }
  return VerbResult{.text = FLAGS_unit + " is " + FLAGS_verdict + " (run " + added.run + ")\n",
                    .result = {{"disposition", added.id},
                               {"serial", added.serial},
                               {"run", added.run},
                               {"verdict", FLAGS_verdict}}};
}

}  // namespace

Command FleetDisposeCommand() {
  return {.name = "fleet dispose",
          .summary = "What does somebody decide about a unit, whatever the verdict of its run?",
          .examples =
              "build/truetriad simulate -c configs/scenarios/fleet.yaml -o out/line\n"
              "build/truetriad fleet run out/line -o out/day --report=false\n"
              "build/truetriad fleet dispose B0003 --store=out/day/fleet.db --who=\"R. Roe\" "
              "--verdict=FAIL --why=\"connector bent\"",
          .details =
              "It holds until a later decision, or until a later run counts that is of another "
              "recording; fleet run\nthen says so. FAIL withdraws what was exported of the run, "
              "and `export` refuses it; PASS "
              "is a concession,\nwhich `export` and the certificate state. No run is changed.\n",
          .flags = {{"unit", "SERIAL", true},
                    {"store", "FILE|URL", true},
                    {"verdict", "VERDICT", true, VerdictsOfPeople()},
                    {"who", "NAME", true},
                    {"why", "TEXT", true}},
          .words = {"unit"},
          .run = RunFleetDispose};
}

}  // namespace truetriad
