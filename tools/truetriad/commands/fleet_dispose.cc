// SPDX-License-Identifier: Apache-2.0
#include <optional>
#include <string>
#include <vector>

#include <gflags/gflags.h>

#include "fleet/store.h"
#include "fleet/unit_folders.h"
#include "tools/truetriad/command.h"
#include "tools/truetriad/flags.h"
#include "tools/truetriad/fleet_flags.h"
#include "truetriad/io/calibration_file.h"

DEFINE_string(unit, "", "SERIAL: the serial number of a unit in the store");
DEFINE_string(who, "", "NAME: who decides");
DEFINE_string(verdict, "", "VERDICT: what the unit is from now on");
DEFINE_string(why, "", "TEXT: why, in one line");

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
    return BadValue("verdict", FLAGS_verdict, " is not known; expected one of " + names);
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
  TRUETRIAD_ASSIGN_OR_RETURN(
      const fleet::Agreement agreed,
      fleet::AgreeFolders(*store, added.serial, fleet::UnitsBeside(FLAGS_store)));
  std::vector<std::string> unreached;
  for (const fleet::Unreached& one : agreed.unreached) {
    Warn(one.error.message + "; `export` does not know of this decision there");
    unreached.push_back(one.error.message);
  }
  std::string text = FLAGS_unit + " is " + FLAGS_verdict + " (run " + added.run + ")\n";
  for (const std::string& file : agreed.withdrawn) text += "Withdrawn: " + file + '\n';
  if (verdict == Verdict::kPass) text += "Export again what is to leave.\n";
  // The store knows of it, but files of a unit that may not leave are as they were.
  return VerbResult{.exit_code = agreed.IsUnsafe() ? kExitOutsideLimits : kExitGood,
                    .text = text,
                    .result = {{"disposition", added.id},
                               {"serial", added.serial},
                               {"run", added.run},
                               {"verdict", FLAGS_verdict},
                               {"withdrawn", agreed.withdrawn},
                               {"unreached", unreached}}};
}

}  // namespace

Command FleetDisposeCommand() {
  return {
      .name = "fleet dispose",
      .summary = "What does somebody decide about a unit, whatever the verdict of its run?",
      .examples = R"(build/truetriad simulate -c configs/scenarios/fleet.yaml -o out/line
build/truetriad fleet run out/line -o out/day --report=false
build/truetriad fleet dispose B0003 --store=out/day/fleet.db --who="R. Roe" --verdict=FAIL --why="connector bent")",
      .details =
          R"(It holds until a later decision, or until a later run counts that is of another recording; fleet run
then says so. FAIL withdraws what was exported of all runs of the unit,
and `export` refuses it; PASS is a concession. Calibrations, reports and exports state either;
the store's runs stay as they are.
)",
      .flags = "unit! store! verdict! who! why!",
      .values = {{"verdict", VerdictsOfPeople()}},
      .words = {"unit"},
      .run = RunFleetDispose};
}

}  // namespace truetriad
