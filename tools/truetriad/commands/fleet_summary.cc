// SPDX-License-Identifier: Apache-2.0
#include <charconv>
#include <cmath>
#include <filesystem>
#include <map>
#include <memory>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <gflags/gflags.h>

#include "base/messages.h"
#include "fleet/fleet_page.h"
#include "fleet/line_summary.h"
#include "fleet/store.h"
#include "line/control_chart.h"
#include "tools/truetriad/command.h"
#include "tools/truetriad/flags.h"
#include "tools/truetriad/fleet_progress.h"
#include "truetriad/io/calibration_file.h"

DEFINE_string(study, "", "CONDITION: which runs are a gauge study, as in \"note = 'study'\"");
DEFINE_string(by, "operator", "TAG: tag that states who or what measured in a study");
DEFINE_string(
    reference,
    "",
    "QUANTITY=VALUE: known value of a quantity of the part in a type-1 study, in the unit of "
    "its limit (without a limit: of the log); give this flag once for each quantity");
DEFINE_string(golden_due,
              "24h",
              "DURATION: age at which a station's check of its golden unit is overdue");
DEFINE_int32(baseline,
             200,
             "UNITS: number of units of each station that form the baseline of its control charts; "
             "0: all units");
DEFINE_int32(points, 0, "COUNT: how many of the last points of each control chart --json states");

namespace truetriad {
namespace {

using NamedNumbers = std::map<std::string, double>;

/// The values of --reference by quantity. Error (usage): an item lacks the name or the number.
Result<NamedNumbers> References() {
  NamedNumbers references;
  std::istringstream lines(FLAGS_reference);
  for (std::string line; std::getline(lines, line);) {
    const std::size_t equals = line.find('=');
    const char* const end = line.data() + line.size();
    double value = 0.0;
    if (equals != std::string::npos) {
      const auto [to, failure] = std::from_chars(line.data() + equals + 1, end, value);
      if (failure == std::errc() && to == end && std::isfinite(value)) {
        references[line.substr(0, equals)] = value;
        continue;
      }
    }
    return BadValue(
        "reference", line, ": expected a quantity and a number, as in accelerometer.bias.x=0.012");
  }
  return references;
}

Result<fleet::SummaryOptions> Options() {
  TRUETRIAD_ASSIGN_OR_RETURN(const double golden_due_s,
                             ParseDuration("golden-due", FLAGS_golden_due));
  if (FLAGS_points < 0) {
    return Error(ErrorCode::kInvalidArgument, "--points: expected a number of 0 or more");
  }
  if (FLAGS_baseline != 0 && FLAGS_baseline < line::kLeastBaselineUnits) {
    return BadValue("baseline",
                    std::to_string(FLAGS_baseline),
                    ": expected " + std::to_string(line::kLeastBaselineUnits) +
                        " units or more, or 0 for all units");
  }
  TRUETRIAD_ASSIGN_OR_RETURN(NamedNumbers references, References());
  if (!references.empty() && FLAGS_study.empty()) {
    return Error(ErrorCode::kConflictingArguments, "--reference applies only with --study");
  }
  return fleet::SummaryOptions{.where = FLAGS_where,
                               .study = FLAGS_study,
                               .study_by = FLAGS_by,
                               .references = std::move(references),
                               .golden_due_h = golden_due_s / 3600.0,
                               .now = TimestampUtc(),
                               .baseline_units = FLAGS_baseline,
                               .chart_points = FLAGS_points};
}

Result<VerbResult> RunFleetSummary(const std::vector<std::string>&) {
  TRUETRIAD_ASSIGN_OR_RETURN(const fleet::SummaryOptions options, Options());
  TRUETRIAD_ASSIGN_OR_RETURN(const std::unique_ptr<fleet::Store> store,
                             OpenStatedToRead(!FLAGS_study.empty()));
  TRUETRIAD_ASSIGN_OR_RETURN(Json summary, fleet::Summarise(*store, options));
  return VerbResult{.text = FLAGS_csv ? fleet::SummaryCsv(summary) : fleet::SummaryText(summary),
                    .result = std::move(summary)};
}

Result<VerbResult> RunFleetReport(const std::vector<std::string>&) {
  TRUETRIAD_ASSIGN_OR_RETURN(const std::unique_ptr<fleet::Store> store, OpenStatedToRead());
  TRUETRIAD_ASSIGN_OR_RETURN(
      const fleet::FleetPageSummary page,
      fleet::WriteFleetPage(*store,
                            {.store = FLAGS_store, .folder = FLAGS_output, .where = FLAGS_where}));
  const std::string index = (std::filesystem::path(FLAGS_output) / "index.html").string();
  std::string text = index + "\n  " + Counted(page.units, "unit") + ", " +
                     std::to_string(page.good) + " of them good; " + std::to_string(page.reports) +
                     " of " + Counted(page.runs, "run") + " have a report, which is linked\n";
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

Command FleetSummaryCommand() {
  return {
      .name = "fleet summary",
      .summary =
          "How does the line do? Yield, reasons, limits, charts, golden units, gauge studies.",
      .examples = R"(build/truetriad simulate -c configs/scenarios/fleet.yaml -o out/line
build/truetriad fleet run out/line -o out/day --set=limits.accelerometer.bias=0.5
build/truetriad fleet summary --store=out/day/fleet.db)",
      .details =
          R"(What the numbers mean: docs/line.md. --where and --study are conditions in SQL over the
columns of `standing` and the tags by name. --csv prints one line per quantity.
)",
      .flags = "store=FILE! where study by reference* golden-due baseline points csv",
      .run = RunFleetSummary};
}

Command FleetReportCommand() {
  return {
      .name = "fleet report",
      .summary = "How do I see the results of all units on a page in a browser?",
      .examples = R"(build/truetriad simulate -c configs/scenarios/fleet.yaml -o out/line
build/truetriad fleet run out/line -o out/day --assets=shared --tag=lot=L17
build/truetriad fleet report --store=out/day/fleet.db -o out/day/page)",
      .details =
          R"(Writes a folder with index.html, which opens from disk or from any web server and links to the units'
reports where they are. A page that this verb wrote earlier is replaced; any other index.html is not.
)",
      .flags = "store=FILE! output! where",
      .words = {"store"},
      .run = RunFleetReport};
}

}  // namespace truetriad
