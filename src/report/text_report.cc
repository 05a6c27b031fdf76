// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <variant>
#include <vector>

#include "report/content.h"
#include "report/format.h"
#include "report/page.h"
#include "report/table.h"
#include "truetriad/calibrate/compare.h"
#include "truetriad/calibrate/evaluate.h"
#include "truetriad/report/report.h"

namespace truetriad {
namespace {

constexpr std::size_t kWorstPoses = 5;

/// The poses that the calibration predicts worst, by normalised residual.
Table WorstPosesTable(std::vector<PoseResidual> residuals) {
  std::stable_sort(residuals.begin(), residuals.end(), [](const auto& a, const auto& b) {
    return std::abs(a.normalized) > std::abs(b.normalized);
  });
  residuals.resize(std::min(residuals.size(), kWorstPoses));
  Table table{{"worst poses", "sensor", "norm error", "unit", "normalised"}, "rlrlr", {}};
  for (const PoseResidual& pose : residuals) {
    table.rows.push_back({std::to_string(pose.pose),
                          std::string(TriadName(pose.triad)),
                          Significant(pose.norm_error, 3),
                          TruthUnit(pose.triad),
                          Fixed(pose.normalized, 2)});
  }
  return table;
}

// RMS errors and their ratios to what was predicted.
Table TableOf(const EvaluationSummary& evaluation) {
  Table table{{"RMS of |C(y - b)| - reference",
               "uncalibrated",
               "calibrated",
               "predicted",
               "misfit",
               "unit"},
              "lrrrrl",
              {}};
  const auto number = [](const std::optional<double>& value) {
    return value ? Significant(*value, 3) : std::string("–");
  };
  for (const Triad triad : kTriads) {
    const std::optional<double>& rms = evaluation.norm_rms[triad];
    if (!rms) continue;
    table.rows.push_back({TriadTitle(triad),
                          number(evaluation.norm_rms_before[triad]),
                          number(rms),
                          number(evaluation.predicted_rms[triad]),
                          number(evaluation.error_ratio[triad]),
                          TruthUnit(triad)});
  }
  if (evaluation.turns) {
    const EvaluatedTurns& turns = *evaluation.turns;
    const double ratio =
        turns.predicted_rms_rad > 0.0 ? turns.rms_rad / turns.predicted_rms_rad : 0.0;
    table.rows.push_back(
        {turns.against == Triad::kMagnetometer ? "Field after a turn" : "Gravity after a turn",
         number(turns.nominal_rms_rad),
         number(turns.rms_rad),
         number(turns.predicted_rms_rad),
         ratio > 0.0 ? Significant(ratio, 3) : "–",
         "rad"});
  }
  return table;
}

std::string Headline(const EvaluationSummary& evaluation) {
  switch (VerdictOf(evaluation)) {
    case PredictionVerdict::kNotEvaluated:
      return "NOT EVALUATED: the recording has no poses of the calibrated sensors\n";
    case PredictionVerdict::kNoTest:
      return "NOT A TEST: the calibration was made from this recording, so that small errors prove "
             "nothing; evaluate another one\n";
    case PredictionVerdict::kNoPrediction:
      return "EVALUATED, but no prediction to compare with\n";
    case PredictionVerdict::kAsPredicted:
      return "AS PREDICTED: the errors on these poses are consistent with noise and parameter "
             "uncertainty\n";
    case PredictionVerdict::kWorse:
      return "WORSE THAN PREDICTED: up to " + Significant(*WorstErrorRatio(evaluation), 3) +
             " times the error expected from noise and parameter uncertainty\n";
  }
  return "";
}

}  // namespace

std::string CalibrationText(const Calibration& calibration) {
  const Verdict verdict = VerdictOf(calibration);
  std::string text = verdict.headline + '\n' + Wrapped(verdict.explanation, 0) + '\n' +
                     TextOf(IdentityTable(calibration));
  for (const Section& section : SectionsOf(calibration)) {
    text += SectionText(section.title, section.blocks);
  }
  return text;
}

std::string EvaluationText(const EvaluationSummary& evaluation, const Calibration& calibration) {
  std::string text = Headline(evaluation);
  text += Wrapped("Calibration of " +
                      (calibration.serial.empty() ? "a unit without serial number"
                                                  : calibration.serial) +
                      " tested on " + std::to_string(evaluation.poses) + " poses.",
                  0) +
          '\n' + TextOf(TableOf(evaluation)) +
          Wrapped(
              "Misfit is 1 where the errors are as predicted. It counts once what all poses "
              "share, such as the local gravity, which the RMS count at every pose.");
  const auto& accelerometer = calibration.sensors[Triad::kAccelerometer];
  if (calibration.mode == Mode::kSweep && accelerometer && accelerometer->bias_sigma.isZero(0.0)) {
    text += '\n' + Wrapped(
                       "The accelerometer's bias and gain at the reference temperature are not "
                       "calibrated, so its error is stated about the mean.");
  }
  if (evaluation.clamped_poses > 0) {
    text += '\n' + Wrapped(std::to_string(evaluation.clamped_poses) +
                           " poses lie outside the calibrated temperature range; they were "
                           "evaluated with the terms at its nearest end.");
  }
  if (evaluation.angle_std_deg) {
    text += '\n' + Wrapped("Angle between field and gravity: spread " +
                           Significant(*evaluation.angle_std_deg, 3) +
                           " deg (std over the poses; constant in a uniform field).");
  }
  if (evaluation.turns) {
    const EvaluatedTurns& turns = *evaluation.turns;
    text += '\n' + Wrapped(std::string("Direction of ") +
                           (turns.against == Triad::kMagnetometer ? "the field" : "gravity") +
                           " at the next rest, predicted by each of " +
                           std::to_string(turns.count) + " turns: median error " +
                           MedianAngles(turns.median_rad, turns.nominal_median_rad) + ".");
  }
  if (!evaluation.pose_residuals.empty()) {
    text += '\n' + TextOf(WorstPosesTable(evaluation.pose_residuals));
  }
  return text;
}

std::string ComparisonText(const Comparison& comparison) {
  std::string text;
  const Agreement agreement = AgreementOf(comparison);
  if (agreement == Agreement::kNotCompared) {
    text = "NOT COMPARED: the two calibrations have no common parameter with a σ\n";
  } else if (agreement == Agreement::kAgree) {
    text = comparison.not_compared.empty()
               ? "AGREE: the differences are within their uncertainty\n"
               : "AGREE in common parameters: the differences are within their uncertainty\n";
  } else {
    text = "DIFFER: the differences are larger than their uncertainty\n";
  }
  if (agreement != Agreement::kNotCompared) {
    const ComparisonEntry* const largest = LargestOf(comparison);
    text +=
        Wrapped("χ² " + Significant(comparison.chi2, 4) + " for " + std::to_string(comparison.dof) +
                    " degrees of freedom, p = " + Significant(comparison.p_value, 2) +
                    " (they agree if at least " + Significant(kAgreementProbability, 1) +
                    "); largest difference " + Significant(comparison.largest_in_sigmas, 3) + " σ" +
                    (largest == nullptr ? "" : " (" + largest->parameter + ")") + ".",
                0);
  }
  if (!comparison.not_compared.empty()) {
    std::string names;
    for (const std::string& name : comparison.not_compared) {
      names += (names.empty() ? "" : ", ") + name;
    }
    text += Wrapped("NOT COMPARED: " + names + ".", 0);
  }
  if (comparison.field_scale_taken_out) {
    text += Wrapped(
        "The field strength was nominal in at least one of them, so the magnetometer's common "
        "scale was "
        "removed before comparing.",
        0);
  }
  Table table{{"parameter", "a", "b", "difference a - b", "in σ"}, "lrrrr", {}};
  for (const ComparisonEntry& entry : comparison.entries) {
    table.rows.push_back(
        {entry.parameter,
         Significant(entry.a, 6),
         Significant(entry.b, 6),
         WithSigma(entry.difference, entry.sigma),
         entry.sigma > 0.0 ? Fixed(std::abs(entry.difference) / entry.sigma, 1) : "–"});
  }
  if (table.rows.empty()) return text;
  return text + '\n' + TextOf(table) + '\n' +
         Wrapped(
             comparison.frames_differ
                 ? "Different sensors fix the body frames, so what no frame changes is compared: "
                   "biases and C^T C (gram); the two are assumed to be independent."
                 : "The body frames are aligned before comparing; the two are assumed to be "
                   "independent.");
}

}  // namespace truetriad
