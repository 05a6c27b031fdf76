// SPDX-License-Identifier: Apache-2.0
#include "fleet/line_study.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

namespace truetriad::fleet {
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

  /// `places`: of the runs that have the values.
  QuantityStudy Of(QuantityStudy study,
                   const std::vector<int>& places,
                   const Eigen::VectorXd& values) const {
    if (is_of_one_part_ && values.size() < 2) {
      study.refused = "the study has one run of one part; repeat it";
      return study;
    }
    if (is_of_one_part_) {
      study.type1 =
          line::FindType1Study(values, ReferenceOf(study), study.tolerance, options_.confidence);
      return study;
    }
    std::vector<line::GaugeReading> readings;
    for (std::size_t i = 0; i < places.size(); ++i) {
      const line::UnitRecord& run = runs_.data.units[static_cast<std::size_t>(places[i])];
      readings.push_back(
          {run.serial, line::TagOf(run, options_.study_by), values[static_cast<Eigen::Index>(i)]});
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

  std::vector<QuantityStudy> All() const {
    std::vector<QuantityStudy> studies;
    for (const JudgedQuantity& judged : runs_.judged) {
      const double width = judged.upper - judged.lower;
      studies.push_back(Of({.name = judged.name,
                            .unit = judged.unit,
                            .has_limits = true,
                            .tolerance = std::isfinite(width) ? width : line::kNotKnown},
                           judged.units,
                           judged.values));
    }
    for (std::size_t j = 0; j < runs_.data.parameters.size(); ++j) {
      std::vector<int> places;
      std::vector<double> values;
      for (std::size_t i = 0; i < runs_.data.units.size(); ++i) {
        const double value = runs_.data.units[i].values[static_cast<Eigen::Index>(j)];
        if (std::isnan(value)) continue;
        places.push_back(static_cast<int>(i));
        values.push_back(value);
      }
      const auto [least, most] = std::minmax_element(values.begin(), values.end());
      if (values.empty() || *least == *most) continue;  // Held fixed.
      studies.push_back(Of({.name = runs_.data.parameters[j]},
                           places,
                           Eigen::Map<Eigen::VectorXd>(values.data(), std::ssize(values))));
    }
    return studies;
  }

 private:
  /// In the unit of the study's values. Of a name that a limit and a parameter have it is the
  /// limit's, which is in true units.
  double ReferenceOf(const QuantityStudy& study) const {
    const auto reference = options_.references.find(study.name);
    const bool is_of_limit =
        !study.has_limits &&
        std::any_of(runs_.judged.begin(),
                    runs_.judged.end(),
                    [&study](const JudgedQuantity& judged) { return judged.name == study.name; });
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
Status CheckAreDifferent(Store& store, const LineReading& runs) {
  constexpr std::size_t kRunsAtOnce = 500;
  std::unordered_map<std::string, std::string> run_of;  // by what was read
  const std::vector<line::UnitRecord>& units = runs.data.units;
  for (std::size_t begin = 0; begin < units.size(); begin += kRunsAtOnce) {
    std::string list;
    for (std::size_t i = begin; i < std::min(begin + kRunsAtOnce, units.size()); ++i) {
      list += (i > begin ? "," : "") + SqlText(units[i].run);
    }
    TRUETRIAD_ASSIGN_OR_RETURN(
        const Table table,
        store.Query("SELECT sha256, run, serial, log FROM input JOIN run USING (run) "
                    "WHERE samples > 0 AND run IN (" +
                    list + ") ORDER BY run"));
    for (const auto& row : table.rows) {
      const auto [first, is_new] = run_of.try_emplace(*row[0], *row[1]);
      if (is_new || first->second == *row[1]) continue;
      return SameRecording(
          first->second, *row[1], row[3].value_or("") + " of " + row[2].value_or(""));
    }
  }
  return CheckValuesAreDifferent(runs);
}

}  // namespace

Result<StudySummary> SummariseStudy(Store& store, const SummaryOptions& options) {
  TRUETRIAD_RETURN_IF_ERROR(CheckIsTag("by", options.study_by));
  TRUETRIAD_ASSIGN_OR_RETURN(LineSelection selection, CheckedSelection(store, options.selection));
  selection.where = options.study;
  TRUETRIAD_ASSIGN_OR_RETURN(const LineReading runs, ReadRuns(store, selection));
  if (runs.data.units.empty()) {
    return Error(ErrorCode::kNotEnoughData, "no run is one of the study: " + options.study);
  }
  TRUETRIAD_RETURN_IF_ERROR(CheckAreDifferent(store, runs));
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
