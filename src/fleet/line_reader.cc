// SPDX-License-Identifier: Apache-2.0
#include "fleet/line_reader.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <limits>
#include <map>
#include <optional>
#include <string_view>
#include <tuple>
#include <unordered_map>
#include <utility>

#include "truetriad/model/limits.h"
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

namespace {

constexpr std::string_view kReference = "reference.";

/// Puts together what the tables say of the selected runs.
class LineReader {
 public:
  explicit LineReader(Store& store) : store_(store) {}

  /// `counting`, `measured`: statements that begin with OfUnit or kOfRun.
  Result<LineReading> Read(const std::string& counting, const std::string& measured) {
    TRUETRIAD_RETURN_IF_ERROR(ReadRuns(counting, &Record::counts));
    if (!measured.empty()) {
      TRUETRIAD_RETURN_IF_ERROR(ReadFirstStations());
      TRUETRIAD_RETURN_IF_ERROR(ReadRuns(measured, &Record::is_measured));
    }
    std::sort(records_.begin(), records_.end(), [](const Record& one, const Record& other) {
      // This is OrderOfTime; units of one second come in the order of their serial numbers.
      const bool is_same = one.unit.recorded == other.unit.recorded;
      if (is_same && one.unit.recorded.empty()) return one.unit.run < other.unit.run;
      return std::tie(one.unit.recorded, one.unit.serial, one.log, one.unit.run) <
             std::tie(other.unit.recorded, other.unit.serial, other.log, other.unit.run);
    });
    for (std::size_t begin = 0; begin < records_.size(); begin += kRunsAQuestion) {
      const std::size_t end = std::min(begin + kRunsAQuestion, records_.size());
      TRUETRIAD_RETURN_IF_ERROR(ReadPiece(begin, end));
    }
    return Finish();
  }

 private:
  struct Record {
    line::UnitRecord unit;
    UnitCourse course;
    std::string log;
    std::vector<double> values, sigma;  // by parameter, as far as it has them
    bool counts = false, is_measured = false;
    int unit_place = -1;  // in LineReading::data
  };
  struct Judged {
    int record;
    double lower, upper, target, value, sigma;
    bool pass;
  };

  /// Those that are there already have the property, too.
  Status ReadRuns(const std::string& select, bool Record::*property) {
    TRUETRIAD_ASSIGN_OR_RETURN(const Table table, store_.Query(select));
    places_.clear();
    for (std::size_t i = 0; i < records_.size(); ++i) places_[records_[i].unit.run] = i;
    records_.reserve(records_.size() + table.rows.size());
    for (const std::vector<Cell>& row : table.rows) {
      if (const auto known = places_.find(row[0].value_or("")); known != places_.end()) {
        records_[known->second].*property = true;
        continue;
      }
      const auto text = [&row](std::size_t column) { return row[column].value_or(""); };
      Record record;
      record.unit.run = text(0), record.unit.serial = text(1), record.unit.recorded = text(2);
      record.unit.verdict = text(3), record.unit.code = text(4);
      record.course = {.first_verdict = text(5),
                       .final_verdict = text(6),
                       .attempts = NumberOf(row[7], 1),
                       .wall_s = NumberOf(row[8], 0.0),
                       .cpu_s = NumberOf(row[9], 0.0)};
      record.log = text(10), record.course.recorded_by = text(11);
      record.*property = true;
      records_.push_back(std::move(record));
    }
    return {};
  }

  Status ReadFirstStations() {
    TRUETRIAD_ASSIGN_OR_RETURN(
        const Table table,
        store_.Query("SELECT serial, station" + FromWhere("run", {}) +
                     " AND run IN (SELECT run FROM (SELECT run, row_number() OVER (PARTITION BY "
                     "serial ORDER BY " +
                     OrderOfTime("run") + ") AS nth FROM run) AS placed WHERE nth = 1)"));
    std::unordered_map<std::string_view, std::string> stations;
    for (const std::vector<Cell>& row : table.rows) stations[*row[0]] = row[1].value_or("");
    for (Record& record : records_) {
      record.course.first_station = stations[record.unit.serial];
    }
    return {};
  }

  Status ReadPiece(std::size_t begin, std::size_t end) {
    places_.clear();
    for (std::size_t i = begin; i < end; ++i) places_[records_[i].unit.run] = i;
    const std::string of_these = Of(begin, end);
    TRUETRIAD_ASSIGN_OR_RETURN(const Table tags,
                               store_.Query("SELECT run, name, value FROM tag" + of_these));
    for (const std::vector<Cell>& row : tags.rows) {
      records_[places_[*row[0]]].unit.tags[*row[1]] = row[2].value_or("");
    }
    TRUETRIAD_RETURN_IF_ERROR(ReadParameters(of_these));
    return ReadJudgements(of_these);
  }

  std::string Of(std::size_t begin, std::size_t end) const {
    std::string condition = " WHERE run IN (";
    for (std::size_t i = begin; i < end; ++i) {
      condition += (i > begin ? "," : "") + SqlText(records_[i].unit.run);
    }
    return condition + ")";
  }

  /// In an order that does not depend on that of the work, as names are numbered as they come.
  Status ReadParameters(const std::string& of_these) {
    TRUETRIAD_ASSIGN_OR_RETURN(const Table table,
                               store_.Query("SELECT run, name, value, sigma FROM parameter" +
                                            of_these + " ORDER BY place, name, run"));
    for (const std::vector<Cell>& row : table.rows) {
      if (row[1]->starts_with(kReference)) continue;
      const int parameter = PlaceOfParameter(*row[1]);
      Record& record = records_[places_[*row[0]]];
      Put(parameter, NumberOf(row[2], kNone), &record.values);
      Put(parameter, NumberOf(row[3], kNone), &record.sigma);
    }
    return {};
  }

  Status ReadJudgements(const std::string& of_these) {
    TRUETRIAD_ASSIGN_OR_RETURN(
        const Table table,
        store_.Query("SELECT run, name, component, lower, upper, target, value, sigma, pass "
                     "FROM judgement" +
                     of_these));
    for (const std::vector<Cell>& row : table.rows) {
      const std::string name = *row[1] + (row[2]->empty() ? "" : "." + *row[2]);
      if (!records_[places_[*row[0]]].counts) continue;
      judged_[name].push_back({static_cast<int>(places_[*row[0]]),
                               NumberOf(row[3], -kInfinity),
                               NumberOf(row[4], kInfinity),
                               NumberOf(row[5], kNone),
                               NumberOf(row[6], kNone),
                               NumberOf(row[7], kNone),
                               row[8] == "1"});
    }
    return {};
  }

  int PlaceOfParameter(const std::string& name) {
    const auto [at, is_new] = parameters_.try_emplace(name, static_cast<int>(names_.size()));
    if (is_new) names_.push_back(name);
    return at->second;
  }

  static void Put(int place, double value, std::vector<double>* values) {
    const auto at = static_cast<std::size_t>(place);
    if (at >= values->size()) values->resize(at + 1, kNone);
    (*values)[at] = value;
  }

  LineReading Finish() {
    LineReading reading;
    const auto size = static_cast<Eigen::Index>(names_.size());
    for (Record& record : records_) {
      for (const auto& [from, to] :
           {std::pair(&record.values, &record.unit.values), {&record.sigma, &record.unit.sigma}}) {
        from->resize(names_.size(), kNone);
        *to = Eigen::Map<Eigen::VectorXd>(from->data(), size);
        from->clear(), from->shrink_to_fit();
      }
      if (record.is_measured) reading.measured.units.push_back(record.unit);
      if (!record.counts) continue;
      record.unit_place = static_cast<int>(reading.data.units.size());
      reading.data.units.push_back(std::move(record.unit));
      reading.courses.push_back(std::move(record.course));
    }
    reading.data.parameters = reading.measured.parameters = names_;
    for (auto& [name, rows] : judged_) reading.judged.push_back(QuantityOf(name, &rows));
    return reading;
  }

  JudgedQuantity QuantityOf(const std::string& name, std::vector<Judged>* rows) const {
    std::sort(rows->begin(), rows->end(), [](const Judged& one, const Judged& other) {
      return one.record < other.record;
    });
    JudgedQuantity quantity;
    quantity.name = name;
    const Judged& last = rows->back();
    quantity.lower = last.lower, quantity.upper = last.upper, quantity.target = last.target;
    if (const Result<LimitName> parsed = ParseLimitName(name)) {
      quantity.unit = parsed->Unit();
      // "within ± 0.5" is "at most 0.5" of what is never negative.
      if (parsed->IsNeverNegative() && quantity.lower <= 0.0) quantity.lower = -kInfinity;
    }
    quantity.values.resize(std::ssize(*rows));
    quantity.sigma.resize(std::ssize(*rows));
    for (const Judged& row : *rows) {
      const auto at = std::ssize(quantity.units);
      quantity.units.push_back(records_[static_cast<std::size_t>(row.record)].unit_place);
      quantity.values[at] = row.value;
      quantity.sigma[at] = row.sigma;
      if (!row.pass) ++quantity.missed;
      if (row.lower != last.lower || row.upper != last.upper) ++quantity.other_limits;
    }
    return quantity;
  }

  static constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();

  Store& store_;
  std::vector<Record> records_;                          // by time
  std::unordered_map<std::string, std::size_t> places_;  // of the piece's runs, in records_
  std::vector<std::string> names_;
  std::unordered_map<std::string, int> parameters_;
  std::map<std::string, std::vector<Judged>> judged_;
};

/// Of the unit's run that counts, and of a run alone, as if it were a unit: columns of ReadRuns.
std::string OfUnit() {
  return "SELECT run, serial, recorded, verdict, " + std::string(kReason) +
         ", first_verdict, final_verdict, attempts, wall_s, cpu_s, log, recorded_by";
}
constexpr std::string_view kOfRun =
    "SELECT run, serial, recorded, verdict, code, verdict, verdict, 1, wall_s, cpu_s, log, "
    "recorded_by";
/// The first calibration of each unit at each station.
std::string FirstAtStation() {
  return " AND run IN (SELECT run FROM (SELECT run.run, row_number() OVER (PARTITION BY serial, "
         "tag.value ORDER BY " +
         OrderOfTime("run") +
         ") AS nth FROM run LEFT JOIN tag ON tag.run = run.run AND tag.name = 'station' WHERE "
         "EXISTS (SELECT 1 FROM parameter WHERE parameter.run = run.run)) AS placed WHERE nth = 1)";
}

bool IsGoodVerdict(const std::string& name) {
  const std::optional<Verdict> verdict = VerdictFromName(name);
  return verdict && !IsRed(*verdict);
}

}  // namespace

bool UnitCourse::IsGoodAtFirst() const { return IsGoodVerdict(first_verdict); }
bool UnitCourse::IsGood() const { return IsGoodVerdict(final_verdict); }

Result<LineReading> ReadUnits(Store& store, const LineSelection& selection) {
  return LineReader(store).Read(
      OfUnit() + FromWhere("standing", selection),
      std::string(kOfRun) + FromWhere("run", selection) + FirstAtStation());
}

Result<LineReading> ReadRuns(Store& store, const LineSelection& selection) {
  return LineReader(store).Read(std::string(kOfRun) + FromWhere("run", selection), "");
}

}  // namespace truetriad::fleet
