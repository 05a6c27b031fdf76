// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/messages.h"
#include "report/content.h"
#include "report/format.h"
#include "report/page.h"
#include "report/residual_charts.h"
#include "report/table.h"
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
  Table table{{"pose", "sensor", "norm error", "unit", "normalised"}, "rlrlr", {}};
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
  if (evaluation.angle_ratio) {
    table.rows.push_back({"Angle, field to gravity",
                          "–",
                          number(evaluation.angle_std_deg),
                          number(evaluation.predicted_angle_std_deg),
                          number(evaluation.angle_ratio),
                          "deg"});
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

Headline HeadlineFor(const EvaluationSummary& evaluation, const Calibration& calibration) {
  std::string tested =
      "Calibration of " +
      (calibration.serial.empty() ? "a unit without serial number" : calibration.serial) +
      " tested on " + std::to_string(evaluation.poses) +
      (evaluation.poses == 1 ? " pose." : " poses.");
  std::vector<std::string> names;
  for (const Triad triad : evaluation.not_tested) names.emplace_back(TriadName(triad));
  if (!names.empty()) {
    tested += " NOT TESTED, since the recording has no rests of it: " + Listed(names) + ".";
  }
  switch (VerdictOf(evaluation)) {
    case PredictionVerdict::kNotEvaluated:
      return {Grade::kBad,
              "NOT EVALUATED: the recording has no poses of the calibrated sensors",
              tested};
    case PredictionVerdict::kNoTest:
      return {Grade::kCaution,
              "NOT A TEST: the calibration was made from this recording, so that small errors "
              "prove nothing; evaluate another one",
              tested};
    case PredictionVerdict::kNoPrediction:
      return {Grade::kCaution, "EVALUATED, but no prediction to compare with", tested};
    case PredictionVerdict::kAsPredicted:
      if (WorstErrorRatio(evaluation).value_or(0.0) > kExpectedErrorRatio) {
        return {Grade::kCaution,
                "AS PREDICTED, as far as so few poses and degrees of freedom tell: the errors are "
                "up to " +
                    Significant(*WorstErrorRatio(evaluation), 3) +
                    " times the prediction, which is itself hardly known",
                tested + " Evaluate more poses, or calibrate from more."};
      }
      return {Grade::kGood,
              "AS PREDICTED: the errors on these poses are consistent with noise and parameter "
              "uncertainty",
              tested};
    case PredictionVerdict::kWorse:
      break;
  }
  for (const Triad triad : {Triad::kAccelerometer, Triad::kMagnetometer}) {
    const auto& before = evaluation.norm_rms_before[triad];
    if (!before || !(*evaluation.norm_rms[triad] > *before)) continue;
    tested += " Uncalibrated the " + std::string(TriadName(triad)) +
              "'s errors are smaller: a calibration of another unit, exchanged or reversed axes, "
              "or a log that was corrected already?";
    break;
  }
  return {Grade::kBad,
          "WORSE THAN PREDICTED: up to " + Significant(*WorstErrorRatio(evaluation), 3) +
              " times the error expected from noise and parameter uncertainty",
          tested};
}

PageContent ContentOf(const EvaluationSummary& evaluation,
                      const Calibration& calibration,
                      const std::vector<std::string>& about) {
  PageSection errors{"Errors on these poses", {TableOf(evaluation)}};
  const auto add = [&errors](std::string text) { errors.blocks.emplace_back(std::move(text)); };
  add("Misfit is 1 where the errors are as predicted. It counts once what all poses share, such as "
      "the local gravity, which the RMS count at every pose.");
  for (const Triad triad : kTriads) {
    if (!evaluation.about_mean[triad]) continue;
    add("The " + std::string(TriadName(triad)) + "'s error is stated about the mean: " +
        (calibration.mode == Mode::kSweep
             ? "its bias and gain at the reference temperature are not calibrated."
             : "the calibration does not say how strong the field is."));
  }
  if (evaluation.clamped_poses > 0) {
    add(std::to_string(evaluation.clamped_poses) +
        " poses lie outside the calibrated temperature range; they were evaluated with the terms "
        "at its nearest end.");
  }
  if (evaluation.angle_ratio) {
    add("The angle between field and gravity is one over all poses in a uniform field: its "
        "spread.");
  }
  if (evaluation.turns) {
    const EvaluatedTurns& turns = *evaluation.turns;
    add(std::string("Direction of ") +
        (turns.against == Triad::kMagnetometer ? "the field" : "gravity") +
        " at the next rest, predicted by each of " + std::to_string(turns.count) +
        " turns: median error " + MedianAngles(turns.median_rad, turns.nominal_median_rad) + ".");
  }
  PageContent content{
      "Test of the calibration of " +
          (calibration.serial.empty() ? "unit without serial number" : calibration.serial),
      HeadlineFor(evaluation, calibration),
      {}};
  if (!about.empty()) {
    content.sections.push_back({"", {about.begin(), about.end()}});
  }
  content.sections.push_back(std::move(errors));
  if (!evaluation.pose_residuals.empty()) {
    PageSection poses{"Worst poses", {WorstPosesTable(evaluation.pose_residuals)}};
    for (const Triad triad : kTriads) {
      poses.drawings.push_back(
          {ResidualChart(evaluation.pose_residuals, calibration.sensors[triad], triad),
           ResidualCaption(triad)});
    }
    content.sections.push_back(std::move(poses));
  }
  return content;
}

}  // namespace

Grade GradeOf(const EvaluationSummary& evaluation, const Calibration& calibration) {
  return HeadlineFor(evaluation, calibration).grade;
}

std::string EvaluationText(const EvaluationSummary& evaluation,
                           const Calibration& calibration,
                           const std::vector<std::string>& about) {
  return TextOf(ContentOf(evaluation, calibration, about));
}

std::string EvaluationHtml(const EvaluationSummary& evaluation,
                           const Calibration& calibration,
                           const std::vector<std::string>& about) {
  return HtmlOf(ContentOf(evaluation, calibration, about));
}

}  // namespace truetriad
