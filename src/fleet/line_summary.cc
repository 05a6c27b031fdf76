// SPDX-License-Identifier: Apache-2.0
#include "fleet/line_summary.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "fleet/database.h"
#include "fleet/line_reader.h"

namespace truetriad::fleet {
namespace {

void Count(const UnitCourse& course, YieldCount* count) {
  ++count->units;
  count->good_at_first += course.IsGoodAtFirst() ? 1 : 0;
  count->good += course.IsGood() ? 1 : 0;
  count->runs += course.attempts;
}

std::vector<YieldCount> CountByTag(const LineReading& line, const std::string& tag) {
  std::map<std::string, YieldCount> counts;
  for (std::size_t i = 0; i < line.courses.size(); ++i) {
    const UnitCourse& course = line.courses[i];
    Count(course,
          &counts[tag == "station" ? course.first_station : line::TagOf(line.data.units[i], tag)]);
  }
  std::vector<YieldCount> list;
  for (auto& [value, count] : counts) {
    count.value = value;
    list.push_back(count);
  }
  // No unit says it.
  if (list.size() == 1 && list.front().value.empty()) list.clear();
  return list;
}

LineYield YieldOf(const LineReading& line, double confidence) {
  LineYield yield;
  const YieldCount& all = yield.all;
  for (const UnitCourse& course : line.courses) {
    Count(course, &yield.all);
    yield.retested += course.attempts > 1 ? 1 : 0;
    ++yield.recorded_by[course.recorded_by];
  }
  yield.good_share = line::ShareOf(all.good, all.units, confidence);
  yield.good_at_first_share = line::ShareOf(all.good_at_first, all.units, confidence);
  for (const char* tag : {"station", "lot"}) {
    std::vector<YieldCount> counts = CountByTag(line, tag);
    if (!counts.empty()) yield.by_tag[tag] = std::move(counts);
  }
  if (all.units == 0) return yield;
  // Units without a time come first.
  const int unknown = yield.recorded_by.contains("") ? yield.recorded_by.at("") : 0;
  if (unknown == all.units) return yield;
  yield.first = line.data.units[static_cast<std::size_t>(unknown)].recorded;
  yield.last = line.data.units.back().recorded;
  const double hours = (line::SecondsOf(yield.last) - line::SecondsOf(yield.first)) / 3600.0;
  // A line that was seen for less than an hour shows no units an hour.
  if (hours >= 1.0) yield.units_per_hour = (all.units - unknown - 1) / hours;
  return yield;
}

std::vector<Reason> ReasonsOf(const LineReading& line) {
  std::map<std::string, int> counts;
  int all = 0;
  for (std::size_t i = 0; i < line.courses.size(); ++i) {
    if (line.courses[i].IsGood()) continue;
    const line::UnitRecord& unit = line.data.units[i];
    ++counts[unit.code.empty() ? std::string(VerdictName(line.courses[i].final_verdict))
                               : unit.code];
    ++all;
  }
  std::vector<Reason> reasons;
  for (const auto& [code, units] : counts) {
    reasons.push_back({.code = code, .units = units, .share = units / static_cast<double>(all)});
  }
  std::stable_sort(reasons.begin(), reasons.end(), [](const Reason& one, const Reason& other) {
    return one.units > other.units;
  });
  int so_far = 0;
  for (Reason& reason : reasons) {
    so_far += reason.units;
    reason.cumulative = so_far / static_cast<double>(all);
  }
  return reasons;
}

QuantitySummary SummaryOf(Quantity quantity, const SummaryOptions& options) {
  line::Capability capability = line::FindCapability({.values = quantity.values,
                                                      .sigma = quantity.sigma,
                                                      .lower = quantity.lower,
                                                      .upper = quantity.upper},
                                                     options.confidence);
  quantity.units = {}, quantity.values = {}, quantity.sigma = {};
  return {std::move(quantity), std::move(capability)};
}

Result<std::vector<line::StationCheck>> ReadChecks(Store& store) {
  TRUETRIAD_ASSIGN_OR_RETURN(
      const Table table,
      store.Query("SELECT station, serial, created, agrees, p, largest, parameter FROM " +
                  kChecksThatCount + " ORDER BY station_check"));
  std::vector<line::StationCheck> checks;
  for (const auto& row : table.rows) {
    const auto number = [&row](std::size_t column) {
      return NumberOf(row[column], line::kNotKnown);
    };
    checks.push_back({.station = row[0].value_or(""),
                      .serial = row[1].value_or(""),
                      .created = row[2].value_or(""),
                      .agrees = number(3) != 0.0,
                      .p = number(4),
                      .largest = number(5),
                      .parameter = row[6].value_or("")});
  }
  return checks;
}

}  // namespace

Result<LineSummary> Summarise(Store& store, const SummaryOptions& options) {
  TRUETRIAD_ASSIGN_OR_RETURN(LineReading line, ReadUnits(store, options.where));
  LineSummary summary;
  summary.yield = YieldOf(line, options.confidence);
  summary.reasons = ReasonsOf(line);
  for (const auto& [name, checks] : line.judged) {
    summary.limits.push_back(SummaryOf(line.JudgedOf(name), options));
  }
  for (std::size_t place = 0; place < line.data.parameters.size(); ++place) {
    summary.parameters.push_back(SummaryOf(line.ParameterOf(place), options));
  }
  line.judged.clear();
  summary.measured = line.TakeMeasured();
  TRUETRIAD_ASSIGN_OR_RETURN(const std::vector<line::StationCheck> checks, ReadChecks(store));
  summary.golden = line::FindGoldenHistories(checks, options.now, options.golden_due_h);
  if (!options.study.empty()) {
    TRUETRIAD_ASSIGN_OR_RETURN(summary.study, SummariseStudy(store, options));
  }
  line::ChartOptions chart_options;
  chart_options.most_points = options.chart_points;
  chart_options.baseline_units = options.baseline_units;
  summary.charts = line::ControlCharts(summary.measured, chart_options);
  return summary;
}

namespace {

/// The runs of a study, and what one quantity of them says.
class StudyOfRuns {
 public:
  StudyOfRuns(const LineReading& runs, const SummaryOptions& options)
      : runs_(runs), options_(options) {
    std::set<std::string> parts;
    for (const line::UnitRecord& run : runs.data.units) parts.insert(run.serial);
    is_of_one_part_ = parts.size() == 1;
  }

  std::vector<QuantityStudy> All() const {
    std::vector<QuantityStudy> studies;
    for (const auto& [name, checks] : runs_.judged) studies.push_back(Of(runs_.JudgedOf(name)));
    for (std::size_t place = 0; place < runs_.data.parameters.size(); ++place) {
      const Quantity quantity = runs_.ParameterOf(place);
      const bool is_fixed =
          quantity.values.size() == 0 || quantity.values.minCoeff() == quantity.values.maxCoeff();
      if (!is_fixed) studies.push_back(Of(quantity));
    }
    return studies;
  }

 private:
  QuantityStudy Of(const Quantity& quantity) const {
    const double width = quantity.upper - quantity.lower;
    QuantityStudy study{.name = quantity.name,
                        .unit = quantity.unit,
                        .has_limits = quantity.has_limits,
                        .tolerance = std::isfinite(width) ? width : line::kNotKnown};
    if (is_of_one_part_ && quantity.values.size() < 2) {
      study.refused = "the study has one run of one part; repeat it";
      return study;
    }
    if (is_of_one_part_) {
      study.type1 = line::FindType1Study(
          quantity.values, ReferenceOf(study), study.tolerance, options_.confidence);
      return study;
    }
    std::vector<line::GaugeReading> readings;
    for (std::size_t i = 0; i < quantity.units.size(); ++i) {
      const line::UnitRecord& run = runs_.data.units[static_cast<std::size_t>(quantity.units[i])];
      readings.push_back({run.serial,
                          line::TagOf(run, options_.study_by),
                          quantity.values[static_cast<Eigen::Index>(i)]});
    }
    Result<line::GaugeStudy> found = line::FindGaugeStudy(
        readings, {.tolerance = study.tolerance, .confidence = options_.confidence});
    if (found) {
      study.gauge = *std::move(found);
    } else {
      study.refused = found.error().message;
    }
    return study;
  }

  /// In the unit of the study's values. Of a name that a limit and a parameter have it is the
  /// limit's, which is in true units.
  double ReferenceOf(const QuantityStudy& study) const {
    const auto reference = options_.references.find(study.name);
    const bool is_of_limit = !study.has_limits && runs_.judged.contains(study.name);
    return reference == options_.references.end() || is_of_limit ? line::kNotKnown
                                                                 : reference->second;
  }

  const LineReading& runs_;
  const SummaryOptions& options_;
  bool is_of_one_part_ = false;
};

Status CheckReferences(const std::vector<QuantityStudy>& studies,
                       const std::map<std::string, double>& references) {
  for (const auto& [name, value] : references) {
    if (std::none_of(studies.begin(), studies.end(), [&name = name](const QuantityStudy& study) {
          return study.name == name;
        })) {
      return Error(ErrorCode::kUnknownName,
                   "the study's runs have no quantity `" + name + "` for a reference");
    }
  }
  return {};
}

Error SameRecording(const std::string& one, const std::string& other, const std::string& of) {
  return Error(ErrorCode::kConflictingArguments,
               "the study has the same recording twice, as runs " + one + " and " + other + " (" +
                   of + "); measure each unit anew, or leave one out with --study");
}

/// What was measured again differs somewhere, if only in the last bit: runs that do not are of the
/// same samples, whatever their files are (compressed, in parts).
Status CheckValuesAreDifferent(const LineReading& runs) {
  std::map<std::vector<std::pair<Eigen::Index, double>>, const line::UnitRecord*> known;
  for (const line::UnitRecord& run : runs.data.units) {
    std::vector<std::pair<Eigen::Index, double>> estimated;
    for (Eigen::Index i = 0; i < run.values.size(); ++i) {
      if (run.sigma[i] > 0.0) estimated.emplace_back(i, run.values[i]);
    }
    if (estimated.empty()) continue;
    const auto [first, is_new] = known.try_emplace(std::move(estimated), &run);
    if (!is_new) return SameRecording(first->second->run, run.run, "of " + run.serial);
  }
  return {};
}

/// A recording that is calibrated twice has no repeatability to show.
Status CheckAreDifferent(Store& store, const std::string& study, const LineReading& runs) {
  std::unordered_map<std::string, std::string> run_of;  // by what was read
  TRUETRIAD_ASSIGN_OR_RETURN(
      const Table table,
      store.Query("SELECT sha256, input.run, serial, log FROM input JOIN (SELECT run, serial, log" +
                  FromWhere("run", study) +
                  ") AS its ON its.run = input.run WHERE samples > 0 ORDER BY input.run"));
  for (const auto& row : table.rows) {
    const auto [first, is_new] = run_of.try_emplace(*row[0], *row[1]);
    if (is_new || first->second == *row[1]) continue;
    return SameRecording(
        first->second, *row[1], row[3].value_or("") + " of " + row[2].value_or(""));
  }
  return CheckValuesAreDifferent(runs);
}

}  // namespace

Result<StudySummary> SummariseStudy(Store& store, const SummaryOptions& options) {
  TRUETRIAD_RETURN_IF_ERROR(CheckIsTag("by", options.study_by));
  TRUETRIAD_ASSIGN_OR_RETURN(const LineReading runs, ReadRuns(store, options.study));
  if (runs.data.units.empty()) {
    return Error(ErrorCode::kNotEnoughData, "no run is one of the study: " + options.study);
  }
  TRUETRIAD_RETURN_IF_ERROR(CheckAreDifferent(store, options.study, runs));
  StudySummary summary{.where = options.study,
                       .by = options.study_by,
                       .runs = static_cast<int>(runs.data.units.size()),
                       .quantities = StudyOfRuns(runs, options).All()};
  TRUETRIAD_RETURN_IF_ERROR(CheckReferences(summary.quantities, options.references));
  const bool is_any = std::any_of(summary.quantities.begin(),
                                  summary.quantities.end(),
                                  [](const QuantityStudy& study) { return study.refused.empty(); });
  if (is_any) return summary;
  return Error(ErrorCode::kNotEnoughData,
               summary.quantities.empty() ? "the runs of the study have no calibration"
                                          : summary.quantities.front().refused);
}

}  // namespace truetriad::fleet
