// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/messages.h"
#include "report/charts.h"
#include "report/content.h"
#include "report/page.h"
#include "report/table.h"
#include "truetriad/calibrate/evaluate.h"
#include "truetriad/report/report.h"

namespace truetriad {
namespace {

constexpr std::size_t kWorstPoses = 5;  // Enough to see what these poses have in common.

/// The poses with the largest normalised residuals.
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

// RMS errors before and after calibration, the predicted RMS and the misfit.
Table TableOf(const EvaluationSummary& evaluation) {
  Table table =
      Headed("RMS of (|C(y - b)| - reference); uncalibrated; calibrated; predicted; misfit; unit",
             "lrrrrl");
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
    tested +=
        " NOT TESTED, because the recording has no rests of these sensors: " + Listed(names) + ".";
  }
  switch (VerdictOf(evaluation)) {
    case PredictionVerdict::kNotEvaluated:
      return {Grade::kBad,
              "NOT EVALUATED: the recording has no poses of the calibrated sensors",
              tested};
    case PredictionVerdict::kNoTest:
      return {Grade::kCaution,
              "NOT A TEST: the calibration was made from this recording, so that small errors "
              "prove nothing; evaluate another recording",
              tested};
    case PredictionVerdict::kNoPrediction:
      return {Grade::kCaution,
              "EVALUATED, but the errors cannot be predicted, since the noise is unknown",
              tested};
    case PredictionVerdict::kAsPredicted:
      if (WorstErrorRatio(evaluation).value_or(0.0) > kExpectedErrorRatio) {
        return {Grade::kCaution,
                "AS PREDICTED, as far as so few poses and degrees of freedom can show: the errors "
                "are up to " +
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
    tested += " Without the calibration the " + std::string(TriadName(triad)) +
              "'s errors are smaller: check for a calibration of another unit, exchanged or "
              "reversed axes, or a log that was corrected already.";
    break;
  }
  return {Grade::kBad,
          "WORSE THAN PREDICTED: up to " + Significant(*WorstErrorRatio(evaluation), 3) +
              " times the error expected from noise and parameter uncertainty",
          tested};
}

}  // namespace

VerbReport ReportOf(const EvaluationSummary& evaluation,
                    const Calibration& calibration,
                    const std::vector<std::string>& about) {
  Section errors{"Errors on these poses", {TableOf(evaluation)}};
  errors.Add(
      "Misfit is 1 if the errors are as predicted. An error common to all poses, such as that of "
      "local gravity, counts once in the misfit but at every pose in the RMS.");
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
        "at the nearest end of the range.");
  }
  if (evaluation.angle_ratio) {
    errors.Add(
        "In a uniform field the angle between field and gravity is the same at all poses; the "
        "table states its spread.");
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
  return ReportOf(content);
}

namespace {

std::string WordsOf(const ErrorOfTwo& error, const SideBySide& both) {
  if (error.name == "accelerometer") return "Accelerometer, from gravity";
  if (error.name == "accelerometer-spread") return "Accelerometer, about its mean";
  if (error.name == "magnetometer") return "Magnetometer, from the field";
  if (error.name == "magnetometer-spread") return "Magnetometer, about its mean";
  if (error.name == "angle") return "Angle, field to gravity";
  if (error.name == "gyroscope") return "Gyroscope, at rest";
  return both.a.turns->against == Triad::kMagnetometer ? "Field after a turn"
                                                       : "Gravity after a turn";
}

std::string Times(const ErrorOfTwo& error) { return Significant(error.times(), 3) + " times"; }

// "37 times as large (Gyroscope, at rest)": the largest ratio among the errors that `better` wins.
std::string MostOf(const SideBySide& both, Better better) {
  const ErrorOfTwo* most = nullptr;
  for (const ErrorOfTwo& error : both.errors) {
    if (error.better != better) continue;
    if (most == nullptr || error.times() > most->times()) most = &error;
  }
  return Times(*most) + " as large (" + WordsOf(*most, both) + ")";
}

Headline HeadlineFor(const SideBySide& both) {
  std::string explanation;
  for (const auto& [evaluation, name] : {std::pair(&both.a, "A"), std::pair(&both.b, "B")}) {
    if (evaluation->is_own) {
      explanation += (explanation.empty() ? "" : " ") + std::string(name) +
                     " was made from this recording and is favoured by it; evaluate both on "
                     "another recording.";
    }
  }
  const std::string poses = Counted(both.a.poses, "pose");
  switch (BetterOf(both)) {
    case Better::kA:
      return {
          both.a.is_own ? Grade::kCaution : Grade::kGood,
          "A IS BETTER on these " + poses + ": B's errors are up to " + MostOf(both, Better::kA),
          explanation};
    case Better::kB:
      return {
          both.b.is_own ? Grade::kCaution : Grade::kBad,
          "B IS BETTER on these " + poses + ": A's errors are up to " + MostOf(both, Better::kB),
          explanation};
    case Better::kMixed:
      return {Grade::kCaution,
              "EACH IS BETTER in something on these " + poses + ": B's errors are up to " +
                  MostOf(both, Better::kA) + ", A's up to " + MostOf(both, Better::kB),
              explanation};
    case Better::kNeither:
      break;
  }
  return {Grade::kNeutral,
          both.errors.empty()
              ? "NOT COMPARED: the recording has no poses of a sensor that both calibrations have"
              : "NO DIFFERENCE that exceeds both 10 % and chance on these " + poses,
          explanation};
}

}  // namespace

VerbReport ReportOf(const SideBySide& both, const std::vector<std::string>& about) {
  PageContent content{"Two calibrations side by side", HeadlineFor(both), {}};
  Section head{"", {about.begin(), about.end()}};
  for (const Triad triad : kTriads) {
    const bool in_a = both.a.norm_rms[triad].has_value();
    if (in_a == both.b.norm_rms[triad].has_value()) continue;
    head.Add("NOT COMPARED: " + std::string(TriadName(triad)) + ", which " + (in_a ? "B" : "A") +
             " does not have.");
  }
  content.sections.push_back(std::move(head));
  if (both.errors.empty()) return ReportOf(content);
  Table table = Headed("RMS error; A; B; unit; of; better", "lrrlrl");
  for (const ErrorOfTwo& error : both.errors) {
    table.Add() << WordsOf(error, both) << Significant(error.a, 3) << Significant(error.b, 3)
                << DisplayUnit(error.unit)
                << Counted(error.count, error.name == "turn" ? "turn" : "pose")
                << (error.better == Better::kNeither
                        ? "–"
                        : (error.better == Better::kA ? "A, " : "B, ") + Times(error));
  }
  std::string held = "Lengths are compared with gravity of " + Significant(both.gravity_mps2, 6) +
                     " " + TruthUnit(Triad::kAccelerometer);
  if (both.field_ut) {
    held += " and a field of " + Significant(*both.field_ut, 4) + " " +
            TruthUnit(Triad::kMagnetometer) +
            "; this field is valid only at the place of calibration, so for the magnetometer the "
            "spread of the length about its mean decides instead";
  }
  content.sections.push_back({"Errors on these poses",
                              {std::move(table),
                               held + ".",
                               "Better: the error is smaller by more than 10 %, and chance (1 in "
                               "1000) does not explain it. Both have the same poses."}});
  return ReportOf(content);
}

namespace {

Headline HeadlineFor(const Comparison& comparison) {
  const Agreement agreement = AgreementOf(comparison);
  if (agreement == Agreement::kNotCompared) {
    return {
        Grade::kBad, "NOT COMPARED: the two calibrations have no common parameter with a σ", ""};
  }
  const ComparisonEntry* const largest = LargestOf(comparison);
  const std::string p = Probability(comparison.p_value);  // "0.3", "< 1e-6"
  const std::string numbers = "χ² " + Significant(comparison.chi2, 4) + " for " +
                              std::to_string(comparison.dof) + " degrees of freedom, p " +
                              (p.front() == '<' ? "" : "= ") + p + " (they agree if at least " +
                              Significant(kAgreementProbability, 1) + "); largest difference " +
                              Significant(comparison.largest_in_sigmas, 3) + " σ" +
                              (largest == nullptr ? "" : " (" + largest->parameter + ")") + ".";
  if (agreement == Agreement::kAgree) {
    const std::string where = comparison.not_compared.empty() ? "" : " in common parameters";
    return {
        Grade::kGood, "AGREE" + where + ": the differences are within their uncertainty", numbers};
  }
  return {Grade::kBad, "DIFFER: the differences are larger than their uncertainty", numbers};
}

}  // namespace

VerbReport ReportOf(const Comparison& comparison, const std::vector<std::string>& about) {
  PageContent content{"Comparison of two calibrations", HeadlineFor(comparison), {}};
  Section head;
  for (const std::string& line : about) head.Add(line);
  if (!comparison.not_compared.empty()) {
    std::string names;
    for (const std::string& name : comparison.not_compared) {
      names += (names.empty() ? "" : ", ") + name;
    }
    head.Add("NOT COMPARED: " + names + ".");
  }
  if (comparison.field_scale_taken_out) {
    head.Add(
        "The field strength was nominal in at least one of the two calibrations, so the "
        "magnetometer's common scale was removed before comparing.");
  }
  if (!head.blocks.empty()) content.sections.push_back(std::move(head));
  Table table = Headed("parameter; a; b; difference a - b; in σ", "lrrrr");
  for (const ComparisonEntry& entry : comparison.entries) {
    const double size = std::abs(entry.difference) / entry.sigma;
    table.Add() << entry.parameter << Significant(entry.a, 6) << Significant(entry.b, 6)
                << WithSigma(entry.difference, entry.sigma)
                << (entry.sigma > 0.0 ? Fixed(size, 1) : "–");
  }
  if (table.rows.empty()) return ReportOf(content);
  content.sections.push_back(
      {"Differences",
       {std::move(table),
        comparison.frames_differ ? "The body frames are defined by different sensors, so only "
                                   "quantities independent of the frame are compared: biases and "
                                   "C^T C (gram); the two calibrations are assumed to be "
                                   "independent."
                                 : "The body frames are aligned before comparing; the two "
                                   "calibrations are assumed to be independent."},
       [&comparison] { return std::vector{DifferenceDrawing(comparison.entries)}; }});
  return ReportOf(content);
}

}  // namespace truetriad
