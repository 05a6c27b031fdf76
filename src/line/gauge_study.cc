// SPDX-License-Identifier: Apache-2.0
#include "line/gauge_study.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <set>

#include "line/capability.h"
#include "math/distributions.h"

namespace truetriad::line {
namespace {

/// The mean square of an ANOVA line times a positive or negative factor.
struct MeanSquareTerm {
  double factor = 0.0;
  const AnovaLine* line = nullptr;

  double Size() const { return factor * line->mean_square; }
};

constexpr double kManyDof = std::numeric_limits<double>::infinity();

double Squared(double value) { return value * value; }

/// Squared distance of a confidence bound from the sum of the terms. The papers at ComponentOf call
/// it V_L for the lower bound (`probability` = 1 - tail), V_U for the upper (`probability` = tail).
double SquaredDistance(const std::vector<MeanSquareTerm>& terms, double probability) {
  const bool is_lower = probability > 0.5;
  const auto own = [&](const MeanSquareTerm& term) {
    const bool is_over = (term.factor > 0.0) == is_lower;
    const double p = is_lower ? probability : 1.0 - probability;
    return is_over ? 1.0 - 1.0 / FisherQuantile(p, term.line->dof, kManyDof)
                   : 1.0 / FisherQuantile(1.0 - p, term.line->dof, kManyDof) - 1.0;
  };
  double sum = 0.0;
  int positive = 0;
  for (const MeanSquareTerm& term : terms) {
    sum += Squared(own(term) * term.Size());
    if (term.factor > 0.0) ++positive;
  }
  const bool is_difference = positive < static_cast<int>(terms.size());
  for (std::size_t i = 0; i < terms.size(); ++i) {
    for (std::size_t j = 0; j < terms.size(); ++j) {
      const MeanSquareTerm &one = terms[i], &other = terms[j];
      const double dof = one.line->dof, other_dof = other.line->dof;
      const double product = one.Size() * std::abs(other.Size());
      if (one.factor > 0.0 && other.factor < 0.0) {
        const double f = FisherQuantile(probability, dof, other_dof);
        sum += product / f * (Squared(f - 1.0) - Squared(own(one) * f) - Squared(own(other)));
      } else if (is_difference && is_lower && i < j && one.factor > 0.0 && other.factor > 0.0) {
        const double both = dof + other_dof;
        const double together = 1.0 - 1.0 / FisherQuantile(probability, both, kManyDof);
        sum += product / (positive - 1) *
               (Squared(together * both) / (dof * other_dof) - Squared(own(one)) * dof / other_dof -
                Squared(own(other)) * other_dof / dof);
      }
    }
  }
  return std::max(0.0, sum);
}

/// A variance component sum(factor * expected mean square), at least zero, with at most one
/// negative factor. Its interval is that of the modified large-sample method: Graybill & Wang
/// (1980) for sums, Ting, Burdick, Graybill, Jeyaratnam & Lu (1990), eq. 2 to 5, for differences.
VarianceComponent ComponentOf(const std::vector<MeanSquareTerm>& terms, double confidence) {
  const double tail = 0.5 * (1.0 - confidence);
  double value = 0.0;
  for (const MeanSquareTerm& term : terms) value += term.Size();
  VarianceComponent component;
  component.variance = std::max(0.0, value);
  component.interval = {std::max(0.0, value - std::sqrt(SquaredDistance(terms, 1.0 - tail))),
                        std::max(0.0, value + std::sqrt(SquaredDistance(terms, tail)))};
  return component;
}

/// Readings by appraiser, then by part.
using Cells = std::map<std::string, std::map<std::string, std::vector<double>>>;

double MeanOf(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

/// Sum of the squared distances of `values` from `center`, each times `weight`.
double SquaresAbout(const std::vector<double>& values, double center, double weight) {
  double sum = 0.0;
  for (const double value : values) sum += (value - center) * (value - center);
  return weight * sum;
}

Error Incomplete(const std::string& what) {
  return Error(ErrorCode::kNotEnoughData, "the study is not balanced: " + what);
}

std::string Runs(std::size_t count) {
  return std::to_string(count) + (count == 1 ? " run" : " runs");
}

/// Whether each part has exactly one appraiser.
bool IsNested(const std::vector<GaugeReading>& readings) {
  std::map<std::string, std::string> appraisers;
  return std::all_of(readings.begin(), readings.end(), [&](const GaugeReading& reading) {
    return appraisers.try_emplace(reading.part, reading.appraiser).first->second ==
           reading.appraiser;
  });
}

/// Error: cells or parts are missing, cells differ in their number of readings or have only one
/// reading, or there is only one part.
Status CheckBalance(const Cells& cells, const std::set<std::string>& parts, bool is_nested) {
  std::size_t most = 0, most_parts = 0;
  for (const auto& [appraiser, by_part] : cells) {
    most_parts = std::max(most_parts, by_part.size());
    for (const auto& [part, values] : by_part) most = std::max(most, values.size());
  }
  for (const auto& [appraiser, by_part] : cells) {
    const std::string by = appraiser.empty() ? "" : " by " + appraiser;
    if (is_nested && by_part.size() < most_parts) {
      return Incomplete("only " + std::to_string(by_part.size()) + " parts were measured" + by +
                        ", but up to " + std::to_string(most_parts) + " by others");
    }
    if (is_nested) continue;
    for (const std::string& part : parts) {
      if (by_part.count(part) == 0) return Incomplete("no run of part " + part + by);
    }
  }
  for (const auto& [appraiser, by_part] : cells) {
    for (const auto& [part, values] : by_part) {
      if (values.size() == most) continue;
      return Incomplete(Runs(values.size()) + " of part " + part +
                        (appraiser.empty() ? "" : " by " + appraiser) + ", but up to " +
                        std::to_string(most) + " in other cells");
    }
  }
  if (most < 2) {
    return Error(
        ErrorCode::kNotEnoughData,
        "the study has only one run per part and appraiser; measure each part at least twice");
  }
  if (most_parts < 2) {
    return Error(ErrorCode::kNotEnoughData, "the study has one part only");
  }
  return {};
}

AnovaLine LineOf(double sum_of_squares, double dof) {
  return {sum_of_squares, dof, sum_of_squares / dof};
}

void Test(AnovaLine* line, const AnovaLine& against) {
  line->f = line->mean_square / against.mean_square;
  // 0 / 0 means that nothing varies.
  if (!std::isnan(line->f)) line->p = FisherUpper(line->f, line->dof, against.dof);
}

void FillAnova(const Cells& cells, GaugeStudy* study) {
  const double p = study->parts, o = study->appraisers, r = study->repeats;
  std::vector<double> of_appraisers, of_parts;
  std::map<std::string, std::vector<double>> by_part;
  double error = 0.0, parts_in_appraisers = 0.0;
  for (const auto& [appraiser, of_appraiser] : cells) {
    std::vector<double> means;
    for (const auto& [part, values] : of_appraiser) {
      means.push_back(MeanOf(values));
      by_part[part].push_back(means.back());
      error += SquaresAbout(values, means.back(), 1.0);
    }
    of_appraisers.push_back(MeanOf(means));
    parts_in_appraisers += SquaresAbout(means, of_appraisers.back(), r);
  }
  const double center = MeanOf(of_appraisers);  // All appraisers have equally many readings.
  study->error = LineOf(error, o * p * (r - 1.0));
  if (o > 1.0) study->appraiser = LineOf(SquaresAbout(of_appraisers, center, p * r), o - 1.0);
  if (study->design != StudyDesign::kCrossed) {
    study->part = LineOf(parts_in_appraisers, o * (p - 1.0));
    Test(&study->part, study->error);
    if (o > 1.0) Test(&study->appraiser, study->part);
    return;
  }
  for (const auto& [part, means] : by_part) of_parts.push_back(MeanOf(means));
  study->part = LineOf(SquaresAbout(of_parts, center, o * r), p - 1.0);
  study->interaction = LineOf(std::max(0.0, parts_in_appraisers - study->part.sum_of_squares),
                              (p - 1.0) * (o - 1.0));
  Test(&study->interaction, study->error);
}

/// If the interaction is insignificant, pools it with the error and tests parts and appraisers
/// against that error. Otherwise tests them against the interaction.
void Pool(double above_p, GaugeStudy* study) {
  if (study->design != StudyDesign::kCrossed) return;
  study->is_pooled = !(study->interaction.p <= above_p);
  if (study->is_pooled) {
    study->error = LineOf(study->error.sum_of_squares + study->interaction.sum_of_squares,
                          study->error.dof + study->interaction.dof);
  }
  const AnovaLine& against = study->is_pooled ? study->error : study->interaction;
  Test(&study->part, against);
  Test(&study->appraiser, against);
}

void FillComponents(double confidence, GaugeStudy* study) {
  const double p = study->parts, o = study->appraisers, r = study->repeats;
  const bool is_nested = study->design == StudyDesign::kNested;
  const bool has_interaction = study->design == StudyDesign::kCrossed && !study->is_pooled;
  const AnovaLine *const error = &study->error, *const against =
                                                    has_interaction ? &study->interaction : error;
  // The gauge is the sum of its components; the mean squares of all of them are collected here.
  std::vector<MeanSquareTerm> gauge = {{1.0, error}};
  double reproducibility = 0.0;
  // Terms of the variance component (line - other) / runs. `line` is about means of `runs` readings
  // each.
  const auto between = [&](double runs, const AnovaLine& line, const AnovaLine* other) {
    return std::vector<MeanSquareTerm>{{1.0 / runs, &line}, {-1.0 / runs, other}};
  };
  const auto part_of_gauge = [&](const std::vector<MeanSquareTerm>& terms) {
    for (const MeanSquareTerm& term : terms) {
      const auto same = std::ranges::find(gauge, term.line, &MeanSquareTerm::line);
      if (same != gauge.end()) same->factor += term.factor;
      if (same == gauge.end()) gauge.push_back(term);
    }
    const VarianceComponent component = ComponentOf(terms, confidence);
    reproducibility += component.variance;
    return component;
  };
  study->repeatability = ComponentOf(gauge, confidence);
  study->part_to_part =
      ComponentOf(between(is_nested ? r : o * r, study->part, against), confidence);
  if (o > 1.0) {
    study->appraiser_alone =
        part_of_gauge(between(p * r, study->appraiser, is_nested ? &study->part : against));
  }
  if (has_interaction) {
    study->interaction_alone = part_of_gauge(between(r, study->interaction, error));
  }
  study->gauge = ComponentOf(gauge, confidence);
  if (o > 1.0) study->reproducibility.variance = reproducibility;
  // Negative components became zero, so these sums may exceed those of the mean squares.
  study->gauge.variance = study->repeatability.variance + reproducibility;
  study->total.variance = study->gauge.variance + study->part_to_part.variance;
}

void FillShares(double tolerance, GaugeStudy* study) {
  const double total = std::sqrt(study->total.variance);
  for (VarianceComponent* component : {&study->repeatability,
                                       &study->appraiser_alone,
                                       &study->interaction_alone,
                                       &study->reproducibility,
                                       &study->gauge,
                                       &study->part_to_part,
                                       &study->total}) {
    const double sigma = std::sqrt(component->variance);
    component->study_share = sigma / total;
    component->tolerance_share = 6.0 * sigma / tolerance;
  }
  if (!(study->part_to_part.variance > 0.0)) return;
  constexpr double kMany = 1e6;  // Replaces infinity if the gauge has no variance.
  const double categories = 1.41 * std::sqrt(study->part_to_part.variance / study->gauge.variance);
  study->distinct_categories = static_cast<int>(std::min(kMany, std::floor(categories)));
}

}  // namespace

std::string_view StudyDesignName(StudyDesign design) {
  constexpr std::array<std::string_view, 3> kNames = {"crossed", "nested", "one appraiser"};
  return kNames[static_cast<std::size_t>(design)];
}

Result<GaugeStudy> FindGaugeStudy(const std::vector<GaugeReading>& readings,
                                  const GaugeStudyOptions& options) {
  Cells cells;
  std::set<std::string> parts;
  for (const GaugeReading& reading : readings) {
    cells[reading.appraiser][reading.part].push_back(reading.value);
    parts.insert(reading.part);
  }
  if (cells.empty()) return Error(ErrorCode::kNotEnoughData, "the study has no runs");
  GaugeStudy study;
  if (cells.size() == 1) {
    study.design = StudyDesign::kOneAppraiser;
  } else if (parts.size() > 1 && IsNested(readings)) {
    study.design = StudyDesign::kNested;
  }
  TRUETRIAD_RETURN_IF_ERROR(CheckBalance(cells, parts, study.design == StudyDesign::kNested));
  study.parts = static_cast<int>(cells.begin()->second.size());
  study.appraisers = static_cast<int>(cells.size());
  study.repeats = static_cast<int>(cells.begin()->second.begin()->second.size());
  FillAnova(cells, &study);
  Pool(options.pool_above_p, &study);
  FillComponents(options.confidence, &study);
  FillShares(options.tolerance, &study);
  return study;
}

Type1Study FindType1Study(const Eigen::VectorXd& values,
                          double reference,
                          double tolerance,
                          double confidence) {
  Type1Study study;
  study.runs = values.size();
  study.reference = reference;
  if (study.runs == 0) return study;
  study.mean = values.mean();
  if (study.runs < 2) return study;
  const Spread spread = OverallSpread(values);
  const double sigma = spread.ProcessSigma();
  study.sigma = {sigma, spread.ProcessSigmaInterval(confidence)};
  study.cg = 0.2 * tolerance / (6.0 * sigma);
  study.repeatability_share = 6.0 * sigma / tolerance;
  const double bias = study.mean - reference;
  if (std::isnan(bias)) return study;
  const double bias_sigma = sigma / std::sqrt(static_cast<double>(study.runs));
  const double doubt = StudentQuantile(0.5 * (1.0 + confidence), spread.dof) * bias_sigma;
  study.bias = {bias, {bias - doubt, bias + doubt}};
  study.bias_t = bias / bias_sigma;
  if (!std::isnan(study.bias_t)) {
    study.bias_p = FisherUpper(study.bias_t * study.bias_t, 1.0, spread.dof);
  }
  study.cgk = (0.1 * tolerance - std::abs(bias)) / (3.0 * sigma);
  return study;
}

}  // namespace truetriad::line
