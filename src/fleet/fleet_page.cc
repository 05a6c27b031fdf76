// SPDX-License-Identifier: Apache-2.0
#include "fleet/fleet_page.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <system_error>
#include <tuple>
#include <unordered_map>
#include <utility>
#include <vector>

#include "fleet/fields.h"
#include "fleet/line_summary.h"
#include "fleet/log_files.h"
#include "fleet/unit_folders.h"
#include "fleet/unit_work.h"
#include "io/whole_file.h"
#include "io/yaml_reader.h"
#include "line/line_data.h"
#include "report/svg.h"
#include "report/table.h"
#include "truetriad/base/result.h"
#include "truetriad/io/calibration_file.h"
#include "truetriad/model/quality.h"
#include "truetriad/report/report.h"

namespace truetriad::fleet {
namespace {

namespace fs = std::filesystem;

/// A chart shows only the last points, at most this many: more do not fit on a screen.
constexpr int kPointsOfChart = 400;

/// Finds the reports of runs.
class Reports {
 public:
  Reports(const std::string& store, const std::string& page)
      : page_(Canonical(fs::absolute(page))), units_(fs::absolute(store).parent_path() / "units") {
    if (!page_.has_filename()) page_ = page_.parent_path();
  }

  /// A link from the page's folder to the report of a run, in two parts: the path to the units'
  /// folder, and the path from there. Empty: there is no report.
  std::pair<std::string, std::string> LinkTo(const std::string& folder) {
    if (folder.empty()) return {};
    const fs::path place = fs::absolute(FolderOf(folder, units_));
    std::error_code ignored;
    if (!fs::is_regular_file(place / "report.html", ignored)) return {};
    const fs::path unit = place.parent_path();
    const fs::path units = Canonical(unit.parent_path()).lexically_relative(page_);
    constexpr std::string_view kPlain = "-_./~";
    return {PercentEncoded(units.generic_string(), kPlain),
            PercentEncoded((unit.filename() / place.filename()).generic_string(), kPlain)};
  }

 private:
  /// The path without symbolic links, so that relative paths between folders are the shortest.
  const fs::path& Canonical(const fs::path& folder) {
    const auto [found, is_new] = canonical_.try_emplace(folder);
    if (is_new) found->second = CanonicalPath(folder);
    return found->second;
  }

  std::map<fs::path, fs::path> canonical_;
  fs::path page_, units_;
};

/// The numbers in digits of base 64 ("A" is 0), each with as many digits as the greatest needs.
std::string Packed(const std::vector<std::uint32_t>& numbers) {
  constexpr std::string_view kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  constexpr std::uint32_t kBase = kDigits.size();
  std::size_t width = 0;
  for (std::uint32_t most = numbers.empty() ? 0 : *std::ranges::max_element(numbers); most > 0;
       most /= kBase) {
    ++width;
  }
  std::string text(width * numbers.size(), 'A');
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    std::uint32_t rest = numbers[i];
    for (std::size_t place = (i + 1) * width; rest > 0; rest /= kBase) {
      text[--place] = kDigits[rest % kBase];
    }
  }
  return text;
}

/// One word for each run, stored as an index into the sorted list of distinct words. A run without
/// a word has the empty word.
class WordColumn {
 public:
  void Set(std::size_t run, const std::string& word) {
    const auto [found, is_new] =
        places_.try_emplace(word, static_cast<std::uint32_t>(places_.size()));
    of_.resize(run + 1, kUnset);
    of_[run] = found->second;
  }
  Json ToJson(std::size_t runs) {
    of_.resize(runs, kUnset);
    if (std::ranges::find(of_, kUnset) != of_.end())
      places_.try_emplace("", static_cast<std::uint32_t>(places_.size()));
    std::vector<std::uint32_t> sorted(places_.size());
    Json words = Json::array();
    for (const auto& [word, place] : places_) {
      sorted[place] = static_cast<std::uint32_t>(words.size());
      words.push_back(word);
    }
    // The empty word sorts first, so its index is 0.
    for (std::uint32_t& place : of_) place = place == kUnset ? 0 : sorted[place];
    return {{"words", words}, {"of", Packed(of_)}};
  }

 private:
  static constexpr auto kUnset = static_cast<std::uint32_t>(-1);  // No index.
  std::map<std::string, std::uint32_t> places_;
  std::vector<std::uint32_t> of_;
};

/// A time for each run, in whole seconds.
class MomentColumn {
 public:
  void Add(const std::string& moment) { seconds_.push_back(line::SecondsOf(moment)); }
  /// `from` is the earliest time. `of` has whole seconds since `from`, plus 1; 0: unknown time.
  Json ToJson() const {
    double from = line::kNotKnown;
    for (const double one : seconds_) from = std::fmin(from, one);
    std::vector<std::uint32_t> numbers;
    for (const double one : seconds_) {
      const double after = one - from;
      numbers.push_back(std::isfinite(after) ? 1 + static_cast<std::uint32_t>(after) : 0);
    }
    return {{"from", from}, {"of", Packed(numbers)}};
  }

 private:
  std::vector<double> seconds_;
};

/// A number for each run, or none, as the first 30 bits of a float. The rounding error is at most
/// 2⁻²² of the number, which is below the last digit shown.
class NumberColumn {
 public:
  void Set(std::size_t run, double value) {
    values_.resize(run + 1, kNone);
    values_[run] = static_cast<float>(value);
  }
  std::string ToText(std::size_t runs) {
    values_.resize(runs, kNone);
    std::vector<std::uint32_t> numbers;
    for (const float value : values_) {
      constexpr std::uint32_t kHalf = 2;  // Half a unit of the last bit kept.
      numbers.push_back(std::isfinite(value) ? (std::bit_cast<std::uint32_t>(value) + kHalf) >> 2U
                                             : std::bit_cast<std::uint32_t>(kNone) >> 2U);
    }
    return Packed(numbers);
  }

 private:
  static constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
  std::vector<float> values_;
};

/// A unit on the page.
struct PageUnit {
  std::string serial, run;  ///< run: the current run.
  std::string verdict, code, first_verdict;
  bool is_decided = false;               ///< A decision is in force.
  std::uint32_t runs = 0, counting = 0;  ///< Number of runs; index of the current run.
};

/// A parameter, or a quantity with limits.
struct PageColumn {
  std::string name;
  bool is_judged = false;
  NumberColumn values = {};
  WordColumn sigmas = {};  ///< Rounded to two digits.
  WordColumn limits = {};  ///< "[lower,target,upper,inside]"; null: open.
};

bool IsGood(const std::string& verdict) {
  const std::optional<Verdict> known = VerdictFromName(verdict);
  return known && !IsRed(*known);
}

/// The selected units and all their runs.
class PageData {
 public:
  PageData(Store& store, const FleetPageOptions& options)
      : store_(store), where_(options.where), reports_(options.store, options.folder) {}

  Status Read() {
    TRUETRIAD_RETURN_IF_ERROR(ReadUnits());
    TRUETRIAD_RETURN_IF_ERROR(ReadDecisions());
    std::vector<UnitRun> of_unit;
    TRUETRIAD_RETURN_IF_ERROR(store_.ForEachRun({.is_whole = false}, [&](UnitRun run) -> Status {
      if (!of_unit.empty() && of_unit.front().serial != run.serial) TakeUnit(&of_unit);
      of_unit.push_back(std::move(run));
      return {};
    }));
    if (!of_unit.empty()) TakeUnit(&of_unit);
    return {};
  }

  FleetPageSummary Summary() const {
    FleetPageSummary summary{.units = units_.size(),
                             .runs = runs_,
                             .reports = links_,
                             .draws_charts = !ChartAssets().empty()};
    for (const PageUnit& unit : units_) {
      summary.good += IsGood(unit.verdict) ? 1 : 0;
      summary.good_without_limits += unit.verdict == VerdictName(Verdict::kNoLimits) ? 1 : 0;
      summary.good_at_first += IsGood(unit.first_verdict) ? 1 : 0;
    }
    return summary;
  }

  /// The text of data.js, including the statistics `line`.
  std::string Script(Json line) {
    Json data = {{"serials", Json::array()}};
    std::vector<std::uint32_t> runs, counting;
    WordColumn verdicts, codes;
    for (std::size_t i = 0; i < units_.size(); ++i) {
      data["serials"].push_back(units_[i].serial);
      verdicts.Set(i, units_[i].verdict);
      codes.Set(i, units_[i].code);
      runs.push_back(units_[i].runs);
      counting.push_back(units_[i].counting);
    }
    data["verdict"] = verdicts.ToJson(units_.size());
    data["code"] = codes.ToJson(units_.size());
    data["runs"] = Packed(runs);
    data["counting"] = Packed(counting);
    Json& of_runs = data["of_runs"] = {{"recorded", recorded_.ToJson()},
                                       {"created", created_.ToJson()},
                                       {"decided", std::move(decided_runs_)},
                                       {"report", std::move(reports_of_)}};
    for (auto& [name, words] : words_) of_runs[name] = words.ToJson(runs_);
    data["tags"] = Json::array();
    const Tags names;
    TagFields(
        [&](std::string_view name, const std::string&) {
          const auto found = tags_.find(name);
          if (found == tags_.end()) return;
          data["tags"].push_back(found->second.ToJson(runs_));
          data["tags"].back()["name"] = name;
        },
        names);
    data["columns"] = Json::array();
    for (PageColumn& column : columns_) {
      Json json = {{"name", column.name},
                   {"values", column.values.ToText(runs_)},
                   {"sigmas", column.sigmas.ToJson(runs_)}};
      if (column.is_judged) json["limits"] = column.limits.ToJson(runs_);
      const Result<LimitName> name = ParseLimitName(column.name);
      if (column.is_judged && name && name->Unit() != "1") json["unit"] = DisplayUnit(name->Unit());
      data["columns"].push_back(std::move(json));
    }
    data["line"] = std::move(line);
    return "var truetriadFleet=" + ScriptOf(data) + ";\n";
  }

 private:
  Status ReadUnits() {
    TRUETRIAD_ASSIGN_OR_RETURN(const Table table,
                               store_.Query("SELECT serial, run, final_verdict, " +
                                            std::string(kReason) + ", first_verdict, disposed_by" +
                                            FromWhere("standing", where_) + " ORDER BY serial"));
    for (const auto& row : table.rows) {
      const auto text = [&row](std::size_t column) { return row[column].value_or(""); };
      places_[text(0)] = units_.size();
      units_.push_back({text(0), text(1), text(2), text(3), text(4), row[5].has_value()});
    }
    return {};
  }

  /// Reads the decisions about each run. Each decision gets an end: empty if it holds; "later" if
  /// another decision followed; otherwise the name of the current run, which ended the decision.
  Status ReadDecisions() {
    TRUETRIAD_ASSIGN_OR_RETURN(const Decisions decisions, store_.ReadDecisions());
    TRUETRIAD_ASSIGN_OR_RETURN(const std::vector<std::string> given_up,
                               store_.QueryTexts("SELECT DISTINCT disposition FROM given_up"));
    const std::set<std::string> giving_up(given_up.begin(), given_up.end());
    std::unordered_map<std::string, std::string> last;
    for (const Disposition& one : decisions.dispositions) last[one.serial] = one.id;
    for (const Disposition& one : decisions.dispositions) {
      const auto unit = places_.find(one.serial);
      if (unit == places_.end()) continue;
      const PageUnit& of = units_[unit->second];
      const std::string end = giving_up.contains(one.id)   ? ""
                              : last[one.serial] != one.id ? "later"
                              : of.is_decided              ? ""
                                                           : of.run;
      Json& list = decided_.try_emplace(one.run, Json::array()).first->second;
      const std::string why = (one.GivesUp() ? "wrong serial number: " : "") + one.why;
      list.push_back({one.created, one.who, VerdictName(one.verdict), why, end});
    }
    return {};
  }

  PageColumn& ColumnOf(const std::string& name, bool is_judged) {
    const auto [found, is_new] = column_of_.try_emplace({is_judged, name}, columns_.size());
    if (is_new) columns_.push_back({.name = name, .is_judged = is_judged});
    return columns_[found->second];
  }

  /// Adds the runs of a unit in the order of measurement.
  void TakeUnit(std::vector<UnitRun>* runs) {
    const auto found = places_.find(runs->front().serial);
    if (found != places_.end()) {
      PageUnit& unit = units_[found->second];
      std::ranges::sort(*runs, {}, [](const UnitRun& run) {
        return std::tuple(run.recorded, run.recorded.empty() ? "" : run.log, run.id);
      });
      for (const UnitRun& run : *runs) {
        if (run.id == unit.run) unit.counting = unit.runs;
        ++unit.runs;
        Take(run);
      }
    }
    runs->clear();
  }

  void Take(const UnitRun& run) {
    const std::size_t number = runs_++;
    const auto decided = decided_.find(run.id);
    if (decided != decided_.end()) {
      decided_runs_[std::to_string(number)] = std::move(decided->second);
    }
    recorded_.Add(run.recorded);
    created_.Add(run.created);
    auto [folder, report] = reports_.LinkTo(run.folder);
    links_ += report.empty() ? 0 : 1;
    words_["folder"].Set(number, folder);
    reports_of_.push_back(std::move(report));
    words_["verdict"].Set(number, std::string(VerdictName(run.verdict)));
    words_["code"].Set(number, run.code);
    words_["message"].Set(number, run.message);
    words_["by"].Set(number, run.recorded_by);
    TagFields(
        [&](std::string_view name, const std::string& value) {
          if (!value.empty()) tags_[std::string(name)].Set(number, value);
        },
        run.tags);
    const auto set = [&](PageColumn* column, double value, double sigma) {
      column->values.Set(number, value);
      column->sigmas.Set(number, sigma > 0.0 ? Significant(sigma, 2) : "");
    };
    for (const Parameter& parameter : run.parameters) {
      set(&ColumnOf(parameter.name, false), parameter.value, parameter.sigma);
    }
    for (const LimitCheck& check : run.judgements) {
      PageColumn& column = ColumnOf(check.FullName(), true);
      set(&column, check.worst, check.sigma);
      // For a quantity that is never negative "within ± 0.5" means "at most 0.5".
      const Result<LimitName> name = ParseLimitName(check.FullName());
      const bool is_open = name && name->IsNeverNegative() && !(check.limit.lower > 0.0);
      const auto side = [](double limit) { return std::isfinite(limit) ? Json(limit) : Json(); };
      const Json limits = {is_open ? Json() : side(check.limit.lower),
                           check.limit.target ? Json(*check.limit.target) : Json(),
                           side(check.limit.upper),
                           check.pass};
      column.limits.Set(number, limits.dump());
    }
  }

  Store& store_;
  std::string where_;
  Reports reports_;
  std::vector<PageUnit> units_;                          ///< In the order of serial numbers.
  std::unordered_map<std::string, std::size_t> places_;  ///< Index in units_ by serial.
  std::unordered_map<std::string, Json> decided_;        ///< Decisions by name of run.
  Json decided_runs_ = Json::object();                   ///< Decisions by index of run.
  std::size_t runs_ = 0;                                 ///< Runs added so far.
  MomentColumn recorded_, created_;
  Json reports_of_ = Json::array();          ///< Links by index of run.
  std::map<std::string, WordColumn> words_;  ///< Other columns of runs.
  std::map<std::string, WordColumn, std::less<>> tags_;
  std::vector<PageColumn> columns_;
  std::map<std::pair<bool, std::string>, std::size_t> column_of_;
  std::size_t links_ = 0;
};

/// The line's statistics for the units that `where` selects, as of the time of the last unit or
/// station check.
Result<Json> LineJson(Store& store, const std::string& where) {
  SummaryOptions options{.where = where, .chart_points = kPointsOfChart};
  TRUETRIAD_ASSIGN_OR_RETURN(
      const Table last,
      store.Query("SELECT max(created) FROM (SELECT created" + FromWhere("standing", where) +
                  " UNION ALL SELECT created FROM station_check) AS either"));
  // The clock of a station may be ahead, so this time is at most the present.
  options.now = std::min(last.rows[0][0].value_or(""), TimestampUtc());
  TRUETRIAD_ASSIGN_OR_RETURN(Json summary, Summarise(store, options));
  // Six digits resolve a pixel of any screen.
  const auto rounded = [](const Json& value) {
    const double number = value.get<double>();
    return std::isfinite(number) ? Json(std::strtod(Significant(number, 6).c_str(), nullptr))
                                 : Json();
  };
  for (Json& station : summary["charts"]) {
    for (Json& chart : station["charts"]) {
      for (Json& point : chart["points"]) {
        point = {point["serial"],
                 rounded(point["value"]),
                 rounded(point["lower"]),
                 rounded(point["upper"])};
      }
    }
  }
  return Json({{"tables", SummaryTables(summary)}, {"charts", std::move(summary["charts"])}});
}

/// An index.html that contains this text was written by `fleet report`.
constexpr std::string_view kDataScript = "<script defer src=\"data.js\"></script>";

/// Error (bad input): the index exists and was not written by `fleet report`.
Status CheckIndex(const std::string& index) {
  std::error_code failure;
  if (!fs::exists(index, failure)) return {};
  const Result<std::string> text = LookAtSmallFile(index);
  if (text && text->find(kDataScript) != std::string::npos) return {};
  return Error(ErrorCode::kOutputInTheWay,
               {index},
               "was not written by `fleet report`; name another folder for the page");
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
       std::to_string(page.good) + " of " + std::to_string(page.units) + " units" +
           (page.good_without_limits == 0
                ? ""
                : ", of these " + std::to_string(page.good_without_limits) + " without limits") +
           "; " + share(page.good_at_first) + " good at the first run."},
      {"origin",
       EscapeMarkup(
           std::to_string(page.units) + " units, " + std::to_string(page.runs) +
           " runs; each unit is shown by its current run. Times are UTC. Written by truetriad " +
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
  const auto path = [&options](std::string_view name) {
    return (fs::path(options.folder) / name).string();
  };
  TRUETRIAD_RETURN_IF_ERROR(CheckIndex(path("index.html")));
  // The line's statistics come first, so that their memory is free before the page is built.
  TRUETRIAD_ASSIGN_OR_RETURN(const Json line, LineJson(store, options.where));
  PageData data(store, options);
  TRUETRIAD_RETURN_IF_ERROR(data.Read());
  const FleetPageSummary summary = data.Summary();
  if (summary.units == 0) {
    return Error(ErrorCode::kNoReadings,
                 {ShownStore(options.store)},
                 options.where.empty() ? "has no runs yet; `truetriad fleet run` adds them"
                                       : "has no units with --where=" + options.where);
  }
  TRUETRIAD_RETURN_IF_ERROR(EnsureWritableDirectory(path("assets")));
  WholeFiles files;
  TRUETRIAD_RETURN_IF_ERROR(files.Write(path("assets/report.css"), ReportStyleSheet()));
  for (const auto* const assets : {&FleetPageAssets(), &ChartAssets()}) {
    for (const PageAsset& asset : *assets) {
      TRUETRIAD_RETURN_IF_ERROR(files.Write(path(asset.name), asset.text));
    }
  }
  TRUETRIAD_RETURN_IF_ERROR(files.Write(path("data.js"), data.Script(line)));
  TRUETRIAD_RETURN_IF_ERROR(files.Write(path("index.html"), PageHtml(summary)));
  TRUETRIAD_RETURN_IF_ERROR(files.Commit());
  return summary;
}

}  // namespace truetriad::fleet
