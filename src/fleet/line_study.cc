// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <unordered_map>
#include <vector>

#include "fleet/line_summary.h"
#include "line/gauge_study.h"

namespace truetriad::fleet {
namespace {

Json ToJson(const line::AnovaLine& line) {
  return {{"sum_of_squares", line.sum_of_squares},
          {"dof", line.dof},
          {"mean_square", line.mean_square},
          {"f", line.f},
          {"p", line.p}};
}

Json ToJson(const line::VarianceComponent& component) {
  return {{"variance", component.variance},
          {"lower", component.interval.lower},
          {"upper", component.interval.upper},
          {"study_share", component.study_share},
          {"tolerance_share", component.tolerance_share}};
}

Json ToJson(const line::GaugeStudy& study) {
  return {{"design", StudyDesignName(study.design)},
          {"parts", study.parts},
          {"appraisers", study.appraisers},
          {"repeats", study.repeats},
          {"anova",
           {{"part", ToJson(study.part)},
            {"appraiser", ToJson(study.appraiser)},
            {"interaction", ToJson(study.interaction)},
            {"error", ToJson(study.error)}}},
          {"interaction_pooled", study.is_pooled},
          {"components",
           {{"repeatability", ToJson(study.repeatability)},
            {"appraiser", ToJson(study.appraiser_alone)},
            {"interaction", ToJson(study.interaction_alone)},
            {"reproducibility", ToJson(study.reproducibility)},
            {"gauge", ToJson(study.gauge)},
            {"part", ToJson(study.part_to_part)},
            {"total", ToJson(study.total)}}},
          {"distinct_categories", study.distinct_categories}};
}

Json ToJson(const line::Type1Study& study) {
  return {{"runs", study.runs},
          {"mean", study.mean},
          {"sigma", EstimateJson(study.sigma)},
          {"reference", study.reference},
          {"bias", EstimateJson(study.bias)},
          {"bias_t", study.bias_t},
          {"bias_p", study.bias_p},
          {"cg", study.cg},
          {"cgk", study.cgk},
          {"repeatability_share", study.repeatability_share}};
}

/// The reference that is stated for a quantity; NaN: none. If a limit and a parameter share a name,
/// the reference is for the limit, whose values are in true units.
double ReferenceOf(const Quantity& quantity,
                   const LineReading& runs,
                   const SummaryOptions& options) {
  const auto reference = options.references.find(quantity.name);
  const bool is_of_limit = !quantity.has_limits && runs.judged.contains(quantity.name);
  return reference == options.references.end() || is_of_limit ? line::kNotKnown : reference->second;
}

/// The gauge study of one quantity, made from its values in the runs.
Json StudyOf(const Quantity& quantity, const LineReading& runs, const SummaryOptions& options) {
  const std::vector<line::UnitRecord>& all = runs.data.units;
  const bool is_of_one_part = std::ranges::all_of(
      all, [&](const line::UnitRecord& run) { return run.serial == all.front().serial; });
  const double width = quantity.upper - quantity.lower;
  const double tolerance = std::isfinite(width) ? width : line::kNotKnown;
  Json study = {{"name", quantity.name},
                {"unit", quantity.unit},
                {"has_limits", quantity.has_limits},
                {"tolerance", tolerance}};
  if (is_of_one_part && quantity.values.size() < 2) {
    study["refused"] = "the study has only one run of one part; measure the part again";
    return study;
  }
  if (is_of_one_part) {
    study["type1"] = ToJson(line::FindType1Study(
        quantity.values, ReferenceOf(quantity, runs, options), tolerance, options.confidence));
    return study;
  }
  std::vector<line::GaugeReading> readings;
  for (std::size_t i = 0; i < quantity.units.size(); ++i) {
    const line::UnitRecord& run = all[static_cast<std::size_t>(quantity.units[i])];
    readings.push_back({run.serial,
                        line::TagOf(run, options.study_by),
                        quantity.values[static_cast<Eigen::Index>(i)]});
  }
  const Result<line::GaugeStudy> found =
      line::FindGaugeStudy(readings, {.tolerance = tolerance, .confidence = options.confidence});
  if (found) {
    study["gauge"] = ToJson(*found);
  } else {
    study["refused"] = found.error().message;
  }
  return study;
}

/// Studies of the quantities with limits, then of the parameters that vary.
Json StudiesOf(const LineReading& runs, const SummaryOptions& options) {
  Json studies = Json::array();
  for (const auto& [name, checks] : runs.judged) {
    studies.push_back(StudyOf(runs.JudgedOf(name), runs, options));
  }
  for (std::size_t place = 0; place < runs.data.parameters.size(); ++place) {
    const Quantity quantity = runs.ParameterOf(place);
    const bool is_fixed =
        quantity.values.size() == 0 || quantity.values.minCoeff() == quantity.values.maxCoeff();
    if (!is_fixed) studies.push_back(StudyOf(quantity, runs, options));
  }
  return studies;
}

Status CheckReferences(const Json& studies, const std::map<std::string, double>& references) {
  for (const auto& [name, value] : references) {
    if (std::none_of(studies.begin(), studies.end(), [&name = name](const Json& study) {
          return study["name"] == name;
        })) {
      return Error(ErrorCode::kUnknownName,
                   "--reference states a value for `" + name +
                       "`, but the runs of the study have no such quantity");
    }
  }
  return {};
}

Error SameRecording(const std::string& one, const std::string& other, const std::string& of) {
  return Error(ErrorCode::kConflictingArguments,
               "the study has the same recording twice, as runs " + one + " and " + other + " (" +
                   of + "); leave one of these runs out with --study, or measure the unit again");
}

/// Error: two runs are of the same recording, so they do not show repeatability.
Status CheckAreDifferent(Store& store, const std::string& study) {
  std::unordered_map<std::string, std::string> run_of;  // By the digest of a sensor's readings.
  TRUETRIAD_ASSIGN_OR_RETURN(
      const Table table,
      store.Query("SELECT digest, reading.run, serial, log FROM reading JOIN (SELECT run, serial, "
                  "log" +
                  FromWhere("run", study) +
                  ") AS its ON its.run = reading.run ORDER BY reading.run"));
  for (const auto& row : table.rows) {
    const auto [first, is_new] = run_of.try_emplace(*row[0], *row[1]);
    if (is_new || first->second == *row[1]) continue;
    return SameRecording(
        first->second, *row[1], row[3].value_or("") + " of " + row[2].value_or(""));
  }
  return {};
}

}  // namespace

Result<Json> StudyOf(Store& store, const SummaryOptions& options) {
  TRUETRIAD_RETURN_IF_ERROR(CheckIsTag("by", options.study_by));
  TRUETRIAD_ASSIGN_OR_RETURN(const LineReading runs, ReadRuns(store, options.study));
  if (runs.data.units.empty()) {
    return Error(ErrorCode::kNotEnoughData,
                 "the condition of the study selects no run: " + options.study);
  }
  TRUETRIAD_RETURN_IF_ERROR(CheckAreDifferent(store, options.study));
  const Json quantities = StudiesOf(runs, options);
  TRUETRIAD_RETURN_IF_ERROR(CheckReferences(quantities, options.references));
  const bool is_any = std::any_of(quantities.begin(), quantities.end(), [](const Json& study) {
    return !study.contains("refused");
  });
  if (is_any) {
    return Json({{"where", options.study},
                 {"by", options.study_by},
                 {"runs", runs.data.units.size()},
                 {"quantities", quantities}});
  }
  return Error(ErrorCode::kNotEnoughData,
               quantities.empty() ? "the runs of the study have no calibration"
                                  : quantities[0]["refused"].get<std::string>());
}

}  // namespace truetriad::fleet
