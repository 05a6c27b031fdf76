// SPDX-License-Identifier: Apache-2.0
#include "fleet/line_selection.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <utility>

#include "truetriad/model/tags.h"

namespace truetriad::fleet {
namespace {

/// Names of values that a message lists.
constexpr std::size_t kMostListed = 8;

template <typename Take>
void ForEachTag(Take take) {
  for (const TagKey& tag : kDeviceTags) take(std::string(tag.key));
  for (const TagKey& tag : kRunTags) take(std::string(tag.key));
}

/// Whether `moment` has the form of `pattern`, in which a 0 is any digit.
bool HasForm(std::string_view moment, std::string_view pattern) {
  return moment.size() == pattern.size() &&
         std::equal(moment.begin(), moment.end(), pattern.begin(), [](char c, char wanted) {
           return wanted == '0' ? c >= '0' && c <= '9' : c == wanted;
         });
}

/// "2026-11-24T06:00" of that, with a blank for the T, or a Z behind it: what is stored begins so.
Result<std::string> MomentOf(const std::string& flag, const std::string& stated) {
  constexpr std::string_view kWhole = "0000-00-00T00:00:00";
  std::string moment = stated;
  if (moment.size() > 10 && moment[10] == ' ') moment[10] = 'T';
  if (moment.size() > 10 && moment.back() == 'Z') moment.pop_back();
  bool is_moment = false;
  for (const std::size_t length : {4, 7, 10, 13, 16, 19}) {
    is_moment = is_moment || HasForm(moment, kWhole.substr(0, length));
  }
  if (is_moment) {
    const std::string whole = moment + std::string("0001-01-01T00:00:00").substr(moment.size());
    int year = 0;
    unsigned month = 0, day = 0, hour = 0, minute = 0, second = 0;
    std::sscanf(
        whole.c_str(), "%4d-%2u-%2uT%2u:%2u:%2u", &year, &month, &day, &hour, &minute, &second);
    const std::chrono::year_month_day date{
        std::chrono::year(year), std::chrono::month(month), std::chrono::day(day)};
    is_moment = date.ok() && hour < 24 && minute < 60 && second < 60;
  }
  if (is_moment) return moment;
  return Error(ErrorCode::kInvalidArgument,
               "--" + flag + "=" + stated +
                   " is no moment; expected one in UTC, or how it begins, as in 2026-11-24 or "
                   "2026-11-24T06:00");
}

Status CheckIsThere(Store& store, const std::string& tag, const std::string& value) {
  if (value.empty()) return {};
  TRUETRIAD_ASSIGN_OR_RETURN(const Table table,
                             store.Query("SELECT DISTINCT value FROM tag WHERE name = " +
                                         SqlText(tag) + " ORDER BY value"));
  std::string there;
  for (std::size_t i = 0; i < table.rows.size(); ++i) {
    const std::string name = table.rows[i][0].value_or("");
    if (name == value) return {};
    if (i < kMostListed) there += (i > 0 ? ", " : "") + name;
  }
  if (table.rows.size() > kMostListed) there += ", …";
  return Error(ErrorCode::kUnknownName,
               "--" + tag + "=" + value + ": no run in the store has this " + tag +
                   (there.empty() ? ", or any" : "; there are " + there));
}

}  // namespace

Result<LineSelection> CheckedSelection(Store& store, LineSelection selection) {
  if (!selection.since.empty()) {
    TRUETRIAD_ASSIGN_OR_RETURN(selection.since, MomentOf("since", selection.since));
  }
  if (!selection.until.empty()) {
    TRUETRIAD_ASSIGN_OR_RETURN(selection.until, MomentOf("until", selection.until));
  }
  if (!selection.since.empty() && !selection.until.empty() && selection.since >= selection.until) {
    return Error(ErrorCode::kConflictingArguments,
                 "--since=" + selection.since + " is not before --until=" + selection.until);
  }
  TRUETRIAD_RETURN_IF_ERROR(CheckIsThere(store, "lot", selection.lot));
  TRUETRIAD_RETURN_IF_ERROR(CheckIsThere(store, "station", selection.station));
  return selection;
}

Status CheckIsTag(std::string_view flag, const std::string& tag) {
  std::string tags;
  bool is_there = false;
  ForEachTag([&](const std::string& key) {
    is_there = is_there || key == tag;
    tags += (tags.empty() ? "" : ", ") + key;
  });
  if (is_there) return {};
  return Error(ErrorCode::kInvalidArgument,
               "--" + std::string(flag) + "=" + tag + " is no tag; there are " + tags);
}

std::string OrderOfTime(const std::string& of) {
  return of + ".recorded, CASE WHEN " + of + ".recorded <> '' THEN " + of + ".log END, " + of +
         ".run";
}

std::string SqlText(std::string_view text) {
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? "''" : std::string(1, c);
  return quoted + '\'';
}

std::string FromWhere(std::string_view source, const LineSelection& selection) {
  std::string from = " FROM (SELECT source.*";
  ForEachTag([&from](const std::string& key) {
    from += ", (SELECT value FROM tag WHERE tag.run = source.run AND tag.name = '" + key +
            "') AS \"" + key + '"';
  });
  from.append(" FROM ").append(source).append(" AS source) AS tagged WHERE TRUE");
  if (!selection.since.empty()) from += " AND recorded >= " + SqlText(selection.since);
  if (!selection.until.empty()) from += " AND recorded < " + SqlText(selection.until);
  if (!selection.lot.empty()) from += " AND lot = " + SqlText(selection.lot);
  if (!selection.station.empty()) from += " AND station = " + SqlText(selection.station);
  // On a line of its own, so that a comment ends with it.
  if (!selection.where.empty()) from += " AND (" + selection.where + "\n)";
  return from;
}

}  // namespace truetriad::fleet
