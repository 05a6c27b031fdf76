// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "model/corrected_error.h"
#include "model/heading_error.h"
#include "report/charts.h"
#include "report/table.h"
#include "truetriad/base/triad.h"

namespace truetriad {
namespace {

/// Adds a row with CorrectedErrorOf, the error of a sensor in a field of `magnitude`. `factor`
/// converts the true unit to `unit`.
void AddErrors(const Calibration& calibration,
               const char* what,
               Triad triad,
               double magnitude,
               bool has_bias,
               double factor,
               const char* unit,
               Table* table) {
  const CorrectedError error = CorrectedErrorOf(calibration, triad, magnitude, has_bias);
  const auto number = [](double value) {
    return value >= 1e3 && value < 1e6 ? Fixed(value, 0) : Significant(value, 3);
  };
  const bool has_angle = magnitude > 0.0, is_estimated = error.after.worst > 0.0;
  const auto angle = [&](double rad) { return has_angle ? number(kDegPerRad * rad) : ""; };
  table->Add() << what << (error.before ? number(factor * error.before->rms) : "")
               << (error.before ? number(factor * error.before->worst) : "")
               << (is_estimated ? number(factor * error.after.rms) : "not estimated")
               << (is_estimated ? number(factor * error.after.worst) : "–") << unit
               << (error.before ? angle(error.before->angle_rms) : "")
               << (is_estimated ? angle(error.after.angle_rms) : "") << (has_angle ? "°" : "");
}

Table BeforeAndAfter(const Calibration& calibration) {
  Table table =
      Headed("; raw RMS; worst; corrected σ; worst; unit; raw; corrected; unit", "lrrrrlrrl");
  const ReferenceValues& reference = calibration.reference;
  const auto add = [&](const char* what,
                       Triad triad,
                       double magnitude,
                       bool has_bias,
                       double factor,
                       const char* unit) {
    if (calibration.sensors[triad]) {
      AddErrors(calibration, what, triad, magnitude, has_bias, factor, unit, &table);
    }
  };
  add("accelerometer in gravity",
      Triad::kAccelerometer,
      reference.gravity_mps2,
      true,
      1e3 / kStandardGravityMps2,
      "mg");
  if (reference.field_ut) {
    add(reference.field_nominal ? "magnetometer in the assumed field" : "magnetometer in the field",
        Triad::kMagnetometer,
        *reference.field_ut,
        true,
        1.0,
        "µT");
  }
  add("gyroscope at rest", Triad::kGyroscope, 0.0, true, 3600.0 * kDegPerRad, "°/h");
  add("gyroscope, of a rate", Triad::kGyroscope, 1.0, false, 1e6, "ppm");
  return table;
}

/// The heading error of a compass in the level unit: RMS and worst, raw and corrected, degrees.
void AddHeading(const Calibration& calibration, Table* table) {
  const std::vector<HeadingError> errors = HeadingErrors(calibration, kHeadings);
  if (errors.empty()) return;
  double raw_square = 0.0, raw_worst = 0.0, square = 0.0, worst = 0.0;
  for (const HeadingError& error : errors) {
    const double raw = error.raw_rad.value_or(0.0);
    raw_square += raw * raw / kHeadings;
    raw_worst = std::max(raw_worst, std::abs(raw));
    square += error.sigma_rad * error.sigma_rad / kHeadings;
    worst = std::max(worst, error.sigma_rad);
  }
  const auto degrees = [](double rad) { return Significant(kDegPerRad * rad, 3); };
  const bool has_raw = errors.front().raw_rad.has_value();
  table->Add() << "heading of a level unit" << (has_raw ? degrees(std::sqrt(raw_square)) : "")
               << (has_raw ? degrees(raw_worst) : "") << degrees(std::sqrt(square))
               << degrees(worst) << "°"
               << ""
               << ""
               << "";
}

// Whether the misalignment was held fixed: with free misalignment at least 3 gains + 3 angles = 6
// matrix entries have a σ.
bool HoldsMisalignment(const TriadCalibration& sensor) {
  return (sensor.sensitivity_sigma.array() > 0.0).count() < 6;
}

}  // namespace

Section CorrectedErrorSection(const Calibration& calibration, bool turns) {
  Section section{"Error before and after", {}};
  if (!calibration.IsUsable() || calibration.covariance.parameters.empty()) return section;
  Table table = BeforeAndAfter(calibration);
  AddHeading(calibration, &table);
  if (table.rows.empty()) return section;
  section.Add(std::move(table));
  section.Add(
      "RMS and worst error over all directions of gravity and field; the last columns state the "
      "RMS error of the direction. Raw: error of the readings at nominal scale. Corrected: error "
      "expected from the σ of the parameters, without the noise of a reading.");
  for (const Triad triad : kTriads) {
    if (!calibration.sensors[triad] || !HoldsMisalignment(*calibration.sensors[triad])) continue;
    section.Add("Misalignment of the " + std::string(TriadName(triad)) +
                " was not estimated, and its error is not in these numbers.");
  }
  if (calibration.sensors[Triad::kMagnetometer] && calibration.reference.field_nominal) {
    section.Add(
        "Field strength not given: the common scale of the magnetometer is unknown, and its "
        "readings have the relative error of the assumed strength. Directions and headings do "
        "not depend on it.");
  }
  section.draw = [&calibration, turns] {
    std::vector<Drawing> drawings =
        OfEachSensor([&](Triad triad) { return SphereDrawing(calibration, triad, turns); });
    drawings.push_back(HeadingDrawing(calibration));
    return drawings;
  };
  return section;
}

namespace {

/// The vector whose direction before and after a turn checks the gyroscope.
std::string TurnedVector(const Calibration& calibration) {
  return calibration.sensors[Triad::kAccelerometer] ? "gravity" : "the field";
}

/// The name of a sensor's error; for a gyroscope, the error of turns.
std::string NameOfError(const Calibration& calibration, Triad triad) {
  if (triad != Triad::kGyroscope) return TriadTitle(triad);
  return "Gyroscope: direction of " + TurnedVector(calibration) + " after a turn";
}

std::string UnitOfError(Triad triad) {
  return triad == Triad::kGyroscope ? "rad" : TruthUnit(triad);
}

std::string Ratio(const std::optional<double>& numerator,
                  const std::optional<double>& denominator) {
  return numerator && denominator && *denominator > 0.0 ? Significant(*numerator / *denominator, 3)
                                                        : "–";
}

Table ModelTable(const std::string& title, const std::vector<ModelAlternative>& models) {
  Table table = Headed(title + "; parameters; -2 log L; p; BIC; held out", "lrrrrr");
  for (const ModelAlternative& model : models) {
    table.Add() << (model.chosen ? "chosen" : model.description) << model.parameters
                << Fixed(model.minus_2_log_l, 1)
                << (model.p_value ? Probability(*model.p_value) : "–") << Fixed(model.bic, 1)
                << Significant(model.held_out, 5);
  }
  return table;
}

// Compares the turns that the operator stated with those that the gyroscope measured.
void AddKnownTurns(const std::vector<TurnCheck>& turns, Section* section) {
  if (turns.empty()) return;
  section->Add(Subtitle{"Known turns"});
  Table table = Headed("turn; stated; found; difference; σ; use", "lrrrrl");
  const auto degrees = [](double rad) { return Fixed(kDegPerRad * rad, 2) + "°"; };
  for (const TurnCheck& turn : turns) {
    TableRow row = table.Add();
    row << turn.name << degrees(turn.stated_rad);
    if (turn.fault.empty()) {
      row << degrees(turn.found_rad) << degrees(turn.found_rad - turn.stated_rad)
          << Significant(kDegPerRad * turn.found_sigma_rad, 2) + "°"
          << (turn.used ? "used" : "predicted only");
    } else {
      row << "–"
          << "–"
          << "–"
          << "skipped: " + turn.fault;
    }
  }
  section->Add(std::move(table));
  section->Add(
      "σ is the uncertainty of the angle found. A turn marked `used` took part in the calibration; "
      "a turn marked `predicted only` is an independent check.");
}

// The offsets of the sensors' clocks from the gyroscope's clock.
void AddClockOffsets(const std::vector<ClockOffset>& offsets, Section* section) {
  if (offsets.empty()) return;
  section->Add(Subtitle{"Clocks"});
  Table table = Headed("sensor; delay relative to the gyroscope; unit; moves; p", "lrlrr");
  for (const ClockOffset& offset : offsets) {
    table.Add() << TriadTitle(offset.triad) << WithSigma(1e3 * offset.later_s, 1e3 * offset.sigma_s)
                << "ms" << offset.moves << Probability(offset.p_value);
  }
  section->Add(std::move(table));
  section->Add(
      "If a delay is minus half a gyroscope sample, the gyroscope reports mean rates, stamped at "
      "the end of each sample.");
}

// Lists the poses left out of the solution, kMostListed at most.
void AddRejected(const std::vector<RejectedPose>& poses, Section* section) {
  if (poses.empty()) return;
  section->Add(Subtitle{"Rejected poses (" + std::to_string(poses.size()) + ")"});
  Table table = Headed("pose; sensor; reason", "rll");
  for (std::size_t i = 0; i < std::min(poses.size(), kMostListed); ++i) {
    table.Add() << poses[i].pose << TriadName(poses[i].triad) << poses[i].reason;
  }
  section->Add(std::move(table));
  if (poses.size() > kMostListed) {
    section->Add("… and " + std::to_string(poses.size() - kMostListed) + " more.");
  }
}

}  // namespace

Section LeftOutSection(const Quality& quality) {
  Section section{"Faults that were tested", {}};
  if (quality.left_out_tests.empty()) return section;
  section.Add(
      "A fault that is significant in the residuals is corrected or widens σ; see the findings. κ: "
      "one σ of the fault shifts the most affected parameter by κ of the parameter's σ, so an "
      "undetectable fault of 3 σ shifts it by 3 κ of its σ. If κ is large, add more, and more "
      "varied, poses.");
  Table table = Headed("sensor; fault; p; ; κ", "llrlr");
  for (const LeftOutTest& test : quality.left_out_tests) {
    table.Add() << TriadTitle(test.triad) << test.term << Probability(test.p_value)
                << (test.is_shown ? "significant" : "")
                << (test.kappa ? Significant(*test.kappa, 2) : "not observable");
  }
  section.Add(std::move(table));
  return section;
}

Section ModelChoiceSection(const Quality& quality) {
  Section section{"Choice of the model", {}};
  if (quality.rests.model_choice.empty()) return section;
  section.Add("Chosen: " + quality.rests.model_choice.front().description + ".");
  section.Add(
      "The table lists the chosen model, then models that differ from it by one step. A term that "
      "is not thermal is included if p of the likelihood ratio is below 0.1 %. Any other term is "
      "included if three criteria agree: p below 1 % (for thermal terms of a bias: p of the F test "
      "against the scatter between temperatures), a lower BIC, and a lower error on held-out poses "
      "and turns (RMS, in units of their noise; for thermal terms, holding out one temperature at "
      "a time).");
  section.Add(ModelTable("model", quality.rests.model_choice));
  if (quality.rests.model_steps.size() > 1) {
    section.Add("Steps from the largest observable model, " +
                quality.rests.model_steps.front().description +
                ": the term removed or restored, and the resulting model.");
    std::vector<ModelAlternative> steps = quality.rests.model_steps;
    steps.front().description = "start";
    section.Add(ModelTable("step", steps));
  }
  return section;
}

Section HeldOutSection(const Calibration& calibration) {
  const Quality& quality = calibration.quality;
  Section section{"Held-out error (cross-validation)", {}};
  if (calibration.mode == Mode::kSweep) return section;  // SweepSection shows it.
  if (!quality.rests.held_out) {
    if (quality.poses > 0 && calibration.IsUsable()) {
      section.Add(calibration.mode == Mode::kMotion
                      ? "Not computed for a unit in motion without rests."
                      : "Not computed: no poses were held out.");
    }
    return section;
  }
  const HeldOut& held_out = *quality.rests.held_out;
  section.Add("Each of " + std::to_string(held_out.folds) +
              " groups of poses was predicted by a calibration from the other groups: the error is "
              "the one to expect on new poses. A ratio well above 1 means that the model fits the "
              "noise (overfitting).");
  Table table =
      Headed("RMS of (|C(y - b)| - reference); held out; in sample; ratio; unit", "lrrrl");
  for (const Triad triad : kTriads) {
    const std::optional<double>&rms = held_out.rms[triad],
          &in_sample = held_out.in_sample_rms[triad];
    if (!rms) continue;
    table.Add() << NameOfError(calibration, triad) << Significant(rms, 3)
                << Significant(in_sample, 3) << Ratio(rms, in_sample) << UnitOfError(triad);
  }
  section.Add(std::move(table));
  if (held_out.turns) {
    section.Add("Direction of " + TurnedVector(calibration) + " at the next rest, each of " +
                std::to_string(held_out.turns->errors_rad.size()) +
                " turns held out once: median error " +
                MedianAngles(held_out.turns->median_rad, held_out.turns->nominal_median_rad) + ".");
  }
  return section;
}

Section ResidualsSection(const Calibration& calibration) {
  const Quality& quality = calibration.quality;
  Section section{"Residuals", {}};
  if (quality.rests.pose_residuals.empty() && quality.rests.turns.empty()) return section;
  section.Add(
      "A small residual alone proves nothing: a model with many terms, or poses with poor "
      "coverage, can fit well and still be wrong. Judge by the limits, the σ and the held-out "
      "error above.");
  Table table = Headed("RMS of (|C(y - b)| - reference); before; after; unit", "lrrl");
  for (const Triad triad : kTriads) {
    if (!quality.residual_rms[triad]) continue;
    table.Add() << NameOfError(calibration, triad)
                << Significant(quality.residual_rms_before[triad], 3)
                << Significant(quality.residual_rms[triad], 3) << UnitOfError(triad);
  }
  section.Add(std::move(table));
  std::string fit = std::to_string(quality.poses) + " poses";
  if (quality.dof > 0.0) {
    fit += ", " + Significant(quality.dof, 4) + (quality.dof == 1.0 ? " degree" : " degrees") +
           " of freedom; reduced χ² ";
    if (std::isfinite(quality.reduced_chi2_before)) {
      fit += Significant(quality.reduced_chi2_before, 3) + " with within-rest noise only, " +
             Significant(quality.reduced_chi2, 3) + " with pose-to-pose noise";
    } else {
      fit += Significant(quality.reduced_chi2, 3);
    }
  }
  section.Add(fit + ".");
  AddKnownTurns(quality.rests.turns, &section);
  AddClockOffsets(quality.rests.clock_offsets, &section);
  AddRejected(quality.rests.rejected_poses, &section);
  section.draw = [&calibration, &rests = quality.rests] {
    std::vector<Drawing> drawings = OfEachSensor([&](Triad triad) {
      return ResidualDrawing(rests.pose_residuals, calibration.sensors[triad], triad);
    });
    drawings.push_back(TurnDrawing(rests));
    return drawings;
  };
  return section;
}

void AddSessions(const RestQuality& quality,
                 Triad triad,
                 const std::string& unit,
                 Section* section) {
  Table table = Headed("bias by session; x; y; z; unit; poses; recording", "lrrrlrl");
  for (const SessionBias& session : quality.sessions) {
    if (session.triad != triad) continue;
    table.Add() << "session " + std::to_string(session.session)
                << WithSigma(session.bias_raw, session.sigma_raw) << unit << session.poses
                << session.file;
  }
  for (const BiasRepeatability& scatter : quality.repeatability) {
    if (scatter.triad != triad) continue;
    table.Add() << "repeatability, 1 σ" << WithSigma(scatter.value_raw, scatter.sigma_raw) << unit
                << ""
                << "";
    table.Add() << "next session, 1 σ" << Significant(scatter.next_session_raw, 2) << unit << ""
                << "";
  }
  if (table.rows.empty()) return;
  section->Add(std::move(table));
  section->Add(
      "The bias above is the mean of the sessions. Repeatability: scatter of the sessions' biases "
      "beyond the σ of each. Next session: expected deviation of the bias from the mean after the "
      "unit is switched on again.");
}

Section CoverageSection(const Calibration& calibration) {
  const Quality& quality = calibration.quality;
  Section section{"Pose coverage", {}};
  if (quality.coverage.empty()) return section;
  Table table = Headed("sensor; spread along the three axes; largest gap; ", "lrrl");
  for (const Coverage& coverage : quality.coverage) {
    const double smallest = coverage.eigenvalues[0], gap_deg = coverage.largest_gap_deg;
    table.Add() << TriadTitle(coverage.triad) << Joined(Fixed(coverage.eigenvalues, 3), " · ")
                << Fixed(gap_deg, 0) + " deg"
                << (smallest < 0.05   ? "nearly in one plane"
                    : gap_deg >= 90.0 ? "one side is missing"
                    : smallest < 0.15 ? "uneven"
                    : gap_deg > 60.0  ? "has a gap"
                                      : "even");
  }
  section.Add(std::move(table));
  section.Add(
      "Spread: eigenvalues of the mean of u uᵀ over the pose directions u; 0.333 each if even. "
      "Gap: radius of the largest circle on the sphere that contains no direction.");
  section.draw = [&calibration] {
    std::vector<Drawing> drawings =
        OfEachSensor([&](Triad triad) { return CoverageDrawing(calibration.quality, triad); });
    drawings.push_back(NextPoseDrawing(calibration));
    return drawings;
  };
  return section;
}

}  // namespace truetriad
