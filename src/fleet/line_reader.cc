// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <string_view>
#include <tuple>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include "fleet/database.h"
#include "fleet/fields.h"
#include "fleet/line_summary.h"
#include "truetriad/model/quality.h"

namespace truetriad::fleet {
Status CheckIsTag(std::string_view flag, const std::string& tag) {
  std::string tags;
  for (const std::string_view key : TagNames()) {
    if (key == tag) return {};
    tags.append(tags.empty() ? "" : ", ").append(key);
  }
  return Error(ErrorCode::kInvalidArgument,
               "--" + std::string(flag) + "=" + tag + ": unknown tag; expected one of " + tags);
}

std::string SqlText(std::string_view text) {
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? "''" : std::string(1, c);
  return quoted + '\'';
}

std::string FromWhere(std::string_view source, const std::string& where) {
  std::string from = " FROM (SELECT source.*";
  for (const std::string_view key : TagNames()) {
    const std::string name(key);
    from += ", (SELECT value FROM tag WHERE tag.run = source.run AND tag.name = '" + name +
            "') AS \"" + name + '"';
  }
  // A run has its own columns and those of its unit's standing.
  const std::string own = ", " + ColumnsOf<UnitRun>() + ",";
  const auto add_of_unit = [&](const std::string& name, const auto&) {
    if (source != kRunTable || own.find(", " + name + ",") != std::string::npos) return;
    from.append(", (SELECT ").append(name);
    from.append(" FROM standing WHERE standing.serial = source.serial) AS ").append(name);
  };
  const Standing none;
  Fields(add_of_unit, none);
  from.append(" FROM ").append(source).append(" AS source) AS tagged WHERE ");
  // The condition has its own line, so that a comment in it ends there.
  return from + (where.empty() ? "TRUE" : "(" + where + "\n)");
}

namespace {

/// Collects runs; Finish puts them in the order of measurement.
class LineReader {
 public:
  explicit LineReader(std::vector<std::string> parameters) {
    for (const std::string& name : parameters) place_of_.try_emplace(name, place_of_.size());
    reading_.data.parameters = std::move(parameters);
  }

  /// `code`: why the run or its unit is not good. `counts`: the run is current.
  void Take(const UnitRun& run,
            const std::string& code,
            UnitCourse course,
            bool counts,
            bool is_measured) {
    Record record{.unit = {.serial = run.serial,
                           .run = run.id,
                           .recorded = run.standing ? run.standing->recorded : run.recorded,
                           .code = code},
                  .course = std::move(course),
                  .number = static_cast<std::uint32_t>(records_.size()),
                  .counts = counts,
                  .is_measured = is_measured};
    TagFields(
        [&record](std::string_view name, const std::string& value) {
          if (!value.empty()) record.unit.tags[std::string(name)] = value;
        },
        run.tags);
    record.unit.values.setConstant(std::ssize(place_of_), line::kNotKnown);
    record.unit.sigma.setConstant(std::ssize(place_of_), line::kNotKnown);
    for (const Parameter& parameter : run.parameters) {
      const auto found = place_of_.find(parameter.name);
      if (found == place_of_.end()) continue;
      record.unit.values[static_cast<Eigen::Index>(found->second)] = parameter.value;
      record.unit.sigma[static_cast<Eigen::Index>(found->second)] = parameter.sigma;
    }
    for (const LimitCheck& check : run.judgements) {
      if (!counts) break;
      reading_.judged[check.FullName()].push_back(
          {record.number,
           2 * PlaceOf(check.limit) + (check.pass ? 0U : 1U),
           check.worst,
           check.sigma});
    }
    records_.push_back(std::move(record));
    counting_ += counts ? 1 : 0;
  }

  LineReading Finish() {
    std::ranges::sort(records_, [](const Record& one, const Record& other) {
      // Units of the same second are ordered by serial number.
      const bool is_same = one.unit.recorded == other.unit.recorded;
      if (is_same && one.unit.recorded.empty()) return one.unit.run < other.unit.run;
      return std::tie(one.unit.recorded, one.unit.serial, one.unit.run) <
             std::tie(other.unit.recorded, other.unit.serial, other.unit.run);
    });
    std::vector<std::uint32_t> unit_of(records_.size());
    for (Record& record : records_) {
      std::vector<line::UnitRecord>& units = record.counts ? reading_.data.units : reading_.others;
      const auto place = static_cast<std::uint32_t>(units.size());
      if (record.is_measured)
        reading_.measured.push_back(record.counts ? place : place + counting_);
      if (record.counts) reading_.courses.push_back(std::move(record.course));
      unit_of[record.number] = place;
      units.push_back(std::move(record.unit));
    }
    for (auto& [name, checks] : reading_.judged) {
      for (LineReading::Judgement& check : checks) check.unit = unit_of[check.unit];
      std::ranges::sort(checks, {}, &LineReading::Judgement::unit);
    }
    return std::move(reading_);
  }

 private:
  struct Record {
    line::UnitRecord unit;
    UnitCourse course;
    std::uint32_t number;  ///< In the order of arrival.
    bool counts, is_measured;
  };

  std::uint32_t PlaceOf(const Limit& limit) {
    const auto [known, is_new] =
        limits_.try_emplace({limit.lower, limit.upper, limit.target},
                            static_cast<std::uint32_t>(reading_.limits.size()));
    if (is_new) {
      reading_.limits.push_back({limit.lower, limit.upper, limit.target.value_or(line::kNotKnown)});
    }
    return known->second;
  }

  LineReading reading_;
  std::vector<Record> records_;
  std::uint32_t counting_ = 0;  ///< The number of current runs.
  std::map<std::tuple<double, double, std::optional<double>>, std::uint32_t> limits_;
  std::unordered_map<std::string, std::size_t> place_of_;  ///< Indices of parameters.
};

/// SQL for the run measured first in each group of runs with the same `partition`. Only runs for
/// which `condition` is true belong to a group. If a later list corrected the time of a log, the
/// run with the corrected time is used.
std::string FirstRuns(const std::string& partition, const std::string& condition) {
  return "SELECT run FROM (SELECT run.run, row_number() OVER (PARTITION BY " + partition +
         " ORDER BY run.recorded, run.run) AS nth FROM run LEFT JOIN tag ON tag.run = run.run AND "
         "tag.name = 'station' WHERE " +
         condition +
         " AND run.run NOT IN (SELECT run FROM given_up) AND NOT EXISTS (SELECT 1 FROM run AS "
         "later WHERE later.log = run.log AND later.serial = "
         "run.serial AND later.log_bytes = run.log_bytes AND later.log_modified_ns = "
         "run.log_modified_ns AND later.run > run.run AND later.recorded_by = 'list' AND "
         "later.recorded <> run.recorded AND later.verdict <> 'NO_RESULT')) AS placed WHERE nth = "
         "1";
}

/// Names of the parameters of the selected runs, in the order of their place in a run.
Result<std::vector<std::string>> ParametersOf(Store& store, const std::string& where) {
  return store.QueryTexts(
      "SELECT name FROM parameter WHERE name NOT LIKE 'reference.%' AND run IN (SELECT run" +
      FromWhere("run", where) + ") GROUP BY name ORDER BY min(place), name");
}

UnitCourse CourseOf(const UnitRun& run) {
  const Standing alone{
      .run = {}, .first_verdict = run.verdict, .final_verdict = run.verdict, .attempts = 1};
  const Standing& unit = run.standing ? *run.standing : alone;
  return {.first_verdict = unit.first_verdict,
          .final_verdict = unit.final_verdict,
          .recorded_by = run.standing ? unit.recorded_by : run.recorded_by,
          .is_conceded = IsRed(run.verdict) && !IsRed(unit.final_verdict),
          .attempts = static_cast<int>(unit.attempts)};
}

}  // namespace

Quantity LineReading::ParameterOf(std::size_t place) const {
  Quantity quantity;
  quantity.name = data.parameters[place];
  const auto at = static_cast<Eigen::Index>(place);
  for (std::size_t i = 0; i < data.units.size(); ++i) {
    if (!std::isnan(data.units[i].values[at])) quantity.units.push_back(static_cast<int>(i));
  }
  quantity.values.resize(std::ssize(quantity.units));
  quantity.sigma.resize(std::ssize(quantity.units));
  for (Eigen::Index i = 0; i < quantity.values.size(); ++i) {
    const line::UnitRecord& unit =
        data.units[static_cast<std::size_t>(quantity.units[static_cast<std::size_t>(i)])];
    quantity.values[i] = unit.values[at];
    quantity.sigma[i] = unit.sigma[at];
  }
  return quantity;
}

Quantity LineReading::JudgedOf(const std::string& name) const {
  const std::vector<Judgement>& checks = judged.at(name);
  const auto limits_of = [this](const Judgement& check) { return limits[check.limits / 2]; };
  const Limits last = limits_of(checks.back());
  Quantity quantity;
  quantity.name = name;
  quantity.has_limits = true;
  quantity.lower = last.lower, quantity.upper = last.upper, quantity.target = last.target;
  if (const Result<LimitName> parsed = ParseLimitName(name)) {
    quantity.unit = parsed->Unit();
    // For a quantity that is never negative "within ± 0.5" means "at most 0.5".
    if (parsed->IsNeverNegative() && quantity.lower <= 0.0) {
      quantity.lower = -std::numeric_limits<double>::infinity();
    }
  }
  quantity.values.resize(std::ssize(checks));
  quantity.sigma.resize(std::ssize(checks));
  for (const Judgement& check : checks) {
    const auto at = std::ssize(quantity.units);
    quantity.units.push_back(static_cast<int>(check.unit));
    quantity.values[at] = check.value;
    quantity.sigma[at] = check.sigma;
    quantity.missed += check.IsMissed() ? 1 : 0;
    const Limits own = limits_of(check);
    if (own.lower != last.lower || own.upper != last.upper) ++quantity.other_limits;
  }
  return quantity;
}

line::LineData LineReading::TakeMeasured() {
  line::LineData taken{std::move(data.parameters), {}};
  taken.units.reserve(measured.size());
  const std::size_t counting = data.units.size();
  for (const std::uint32_t place : measured) {
    taken.units.push_back(
        std::move(place < counting ? data.units[place] : others[place - counting]));
  }
  data.units.clear(), others.clear();
  return taken;
}

Result<LineReading> ReadUnits(Store& store, const std::string& where) {
  std::unordered_map<std::string, std::string> first_stations;
  TRUETRIAD_ASSIGN_OR_RETURN(const Table firsts,
                             store.Query("SELECT serial, station" + FromWhere("run", "") +
                                         " AND run IN (" + FirstRuns("serial", "TRUE") + ")"));
  for (const auto& row : firsts.rows) first_stations[*row[0]] = row[1].value_or("");
  TRUETRIAD_ASSIGN_OR_RETURN(
      const std::vector<std::string> measured,
      store.QueryTexts(FirstRuns(
          "serial, tag.value", "EXISTS (SELECT 1 FROM parameter WHERE parameter.run = run.run)")));
  const std::unordered_set<std::string> at_station(measured.begin(), measured.end());
  TRUETRIAD_ASSIGN_OR_RETURN(std::vector<std::string> parameters, ParametersOf(store, where));
  LineReader reader(std::move(parameters));
  TRUETRIAD_RETURN_IF_ERROR(store.ForEachRun(
      {.where = where, .with_standing = true, .is_whole = false},
      [&](const UnitRun& run) -> Status {
        const bool is_measured = at_station.contains(run.id);
        if (!run.standing && !is_measured) return {};
        UnitCourse course = CourseOf(run);
        course.first_station = first_stations[run.serial];
        const bool is_decided = run.standing && run.standing->final_verdict != run.verdict;
        reader.Take(run,
                    is_decided ? "decided by " + run.standing->disposed_by : run.code,
                    std::move(course),
                    run.standing.has_value(),
                    is_measured);
        return {};
      }));
  LineReading reading = reader.Finish();
  TRUETRIAD_ASSIGN_OR_RETURN(
      const Table recordings,
      store.Query("SELECT station, count(*)" + FromWhere(kRunTable, where) +
                  " AND run IN (SELECT run FROM measured WHERE run = first_run AND run NOT IN "
                  "(SELECT run FROM given_up)) GROUP BY station"));
  for (const auto& row : recordings.rows) {
    reading.recordings_at[row[0].value_or("")] = NumberOf<int>(row[1], 0);
  }
  return reading;
}

Result<LineReading> ReadRuns(Store& store, const std::string& where) {
  TRUETRIAD_ASSIGN_OR_RETURN(std::vector<std::string> parameters, ParametersOf(store, where));
  LineReader reader(std::move(parameters));
  TRUETRIAD_RETURN_IF_ERROR(store.ForEachRun(
      {.where = where, .is_whole = false}, [&reader](const UnitRun& run) -> Status {
        reader.Take(run, run.code, CourseOf(run), true, false);
        return {};
      }));
  return reader.Finish();
}

}  // namespace truetriad::fleet
