// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/messages.h"
#include "report/charts.h"
#include "report/content.h"
#include "report/format.h"
#include "report/page.h"
#include "report/table.h"
#include "truetriad/calibrate/evaluate.h"
#include "truetriad/report/report.h"

namespace truetriad {
namespace {

constexpr std::size_t kWorstPoses = 5;  // Enough to see whether they are alike.

/// The poses that the calibration predicts worst, by normalised residual.
Table WorstPosesTable(std::vector<PoseResidual> residuals) {
  std::stable_sort(residuals.begin(), residuals.end(), [](const auto& a, const auto& b) {
    return std::abs(a.normalized) > std::abs(b.normalized);
  });
  residuals.resize(std::min(residuals.size(), kWorstPoses));
  Table table = Headed("pose; sensor; norm error; unit; normalised", "rlrlr");
  for (const PoseResidual& pose : residuals) {
    table.Add() << pose.pose << TriadName(pose.triad) << Significant(pose.norm_error, 3)
                << TruthUnit(pose.triad) << Fixed(pose.normalized, 2);
  }
  return table;
}

// RMS errors and their ratios to what was predicted.
Table TableOf(const EvaluationSummary& evaluation) {
  Table table = Headed(
      "RMS of |C(y - b)| - reference; uncalibrated; calibrated; predicted; misfit; unit", "lrrrrl");
  using Number = std::optional<double>;
  const auto add = [&table](const std::string& name,
                            const Number& before,
                            const Number& after,
                            const Number& predicted,
                            const Number& ratio,
                            const std::string& unit) {
    TableRow row = table.Add();
    row << name;
    for (const Number& number : {before, after, predicted, ratio}) row << Significant(number, 3);
    row << unit;
  };
  for (const Triad triad : kTriads) {
    if (!evaluation.norm_rms[triad]) continue;
    add(TriadTitle(triad),
        evaluation.norm_rms_before[triad],
        evaluation.norm_rms[triad],
        evaluation.predicted_rms[triad],
        evaluation.error_ratio[triad],
        TruthUnit(triad));
  }
  if (evaluation.angle_ratio) {
    add("Angle, field to gravity",
        std::nullopt,
        evaluation.angle_std_deg,
        evaluation.predicted_angle_std_deg,
        evaluation.angle_ratio,
        "deg");
  }
  if (evaluation.turns) {
    const EvaluatedTurns& turns = *evaluation.turns;
    Number ratio;
    if (turns.predicted_rms_rad > 0.0 && turns.rms_rad > 0.0) {
      ratio = turns.rms_rad / turns.predicted_rms_rad;
    }
    add(turns.against == Triad::kMagnetometer ? "Field after a turn" : "Gravity after a turn",
        turns.nominal_rms_rad,
        turns.rms_rad,
        turns.predicted_rms_rad,
        ratio,
        "rad");
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
        return {
            Grade::kCaution,
            "AS PREDICTED within what so few poses and degrees of freedom allow: the errors are "
            "up to " +
                Significant(*WorstErrorRatio(evaluation), 3) +
                " times the prediction, which is itself uncertain",
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
  Section errors{"Errors on these poses", {TableOf(evaluation)}};
  errors.Add(
      "Misfit is 1 where the errors are as predicted. It counts errors common to all poses once, "
      "such "
      "as that of the local gravity, which the RMS count at every pose.");
  for (const Triad triad : kTriads) {
    if (!evaluation.about_mean[triad]) continue;
    errors.Add("The " + std::string(TriadName(triad)) + "'s error is stated about the mean: " +
               (calibration.mode == Mode::kSweep
                    ? "its bias and gain at the reference temperature are not calibrated."
                    : "the calibration does not say how strong the field is."));
  }
  if (evaluation.clamped_poses > 0) {
    errors.Add(
        std::to_string(evaluation.clamped_poses) +
        " poses lie outside the calibrated temperature range; they were evaluated with the terms "
        "at its nearest end.");
  }
  if (evaluation.angle_ratio) {
    errors.Add(
        "The angle between field and gravity is one over all poses in a uniform field: its "
        "spread.");
  }
  if (evaluation.turns) {
    const EvaluatedTurns& turns = *evaluation.turns;
    errors.Add(std::string("Direction of ") +
               (turns.against == Triad::kMagnetometer ? "the field" : "gravity") +
               " at the next rest, predicted by each of " + std::to_string(turns.count) +
               " turns: median error " + MedianAngles(turns.median_rad, turns.nominal_median_rad) +
               ".");
  }
  PageContent content{
      "Test of the calibration of " +
          (calibration.serial.empty() ? "unit without serial number" : calibration.serial),
      HeadlineFor(evaluation, calibration),
      {}};
  if (!about.empty()) content.sections.push_back({"", {about.begin(), about.end()}});
  content.sections.push_back(std::move(errors));
  if (!evaluation.pose_residuals.empty()) {
    Section poses{"Worst poses", {WorstPosesTable(evaluation.pose_residuals)}};
    poses.draw = [&] {
      return OfEachSensor([&](Triad triad) {
        return ResidualDrawing(evaluation.pose_residuals, calibration.sensors[triad], triad);
      });
    };
    content.sections.push_back(std::move(poses));
  }
  return content;
}

}  // namespace

VerbReport ReportOf(const EvaluationSummary& evaluation,
                    const Calibration& calibration,
                    const std::vector<std::string>& about) {
  return ReportOf(ContentOf(evaluation, calibration, about));
}

}  // namespace truetriad
