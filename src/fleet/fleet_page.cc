// SPDX-License-Identifier: Apache-2.0
#include "fleet/fleet_page.h"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <numeric>
#include <string_view>
#include <utility>
#include <vector>

#include "fleet/fleet_page_assets.h"
#include "fleet/fleet_page_folder.h"
#include "fleet/fleet_page_html.h"
#include "fleet/fleet_page_line.h"
#include "fleet/fleet_page_reader.h"
#include "fleet/fleet_page_script.h"
#include "report/format.h"
#include "truetriad/model/limits.h"
#include "truetriad/report/report.h"

namespace truetriad::fleet {
namespace {

/// Of numbers that are drawn: more than float has, none lost.
constexpr int kDrawnDigits = 8;

template <typename Number>
void AppendIntegers(const std::vector<Number>& numbers, std::string* script) {
  AppendList(
      numbers, [](Number number, std::string* text) { *text += std::to_string(number); }, script);
}

void AppendWords(const PageWords& words, std::string* script) {
  *script += "{\"name\":";
  AppendText(words.name, script);
  *script += ",\"words\":";
  AppendList(words.words, AppendText, script);
  *script += ",\"of\":";
  AppendIntegers(words.of, script);
  *script += '}';
}

void AppendColumn(const PageColumn& column, std::string* script) {
  const auto limit = [](const std::string& text) {
    return text.empty() ? std::string("null") : text;
  };
  *script += "\n{\"name\":";
  AppendText(column.name, script);
  if (const Result<LimitName> limit_name = ParseLimitName(column.name);
      column.is_judged && limit_name && limit_name->Unit() != "1") {
    *script += ",\"unit\":";
    AppendText(DisplayUnit(limit_name->Unit()), script);
  }
  *script += std::string(",\"judged\":") + (column.is_judged ? "true" : "false") +
             ",\"differ\":" + (column.limits_differ ? "true" : "false") +
             ",\"lower\":" + limit(column.lower) + ",\"target\":" + limit(column.target) +
             ",\"upper\":" + limit(column.upper) + '}';
}

/// What the table of units shows and what it is filtered by.
std::string DataScript(const PageUnits& units, const Json& line) {
  std::string script = "var truetriadFleet={\"part\":" + std::to_string(kUnitsInPart);
  script += ",\n\"serials\":";
  AppendList(units.serials, AppendText, &script);
  // Since the first of them; -1: not known.
  std::int64_t base = std::numeric_limits<std::int64_t>::max();
  for (const std::int64_t time : units.recorded_s) base = time > 0 ? std::min(base, time) : base;
  std::vector<std::int64_t> recorded = units.recorded_s;
  for (std::int64_t& time : recorded) time = time > 0 ? time - base : -1;
  script += ",\n\"recorded\":{\"base\":" + std::to_string(base) + ",\"of\":";
  AppendIntegers(recorded, &script);
  script += '}';
  for (const PageWords* words : {&units.verdict, &units.first_verdict, &units.code}) {
    script += ",\n\"" + words->name + "\":";
    AppendWords(*words, &script);
  }
  script += ",\n\"tags\":";
  AppendList(units.tags, AppendWords, &script);
  script += ",\n\"runs\":";
  AppendIntegers(units.run_count, &script);
  script += ",\n\"columns\":";
  AppendList(units.columns, AppendColumn, &script);
  script += ",\n\"line\":";
  AppendJson(line, &script);
  return script + "};\n";
}

std::string ColumnScript(std::size_t place, const PageColumn& column) {
  std::string script = "truetriadColumn(" + std::to_string(place) + ",";
  AppendList(
      column.values,
      [](float value, std::string* text) { AppendNumber(value, kDrawnDigits, text); },
      &script);
  return script + ");\n";
}

Status WriteAssets(WholeFolder& folder) {
  TRUETRIAD_RETURN_IF_ERROR(folder.Write("assets/report.css", ReportStyleSheet()));
  for (const PageAsset& asset : FleetPageAssets()) {
    TRUETRIAD_RETURN_IF_ERROR(folder.Write(std::string(asset.name), asset.text));
  }
  for (const PageAsset& asset : ChartAssets()) {
    TRUETRIAD_RETURN_IF_ERROR(folder.Write(std::string(asset.name), asset.text));
  }
  return {};
}

/// index.html and the lots' pages; the number of lots.
Result<std::size_t> WritePages(const PageUnits& units, WholeFolder& folder) {
  PageScope scope{.title = "Units", .draws_charts = !ChartAssets().empty()};
  scope.units.resize(units.size());
  std::iota(scope.units.begin(), scope.units.end(), std::size_t{0});
  TRUETRIAD_RETURN_IF_ERROR(folder.Write("index.html", FleetPageHtml(units, scope)));
  std::size_t lots = 0;
  for (const PageWords& tag : units.tags) {
    if (tag.name != "lot") continue;
    std::vector<std::vector<std::size_t>> units_of(tag.words.size());
    for (std::size_t i = 0; i < units.size(); ++i) units_of[tag.of[i]].push_back(i);
    for (std::size_t i = 0; i < tag.words.size(); ++i) {
      if (tag.words[i].empty()) continue;
      scope.title = "Lot " + tag.words[i];
      scope.root = "../";
      scope.lot = tag.words[i];
      scope.units = units_of[i];
      TRUETRIAD_RETURN_IF_ERROR(folder.Write(FileOfLot(tag.words[i]), FleetPageHtml(units, scope)));
      ++lots;
    }
  }
  return lots;
}

}  // namespace

Result<FleetPageSummary> WriteFleetPage(Store& store, const FleetPageOptions& options) {
  TRUETRIAD_ASSIGN_OR_RETURN(WholeFolder folder, WholeFolder::Begin(options.folder));
  const auto add_part = [&](std::size_t part, const std::string& script) {
    return folder.Write("data/part-" + std::to_string(part) + ".js", script);
  };
  TRUETRIAD_ASSIGN_OR_RETURN(
      const PageUnits units,
      ReadPageUnits(store, options.store, options.where, options.folder, add_part));
  if (units.size() == 0) {
    return Error(ErrorCode::kNoReadings,
                 {ShownStore(options.store)},
                 options.where.empty() ? "has no runs yet; `truetriad fleet run` adds them"
                                       : "has no units with --where=" + options.where);
  }
  for (std::size_t i = 0; i < units.columns.size(); ++i) {
    TRUETRIAD_RETURN_IF_ERROR(folder.Write("data/column-" + std::to_string(i) + ".js",
                                           ColumnScript(i, units.columns[i])));
  }
  TRUETRIAD_ASSIGN_OR_RETURN(const PageLine line, LineOfPage(store, options.where));
  for (std::size_t i = 0; i < line.charts.size(); ++i) {
    std::string script = "truetriadStation(" + std::to_string(i) + ",";
    AppendJson(line.charts[i], &script);
    TRUETRIAD_RETURN_IF_ERROR(
        folder.Write("data/station-" + std::to_string(i) + ".js", script + ");\n"));
  }
  TRUETRIAD_RETURN_IF_ERROR(folder.Write("data.js", DataScript(units, line.summary)));
  TRUETRIAD_RETURN_IF_ERROR(WriteAssets(folder));
  FleetPageSummary summary{
      .units = units.size(), .reports = units.reports, .draws_charts = !ChartAssets().empty()};
  TRUETRIAD_ASSIGN_OR_RETURN(summary.lots, WritePages(units, folder));
  for (std::size_t i = 0; i < units.size(); ++i) {
    summary.good += IsGood(units.verdict, i) ? 1 : 0;
    summary.runs += units.run_count[i];
  }
  TRUETRIAD_RETURN_IF_ERROR(folder.Commit());
  return summary;
}

}  // namespace truetriad::fleet
