// SPDX-License-Identifier: Apache-2.0
#include "fleet/line_reader.h"

#include <algorithm>
#include <charconv>
#include <limits>
#include <map>
#include <optional>
#include <string_view>
#include <tuple>
#include <unordered_map>
#include <utility>

#include "truetriad/model/limits.h"

namespace truetriad::fleet {
namespace {

/// Runs that are asked for at once: their rows are some megabytes.
constexpr std::size_t kRunsAtOnce = 500;
constexpr std::string_view kReference = "reference.";

using Field = std::optional<std::string>;

double NumberOf(const Field& field, double otherwise) {
  double number = otherwise;
  if (field) std::from_chars(field->data(), field->data() + field->size(), number);
  return number;
}

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
    for (std::size_t begin = 0; begin < records_.size(); begin += kRunsAtOnce) {
      const std::size_t end = std::min(begin + kRunsAtOnce, records_.size());
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
    for (const std::vector<Field>& row : table.rows) {
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
                       .attempts = static_cast<int>(NumberOf(row[7], 1.0)),
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
    for (const std::vector<Field>& row : table.rows) stations[*row[0]] = row[1].value_or("");
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
    for (const std::vector<Field>& row : tags.rows) {
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
    for (const std::vector<Field>& row : table.rows) {
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
    for (const std::vector<Field>& row : table.rows) {
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
