// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "base/messages.h"
#include "fleet/fleet_page.h"
#include "fleet/store.h"
#include "tools/truetriad/command.h"
#include "tools/truetriad/flags.h"
#include "tools/truetriad/fleet_flags.h"

namespace truetriad {
namespace {

Result<VerbResult> RunFleetReport(const std::vector<std::string>&) {
  TRUETRIAD_ASSIGN_OR_RETURN(const std::unique_ptr<fleet::Store> store,
                             fleet::OpenStoreToRead(FLAGS_store));
  if (!FLAGS_where.empty()) TRUETRIAD_RETURN_IF_ERROR(store->AllowTypedText());
  TRUETRIAD_ASSIGN_OR_RETURN(
      const fleet::FleetPageSummary page,
      fleet::WriteFleetPage(*store,
                            {.store = FLAGS_store, .folder = FLAGS_output, .where = FLAGS_where}));
  const std::string index = (std::filesystem::path(FLAGS_output) / "index.html").string();
  std::string text = index + "\n  " + Counted(page.units, "unit") + ", " +
                     std::to_string(page.good) + " of them good; " + std::to_string(page.reports) +
                     " of " + Counted(page.runs, "run") + " with a report that is linked\n";
  if (!page.draws_charts) {
    text += "  No charts: truetriad was built without npm (docs/installing.md)\n";
  }
  return VerbResult{.text = std::move(text),
                    .result = {{"page", index},
                               {"units", page.units},
                               {"good", page.good},
                               {"runs", page.runs},
                               {"reports", page.reports},
                               {"charts", page.draws_charts}}};
}

}  // namespace

Command FleetReportCommand() {
  return {.name = "fleet report",
          .summary = "What became of the units, as a page to look into with a browser?",
          .examples = R"(build/truetriad simulate -c configs/scenarios/fleet.yaml -o out/line
build/truetriad fleet run out/line -o out/day --assets=shared --tag=lot=L17
build/truetriad fleet report --store=out/day/fleet.db -o out/day/page)",
          .details =
              R"(Writes a folder with index.html, for the disk or any web server; units' reports are
linked where they are. A page that was written there before is replaced, another index.html never.
)",
          .flags = "store=FILE! output! where",
          .words = {"store"},
          .run = RunFleetReport};
}

}  // namespace truetriad
