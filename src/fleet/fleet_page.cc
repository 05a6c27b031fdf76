// SPDX-License-Identifier: Apache-2.0
#include "fleet/fleet_page.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <optional>
#include <string_view>
#include <system_error>
#include <tuple>
#include <unordered_map>
#include <utility>
#include <vector>

#include "fleet/fleet_page_assets.h"
#include "fleet/fleet_page_folder.h"
#include "fleet/line_reader.h"
#include "fleet/line_summary.h"
#include "fleet/unit_folders.h"
#include "line/line_data.h"
#include "report/format.h"
#include "report/svg.h"
#include "truetriad/base/version.h"
#include "truetriad/model/limits.h"
#include "truetriad/report/report.h"

namespace truetriad::fleet {
namespace {

namespace fs = std::filesystem;

/// Points of a chart, the last ones: what a screen can show.
constexpr int kPointsOfChart = 400;

/// `path` as it stands in a link: byte by byte, but for what is plain.
std::string LinkOf(const std::string& path) {
  constexpr std::string_view kDigits = "0123456789ABCDEF";
  std::string link;
  for (const char c : path) {
    const auto byte = static_cast<unsigned char>(c);
    if ((byte < 0x80 && std::isalnum(byte) != 0) ||
        std::string_view("-_./~").find(c) != std::string_view::npos) {
      link += c;
    } else {
      link += {'%', kDigits[byte >> 4], kDigits[byte & 15U]};
    }
  }
  return link;
}

/// Where the report of a run is.
class Reports {
 public:
  Reports(const std::string& store, const std::string& page)
      : page_(Canonical(fs::absolute(page))), units_(fs::absolute(store).parent_path() / "units") {
    if (!page_.has_filename()) page_ = page_.parent_path();
  }

  /// As a link from the page's folder; empty: there is none.
  std::string LinkTo(const std::string& folder) {
    if (folder.empty()) return "";
    const fs::path place = fs::absolute(FolderOf(folder, units_));
    std::error_code ignored;
    if (!fs::is_regular_file(place / "report.html", ignored)) return "";
    const fs::path unit = place.parent_path();
    const fs::path report =
        Canonical(unit.parent_path()) / unit.filename() / place.filename() / "report.html";
    return LinkOf(report.lexically_relative(page_).generic_string());
  }

 private:
  /// Without links, so that the way from one to the other is the short one.
  const fs::path& Canonical(const fs::path& folder) {
    const auto [found, is_new] = canonical_.try_emplace(folder);
    if (is_new) {
      std::error_code failure;
      const fs::path canonical = fs::weakly_canonical(folder, failure);
      found->second = (failure ? folder : canonical).lexically_normal();
    }
    return found->second;
  }

  std::map<fs::path, fs::path> canonical_;
  fs::path page_, units_;
};

/// A unit of the page, and its runs as they stand in the data.
struct PageUnit {
  std::string serial, run;  ///< run: that counts.
  std::string recorded, verdict, code, first_verdict;
  bool is_decided = false;  ///< A decision holds.
  /// By when they were measured, log and name, in which order they are shown.
  std::vector<std::pair<std::tuple<std::string, std::string, std::string>, std::string>> runs = {};
};

/// What units were judged by, or a parameter, with the limits of the units' runs that count.
struct PageColumn {
  std::string name;
  bool is_judged = false;
  std::array<Json, 3> limits = {};  ///< Lower, target, upper; null: open.
  bool has_limits = false, limits_differ = false;
};

bool IsGood(const std::string& verdict) {
  const std::optional<Verdict> known = VerdictFromName(verdict);
  return known && !IsRed(*known);
}

/// The units that are selected, and all their runs.
class PageData {
 public:
  PageData(Store& store, const FleetPageOptions& options)
      : store_(store), where_(options.where), reports_(options.store, options.folder) {}

  Status Read() {
    TRUETRIAD_RETURN_IF_ERROR(ReadUnits());
    TRUETRIAD_RETURN_IF_ERROR(ReadDecisions());
    return store_.ForEachRun({}, [this](const UnitRun& run) -> Status {
      if (const auto unit = places_.find(run.serial); unit != places_.end()) {
        Take(run, &units_[unit->second]);
      }
      return {};
    });
  }

  FleetPageSummary Summary() const {
    FleetPageSummary summary{
        .units = units_.size(), .reports = links_, .draws_charts = !ChartAssets().empty()};
    for (const PageUnit& unit : units_) {
      summary.good += IsGood(unit.verdict) ? 1 : 0;
      summary.good_at_first += IsGood(unit.first_verdict) ? 1 : 0;
      summary.runs += unit.runs.size();
    }
    return summary;
  }

  /// The data of the page's scripts, with what `line` says.
  std::string Script(const Json& line) {
    std::string script = "var truetriadFleet={\"units\":[";
    for (PageUnit& unit : units_) {
      std::sort(unit.runs.begin(), unit.runs.end());
      const double recorded = line::SecondsOf(unit.recorded);
      script += (script.back() == '[' ? "\n[" : ",\n[") +
                ScriptOf({unit.serial, unit.verdict, unit.first_verdict, unit.code, recorded}) +
                ",[";
      for (const auto& [order, run] : unit.runs) script += (script.back() == '[' ? "" : ",") + run;
      script += "]]";
    }
    script += "],\n\"columns\":" + ScriptOf(Columns()) + ",\n\"line\":" + ScriptOf(line);
    return script + "};\n";
  }

 private:
  Status ReadUnits() {
    TRUETRIAD_ASSIGN_OR_RETURN(
        const Table table,
        store_.Query("SELECT serial, run, recorded, final_verdict, " + std::string(kReason) +
                     ", first_verdict, disposed_by" + FromWhere("standing", {.where = where_}) +
                     " ORDER BY serial"));
    for (const auto& row : table.rows) {
      const auto text = [&row](std::size_t column) { return row[column].value_or(""); };
      places_[text(0)] = units_.size();
      units_.push_back({text(0), text(1), text(2), text(3), text(4), text(5), row[6].has_value()});
    }
    return {};
  }

  /// Each by its run, with what has become of it: nothing, "later" (another decision), or the run
  /// by which it is lifted.
  Status ReadDecisions() {
    TRUETRIAD_ASSIGN_OR_RETURN(const Decisions decisions, store_.ReadDecisions());
    std::unordered_map<std::string, std::string> last;
    for (const Disposition& one : decisions.dispositions) last[one.serial] = one.id;
    for (const Disposition& one : decisions.dispositions) {
      const auto unit = places_.find(one.serial);
      if (unit == places_.end()) continue;
      const PageUnit& of = units_[unit->second];
      const std::string end = last[one.serial] != one.id ? "later" : of.is_decided ? "" : of.run;
      Json& list = decided_.try_emplace(one.run, Json::array()).first->second;
      list.push_back({one.created, one.who, VerdictName(one.verdict), one.why, end});
    }
    return {};
  }

  std::size_t ColumnOf(const std::string& name, bool is_judged) {
    const auto [found, is_new] = column_of_.try_emplace({is_judged, name}, columns_.size());
    if (is_new) columns_.push_back({.name = name, .is_judged = is_judged});
    return found->second;
  }

  Json JudgedJson(const LimitCheck& check, bool counts) {
    const std::size_t at = ColumnOf(check.FullName(), true);
    // "within ± 0.5" is "at most 0.5" of what is never negative.
    const Result<LimitName> name = ParseLimitName(check.FullName());
    const bool is_open = name && name->IsNeverNegative() && !(check.limit.lower > 0.0);
    const auto side = [](double limit) { return std::isfinite(limit) ? Json(limit) : Json(); };
    const std::array<Json, 3> limits = {is_open ? Json() : side(check.limit.lower),
                                        check.limit.target ? Json(*check.limit.target) : Json(),
                                        side(check.limit.upper)};
    PageColumn& column = columns_[at];
    if (counts && !std::exchange(column.has_limits, true)) column.limits = limits;
    if (counts && column.limits != limits) column.limits_differ = true;
    return {at, limits[0], limits[1], limits[2], check.worst, check.sigma, check.pass ? 1 : 0};
  }

  void Take(const UnitRun& run, PageUnit* unit) {
    const bool counts = run.id == unit->run;
    const std::string link = reports_.LinkTo(run.folder);
    links_ += link.empty() ? 0 : 1;
    Json json = {{"run", run.id},
                 {"counts", counts ? 1 : 0},
                 {"created", run.created},
                 {"recorded", run.recorded},
                 {"by", run.recorded_by},
                 {"verdict", VerdictName(run.verdict)},
                 {"code", run.code},
                 {"message", run.message},
                 {"report", link},
                 {"tags", JsonOf(run.tags)}};
    for (const char* const list : {"parameters", "judged", "findings"}) json[list] = Json::array();
    for (const Parameter& parameter : run.parameters) {
      json["parameters"].push_back(ColumnOf(parameter.name, false));
      json["parameters"].push_back(parameter.value);
      json["parameters"].push_back(parameter.sigma);
    }
    for (const LimitCheck& check : run.judgements) {
      json["judged"].push_back(JudgedJson(check, counts));
    }
    for (const Finding& finding : run.findings) {
      json["findings"].push_back({SeverityName(finding.severity),
                                  FindingCodeName(finding.code),
                                  finding.text,
                                  finding.remedy});
    }
    const auto decided = decided_.find(run.id);
    json["dispositions"] = decided == decided_.end() ? Json::array() : decided->second;
    unit->runs.push_back(
        {{run.recorded, run.recorded.empty() ? "" : run.log, run.id}, ScriptOf(json)});
  }

  Json Columns() const {
    Json list = Json::array();
    for (const PageColumn& column : columns_) {
      Json& json = list.emplace_back(Json{{"name", column.name},
                                          {"judged", column.is_judged},
                                          {"differ", column.limits_differ},
                                          {"lower", column.limits[0]},
                                          {"target", column.limits[1]},
                                          {"upper", column.limits[2]}});
      const Result<LimitName> name = ParseLimitName(column.name);
      if (column.is_judged && name && name->Unit() != "1") json["unit"] = DisplayUnit(name->Unit());
    }
    return list;
  }

  Store& store_;
  std::string where_;
  Reports reports_;
  std::vector<PageUnit> units_;                          ///< By serial number.
  std::unordered_map<std::string, std::size_t> places_;  ///< Of the units.
  std::unordered_map<std::string, Json> decided_;
  std::vector<PageColumn> columns_;
  std::map<std::pair<bool, std::string>, std::size_t> column_of_;
  std::size_t links_ = 0;
};

/// What the line's statistics say of the units that `where` lets through, as of the last of them.
Result<Json> LineJson(Store& store, const std::string& where) {
  SummaryOptions options{.selection = {.where = where}, .chart_points = kPointsOfChart};
  TRUETRIAD_ASSIGN_OR_RETURN(
      const Table last,
      store.Query("SELECT max(created)" + FromWhere("standing", {.where = where})));
  if (!last.rows.empty()) options.now = last.rows[0][0].value_or("");
  TRUETRIAD_ASSIGN_OR_RETURN(const LineSummary summary, Summarise(store, options));
  Json json = ToJson(summary);
  for (const char* const elsewhere : {"reasons", "parameters"}) json.erase(elsewhere);
  // Six digits are a pixel of any screen.
  const auto rounded = [](const Json& value) {
    const double number = value.is_null() ? line::kNotKnown : value.get<double>();
    return std::isfinite(number) ? Json(std::strtod(Significant(number, 6).c_str(), nullptr))
                                 : Json();
  };
  for (Json& station : json["charts"]) {
    for (Json& chart : station["charts"]) {
      for (Json& point : chart["points"]) {
        point = {point["serial"],
                 rounded(point["value"]),
                 rounded(point["lower"]),
                 rounded(point["upper"])};
      }
    }
  }
  return json;
}

std::string PageHtml(const FleetPageSummary& page) {
  const auto share = [&page](std::size_t part) {
    return Fixed(100.0 * static_cast<double>(part) / static_cast<double>(page.units), 1) + " %";
  };
  const std::map<std::string_view, std::string> parts = {
      {"chart_style",
       page.draws_charts ? "<link rel=\"stylesheet\" href=\"assets/uplot.css\">\n" : ""},
      {"chart_script",
       page.draws_charts ? "<script defer src=\"assets/uplot.js\"></script>\n" : ""},
      {"grade", page.good == page.units ? "good" : "caution"},
      {"headline", share(page.good) + " good"},
      {"explanation",
       std::to_string(page.good) + " of " + std::to_string(page.units) + " units; " +
           share(page.good_at_first) + " at the first run."},
      {"origin",
       EscapeMarkup(
           std::to_string(page.units) + " units, " + std::to_string(page.runs) +
           " runs; of each unit the run that counts. Times are UTC. Written by truetriad " +
           std::string(Version()) +
           (page.draws_charts ? "; charts by uPlot (assets/uplot-license.txt)." : "."))}};
  const std::string_view frame = FleetPageFrame();
  std::string html;
  for (std::size_t at = 0; at < frame.size();) {
    const std::size_t open = std::min(frame.find('{', at), frame.size());
    html += frame.substr(at, open - at);
    if (open == frame.size()) break;
    const std::size_t close = frame.find('}', open);
    html += parts.at(frame.substr(open + 1, close - open - 1));
    at = close + 1;
  }
  return html;
}

}  // namespace

std::string ScriptOf(const Json& json) {
  std::string script;
  for (const char c : json.dump(-1, ' ', /*ensure_ascii=*/true, Json::error_handler_t::replace)) {
    if (c == '<') {
      script += "\\u003c";
    } else {
      script += c;
    }
  }
  return script;
}

Result<FleetPageSummary> WriteFleetPage(Store& store, const FleetPageOptions& options) {
  TRUETRIAD_ASSIGN_OR_RETURN(WholeFolder folder, WholeFolder::Begin(options.folder));
  PageData data(store, options);
  TRUETRIAD_RETURN_IF_ERROR(data.Read());
  const FleetPageSummary summary = data.Summary();
  if (summary.units == 0) {
    return Error(ErrorCode::kNoReadings,
                 {ShownStore(options.store)},
                 options.where.empty() ? "has no runs yet; `truetriad fleet run` adds them"
                                       : "has no units with --where=" + options.where);
  }
  TRUETRIAD_ASSIGN_OR_RETURN(const Json line, LineJson(store, options.where));
  TRUETRIAD_RETURN_IF_ERROR(folder.Write("index.html", PageHtml(summary)));
  TRUETRIAD_RETURN_IF_ERROR(folder.Write("data.js", data.Script(line)));
  TRUETRIAD_RETURN_IF_ERROR(folder.Write("assets/report.css", ReportStyleSheet()));
  for (const auto* const assets : {&FleetPageAssets(), &ChartAssets()}) {
    for (const PageAsset& asset : *assets) {
      TRUETRIAD_RETURN_IF_ERROR(folder.Write(std::string(asset.name), asset.text));
    }
  }
  TRUETRIAD_RETURN_IF_ERROR(folder.Commit());
  return summary;
}

}  // namespace truetriad::fleet
