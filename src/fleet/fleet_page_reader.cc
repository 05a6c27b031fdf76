// SPDX-License-Identifier: Apache-2.0
#include "fleet/fleet_page_reader.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <limits>
#include <optional>
#include <set>
#include <system_error>
#include <unordered_map>
#include <utility>

#include "fleet/fleet_page_script.h"
#include "fleet/line_selection.h"
#include "fleet/unit_folders.h"
#include "line/line_data.h"
#include "truetriad/model/limits.h"
#include "truetriad/model/tags.h"

namespace truetriad::fleet {
namespace {

namespace fs = std::filesystem;

constexpr float kNoValue = std::numeric_limits<float>::quiet_NaN();

using TableRow = std::vector<std::optional<std::string>>;

double FieldNumber(const std::optional<std::string>& text) {
  double number = std::numeric_limits<double>::quiet_NaN();
  if (text) std::from_chars(text->data(), text->data() + text->size(), number);
  return number;
}

/// Seconds since 1970; 0 where it is no moment.
std::int64_t WholeSecondsOf(const std::string& moment) {
  const double seconds = line::SecondsOf(moment);
  return std::isfinite(seconds) ? static_cast<std::int64_t>(seconds) : 0;
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

/// The lists of what belongs to a run, in the making.
struct RunScript {
  std::string head, tags, parameters, judgements, findings, dispositions;
};

void AppendItem(const std::string& item, std::string* list) {
  *list += (list->empty() ? "" : ",") + item;
}

std::string ScriptText(const std::optional<std::string>& text) {
  std::string script;
  AppendText(text.value_or(""), &script);
  return script;
}

/// A number as the store says it, or null.
std::string ScriptNumber(const std::optional<std::string>& text) {
  return std::isfinite(FieldNumber(text)) ? *text : "null";
}

class PageReader {
 public:
  PageReader(Store& store, Reports reports) : store_(store), reports_(std::move(reports)) {}

  /// Their number.
  Result<std::size_t> ReadUnits(const std::string& where) {
    TRUETRIAD_ASSIGN_OR_RETURN(
        const Table table,
        store_.Query("SELECT serial, run, recorded, final_verdict, " + std::string(kReason) +
                     ", first_verdict, (SELECT count(*) FROM run AS one WHERE one.serial = "
                     "tagged.serial), disposed_by" +
                     FromWhere("standing", {.where = where}) + " ORDER BY serial"));
    for (const TableRow& row : table.rows) {
      units_.serials.push_back(row[0].value_or(""));
      units_.runs.push_back(row[1].value_or(""));
      units_.recorded_s.push_back(WholeSecondsOf(row[2].value_or("")));
      units_.verdict.of.push_back(units_.verdict.NumberOf(row[3].value_or("")));
      units_.code.of.push_back(units_.code.NumberOf(row[4].value_or("")));
      units_.first_verdict.of.push_back(units_.first_verdict.NumberOf(row[5].value_or("")));
      units_.run_count.push_back(static_cast<std::uint32_t>(FieldNumber(row[6])));
      is_decided_.push_back(row[7].has_value());
    }
    const auto add = [&](const TagKey& tag) {
      if (tag.key != "note") units_.tags.emplace_back(std::string(tag.key));
    };
    for (const TagKey& tag : kRunTags) add(tag);
    for (const TagKey& tag : kDeviceTags) add(tag);
    for (PageWords& tag : units_.tags) tag.of.assign(units_.size(), tag.NumberOf(""));
    return units_.size();
  }

  /// The runs of units `begin` to `end`, as a script.
  Result<std::string> ReadPart(std::size_t part, std::size_t begin, std::size_t end) {
    runs_.clear();
    unit_of_.clear();
    for (std::size_t i = begin; i < end; ++i) unit_of_[units_.serials[i]] = i;
    range_ = "serial BETWEEN " + SqlText(units_.serials[begin]) + " AND " +
             SqlText(units_.serials[end - 1]);
    std::vector<std::vector<std::string>> runs_of(end - begin);
    TRUETRIAD_RETURN_IF_ERROR(ReadRuns(begin, &runs_of));
    TRUETRIAD_RETURN_IF_ERROR(ReadTags());
    TRUETRIAD_RETURN_IF_ERROR(ReadParameters());
    TRUETRIAD_RETURN_IF_ERROR(ReadJudgements());
    TRUETRIAD_RETURN_IF_ERROR(ReadFindings());
    TRUETRIAD_RETURN_IF_ERROR(ReadDispositions());
    std::string script = "truetriadPart(" + std::to_string(part) + ",";
    AppendList(
        runs_of,
        [&](const std::vector<std::string>& runs, std::string* text) {
          *text += '\n';
          AppendList(
              runs,
              [&](const std::string& run, std::string* list) {
                const RunScript& of = runs_[run];
                *list += '{' + of.head + ",\"tags\":[" + of.tags + "],\"parameters\":[" +
                         of.parameters + "],\"judged\":[" + of.judgements + "],\"findings\":[" +
                         of.findings + "],\"dispositions\":[" + of.dispositions + "]}";
              },
              text);
        },
        &script);
    return script + ");\n";
  }

  PageUnits Take() {
    units_.verdict.Sort();
    units_.first_verdict.Sort();
    units_.code.Sort();
    for (PageWords& tag : units_.tags) tag.Sort();
    std::erase_if(units_.tags, [](const PageWords& tag) {
      return tag.words.empty() || (tag.words.size() == 1 && tag.words[0].empty());
    });
    return std::move(units_);
  }

 private:
  /// Calls `use(run, row)` for the rows of `columns` of `table`, the first of which is the run.
  template <typename Use>
  Status ForRows(const std::string& columns,
                 const std::string& table,
                 const std::string& order,
                 const Use& use) {
    const std::string join = table.empty() ? "" : " JOIN " + table + " USING (run)";
    TRUETRIAD_ASSIGN_OR_RETURN(const Table found,
                               store_.Query("SELECT run, " + columns + " FROM run" + join +
                                            " WHERE " + range_ + " ORDER BY " + order));
    for (const TableRow& row : found.rows) {
      if (table.empty() || runs_.contains(row[0].value_or(""))) use(row[0].value_or(""), row);
    }
    return {};
  }

  /// Of the run's unit, where the run is the one that counts.
  std::optional<std::size_t> UnitCountingBy(const std::string& run) const {
    const auto unit = unit_of_run_.find(run);
    if (unit == unit_of_run_.end()) return std::nullopt;
    return unit->second;
  }

  Status ReadRuns(std::size_t begin, std::vector<std::vector<std::string>>* runs_of) {
    unit_of_run_.clear();
    return ForRows(
        "serial, created, verdict, code, message, log, software, folder, recorded, "
        "recorded_by",
        "",
        "serial, " + OrderOfTime("run"),
        [&](const std::string& run, const TableRow& row) {
          const auto unit = unit_of_.find(row[1].value_or(""));
          if (unit == unit_of_.end()) return;
          const std::size_t at = unit->second;
          if (units_.runs[at] == run) unit_of_run_[run] = at;
          (*runs_of)[at - begin].push_back(run);
          const std::string link = reports_.LinkTo(row[8].value_or(""));
          if (!link.empty()) ++units_.reports;
          runs_[run].head =
              "\"run\":" + ScriptText(run) + ",\"counts\":" + (units_.runs[at] == run ? "1" : "0") +
              ",\"created\":" + ScriptText(row[2]) + ",\"recorded\":" + ScriptText(row[9]) +
              ",\"by\":" + ScriptText(row[10]) + ",\"verdict\":" + ScriptText(row[3]) +
              ",\"code\":" + ScriptText(row[4]) + ",\"message\":" + ScriptText(row[5]) +
              ",\"log\":" + ScriptText(row[6]) + ",\"software\":" + ScriptText(row[7]) +
              ",\"report\":" + ScriptText(link);
        });
  }

  Status ReadTags() {
    return ForRows(
        "name, value", "tag", "run, name", [&](const std::string& run, const TableRow& row) {
          AppendItem('[' + ScriptText(row[1]) + ',' + ScriptText(row[2]) + ']', &runs_[run].tags);
          const auto unit = UnitCountingBy(run);
          if (!unit) return;
          for (PageWords& tag : units_.tags) {
            if (tag.name == row[1]) tag.of[*unit] = tag.NumberOf(row[2].value_or(""));
          }
        });
  }

  std::size_t ColumnOf(const std::string& name, bool is_judged) {
    const auto [found, is_new] = column_of_.try_emplace({is_judged, name}, units_.columns.size());
    if (is_new) {
      units_.columns.push_back({.name = name, .is_judged = is_judged});
      units_.columns.back().values.assign(units_.size(), kNoValue);
    }
    return found->second;
  }

  Status ReadParameters() {
    return ForRows("name, value, sigma",
                   "parameter",
                   "run, place",
                   [&](const std::string& run, const TableRow& row) {
                     const std::size_t column = ColumnOf(row[1].value_or(""), false);
                     AppendItem(std::to_string(column) + ',' + ScriptNumber(row[2]) + ',' +
                                    ScriptNumber(row[3]),
                                &runs_[run].parameters);
                     if (const auto unit = UnitCountingBy(run)) {
                       units_.columns[column].values[*unit] =
                           static_cast<float>(FieldNumber(row[2]));
                     }
                   });
  }

  Status ReadJudgements() {
    return ForRows(
        "name, component, lower, target, upper, value, sigma, pass",
        "judgement",
        "run, place",
        [&](const std::string& run, const TableRow& row) {
          const std::string component = row[2].value_or("");
          const std::size_t at =
              ColumnOf(row[1].value_or("") + (component.empty() ? "" : "." + component), true);
          // "within ± 0.5" is "at most 0.5" of what is never negative.
          const Result<LimitName> name = ParseLimitName(units_.columns[at].name);
          std::array<std::optional<std::string>, 3> limits = {row[3], row[4], row[5]};
          if (name && name->IsNeverNegative() && !(FieldNumber(row[3]) > 0.0)) limits[0].reset();
          std::string item = '[' + std::to_string(at);
          for (const auto& limit : limits) item += ',' + ScriptNumber(limit);
          for (std::size_t i = 6; i < 9; ++i) item += ',' + ScriptNumber(row[i]);
          AppendItem(item + ']', &runs_[run].judgements);
          const auto unit = UnitCountingBy(run);
          if (!unit) return;
          PageColumn& column = units_.columns[at];
          column.values[*unit] = static_cast<float>(FieldNumber(row[6]));
          const std::array<std::string, 3> stated = {
              limits[0].value_or(""), limits[1].value_or(""), limits[2].value_or("")};
          const std::array<std::string, 3> known = {column.lower, column.target, column.upper};
          if (has_limits_.insert(at).second) {
            column.lower = stated[0];
            column.target = stated[1];
            column.upper = stated[2];
          } else if (stated != known) {
            column.limits_differ = true;
          }
        });
  }

  Status ReadFindings() {
    return ForRows("severity, finding.code, text, remedy",
                   "finding",
                   "run, place",
                   [&](const std::string& run, const TableRow& row) {
                     AppendItem('[' + ScriptText(row[1]) + ',' + ScriptText(row[2]) + ',' +
                                    ScriptText(row[3]) + ',' + ScriptText(row[4]) + ']',
                                &runs_[run].findings);
                   });
  }

  /// Each with what has become of it: nothing, "later" (another decision), or the run by which it
  /// is lifted.
  Status ReadDispositions() {
    struct Decided {
      std::string run, item;
      std::size_t unit;
    };
    std::vector<Decided> decided;                       // In their order.
    std::unordered_map<std::size_t, std::size_t> last;  // Of a unit, its place there.
    TRUETRIAD_RETURN_IF_ERROR(ForRows("disposition.created, who, disposition.verdict, why, serial",
                                      "disposition",
                                      "disposition",
                                      [&](const std::string& run, const TableRow& row) {
                                        const auto unit = unit_of_.find(row[5].value_or(""));
                                        if (unit == unit_of_.end()) return;
                                        last[unit->second] = decided.size();
                                        decided.push_back(
                                            {run,
                                             ScriptText(row[1]) + ',' + ScriptText(row[2]) + ',' +
                                                 ScriptText(row[3]) + ',' + ScriptText(row[4]),
                                             unit->second});
                                      }));
    for (std::size_t i = 0; i < decided.size(); ++i) {
      const auto& [run, item, unit] = decided[i];
      const std::string end = last[unit] != i     ? "later"
                              : is_decided_[unit] ? ""
                                                  : units_.runs[unit];
      AppendItem('[' + item + ',' + ScriptText(end) + ']', &runs_[run].dispositions);
    }
    return {};
  }

  Store& store_;
  Reports reports_;
  PageUnits units_;
  std::map<std::pair<bool, std::string>, std::size_t> column_of_;
  std::set<std::size_t> has_limits_;
  std::vector<bool> is_decided_;  ///< By unit: a decision holds.
  // Of the part in hand.
  std::string range_;
  std::unordered_map<std::string, RunScript> runs_;
  std::unordered_map<std::string, std::size_t> unit_of_, unit_of_run_;
};

}  // namespace

std::uint32_t PageWords::NumberOf(const std::string& word) {
  const auto [found, is_new] = numbers_.try_emplace(word, static_cast<std::uint32_t>(words.size()));
  if (is_new) words.push_back(word);
  return found->second;
}

void PageWords::Sort() {
  std::vector<bool> is_used(words.size(), false);
  for (const std::uint32_t number : of) is_used[number] = true;
  std::vector<std::string> sorted;
  std::vector<std::uint32_t> to(words.size(), 0);
  for (const auto& [word, number] : numbers_) {
    if (!is_used[number]) continue;
    to[number] = static_cast<std::uint32_t>(sorted.size());
    sorted.push_back(word);
  }
  for (std::uint32_t& number : of) number = to[number];
  words = std::move(sorted);
  numbers_.clear();
  for (std::uint32_t i = 0; i < words.size(); ++i) numbers_[words[i]] = i;
}

Result<PageUnits> ReadPageUnits(
    Store& store,
    const std::string& store_name,
    const std::string& where,
    const std::string& page_folder,
    const std::function<Status(std::size_t part, const std::string& script)>& add_part) {
  PageReader reader(store, Reports(store_name, page_folder));
  TRUETRIAD_ASSIGN_OR_RETURN(const std::size_t count, reader.ReadUnits(where));
  for (std::size_t begin = 0, part = 0; begin < count; begin += kUnitsInPart, ++part) {
    const std::size_t end = std::min(count, begin + kUnitsInPart);
    TRUETRIAD_ASSIGN_OR_RETURN(const std::string script, reader.ReadPart(part, begin, end));
    TRUETRIAD_RETURN_IF_ERROR(add_part(part, script));
  }
  return reader.Take();
}

}  // namespace truetriad::fleet
