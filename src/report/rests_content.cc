// SPDX-License-Identifier: Apache-2.0
#include "report/rests_content.h"

#include <algorithm>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "report/format.h"
#include "truetriad/base/units.h"

namespace truetriad {
namespace {

/// More rejected poses than this are counted, not listed.
constexpr std::size_t kMaxRejectedRows = 50;
/// What turns are measured against.
std::string TurnedVector(const Calibration& calibration) {
  return calibration.sensors[Triad::kAccelerometer] ? "gravity" : "the field";
}

/// What a gyroscope's residual is.
std::string TurnRow(const Calibration& calibration) {
  return "Gyroscope: direction of " + TurnedVector(calibration) + " after a turn";
}

std::string OptionalNumber(const std::optional<double>& value) {
  return value ? Significant(*value, 3) : "–";
}

std::string Ratio(const std::optional<double>& numerator,
                  const std::optional<double>& denominator) {
  return numerator && denominator && *denominator > 0.0 ? Significant(*numerator / *denominator, 3)
                                                        : "–";
}

Table ModelTable(const std::string& title, const std::vector<ModelAlternative>& models) {
  Table table{{title, "parameters", "-2 log L", "p", "BIC", "held out"}, "lrrrrr", {}};
  for (const ModelAlternative& model : models) {
    table.rows.push_back({model.chosen ? "chosen" : model.description,
                          std::to_string(model.parameters),
                          Fixed(model.minus_2_log_l, 1),
                          model.p_value ? Probability(*model.p_value) : "–",
                          Fixed(model.bic, 1),
                          model.held_out ? Significant(*model.held_out, 5) : "–"});
  }
  return table;
}

// What the operator stated beside what the gyroscope saw.
void AddKnownTurns(const std::vector<TurnCheck>& turns, Section* section) {
  if (turns.empty()) return;
  section->blocks.emplace_back(Subtitle{"Known turns"});
  Table table{{"turn", "stated", "found", "difference", "σ", "use"}, "lrrrrl", {}};
  for (const TurnCheck& turn : turns) {
    std::vector<std::string> row = {turn.name, Fixed(kDegPerRad * turn.stated_rad, 2) + "°"};
    if (turn.fault.empty()) {
      row.push_back(Fixed(kDegPerRad * turn.found_rad, 2) + "°");
      row.push_back(Fixed(kDegPerRad * (turn.found_rad - turn.stated_rad), 2) + "°");
      row.push_back(Significant(kDegPerRad * turn.found_sigma_rad, 2) + "°");
      row.emplace_back(turn.used ? "used" : "predicted only");
    } else {
      row.insert(row.end(), {"–", "–", "–", "skipped: " + turn.fault});
    }
    table.rows.push_back(std::move(row));
  }
  section->blocks.emplace_back(std::move(table));
  section->blocks.emplace_back(
      std::string("σ is the uncertainty of the angle found. A turn marked `used` took part in the "
                  "calibration; one marked `predicted only` is an independent check."));
}

// Sensors' clocks against the gyroscope's.
void AddClockOffsets(const std::vector<ClockOffset>& offsets, Section* section) {
  if (offsets.empty()) return;
  constexpr double kMsPerS = 1e3;
  section->blocks.emplace_back(Subtitle{"Clocks"});
  Table table{{"sensor", "delay relative to the gyroscope", "unit", "moves", "p"}, "lrlrr", {}};
  for (const ClockOffset& offset : offsets) {
    table.rows.push_back({TriadTitle(offset.triad),
                          WithSigma(kMsPerS * offset.later_s, kMsPerS * offset.sigma_s),
                          "ms",
                          std::to_string(offset.moves),
                          Probability(offset.p_value)});
  }
  section->blocks.emplace_back(std::move(table));
  section->blocks.emplace_back(std::string(
      "Where a delay is minus half a gyroscope sample, the gyroscope reports mean rates, "
      "stamped at the end of each sample."));
}

}  // namespace

Section LeftOutSection(const Quality& quality) {
  Section section{SectionKind::kLeftOut, "What the model leaves out", {}};
  if (quality.left_out_tests.empty()) return section;
  section.blocks.emplace_back(std::string(
      "Each was looked for in the residuals: what shows is corrected, or widens σ, as the "
      "findings say. κ is how far one that does not show may shift some parameter: "
      "one that is there at 3 σ, too little to be told, shifts it by 3 κ of its σ. "
      "Against terms of large κ these poses do not protect: more, and more varied, poses "
      "do."));
  Table table{{"sensor", "term", "p", "", "κ"}, "llrlr", {}};
  for (const LeftOutTest& test : quality.left_out_tests) {
    table.rows.push_back({TriadTitle(test.triad),
                          test.term,
                          Probability(test.p_value),
                          test.is_shown ? "shows" : "",
                          test.kappa ? Significant(*test.kappa, 2) : "unseen"});
  }
  section.blocks.emplace_back(std::move(table));
  return section;
}

Section ModelChoiceSection(const Quality& quality) {
  Section section{SectionKind::kModelChoice, "Choice of the model", {}};
  if (quality.rests.model_choice.empty()) return section;
  section.blocks.emplace_back("Chosen: " + quality.rests.model_choice.front().description + ".");
  section.blocks.emplace_back(std::string(
      "The table lists the chosen model, then those that differ from it by one step. A term is "
      "included if p of the likelihood ratio is below 0.1 % (not so thermal terms), else if three "
      "criteria agree: p below 1 % (for thermal terms of a bias: p of the F test against the "
      "scatter between temperatures), a lower BIC, and a lower error on held-out poses and turns "
      "(RMS, in units of their noise; for thermal terms, holding out one temperature at a time)."));
  section.blocks.emplace_back(ModelTable("model", quality.rests.model_choice));
  if (quality.rests.model_steps.size() > 1) {
    section.blocks.emplace_back("Steps from the largest observable model, " +
                                quality.rests.model_steps.front().description +
                                ": the term removed or restored, and the resulting model.");
    std::vector<ModelAlternative> steps = quality.rests.model_steps;
    steps.front().description = "start";
    section.blocks.emplace_back(ModelTable("step", steps));
  }
  return section;
}

Section HeldOutSection(const Calibration& calibration) {
  const Quality& quality = calibration.quality;
  Section section{SectionKind::kHeldOut, "Held-out error (cross-validation)", {}};
  if (calibration.mode == Mode::kSweep) return section;  // It is in the section of the sweep.
  if (!quality.rests.held_out) {
    if (quality.poses > 0) {
      section.blocks.emplace_back(std::string(
          calibration.mode == Mode::kMotion ? "Not computed for a unit in motion without rests."
                                            : "Not computed: no poses were held out."));
    }
    return section;
  }
  const HeldOut& held_out = *quality.rests.held_out;
  section.blocks.emplace_back(
      "Each of " + std::to_string(held_out.folds) +
      " groups of poses was predicted by a calibration from the others: this is the error to "
      "expect on new poses. A ratio well above 1 means that the model fits the noise.");
  Table table{
      {"RMS of |C(y - b)| - reference", "held out", "in sample", "ratio", "unit"}, "lrrrl", {}};
  for (const Triad triad : kTriads) {
    if (!held_out.rms[triad]) continue;
    const bool is_turn = triad == Triad::kGyroscope;
    table.rows.push_back({is_turn ? TurnRow(calibration) : TriadTitle(triad),
                          OptionalNumber(held_out.rms[triad]),
                          OptionalNumber(held_out.in_sample_rms[triad]),
                          Ratio(held_out.rms[triad], held_out.in_sample_rms[triad]),
                          is_turn ? "rad" : TruthUnit(triad)});
  }
  section.blocks.emplace_back(std::move(table));
  if (held_out.turns) {
    section.blocks.emplace_back(
        "Direction of " + TurnedVector(calibration) + " at the next rest, each of " +
        std::to_string(held_out.turns->errors_rad.size()) + " turns held out once: median error " +
        MedianAngles(held_out.turns->median_rad, held_out.turns->nominal_median_rad) + ".");
  }
  return section;
}

Section ResidualsSection(const Calibration& calibration) {
  const Quality& quality = calibration.quality;
  Section section{SectionKind::kResiduals, "Residuals", {}};
  if (quality.rests.pose_residuals.empty() && quality.rests.turns.empty()) return section;
  section.blocks.emplace_back(
      std::string("A small residual alone proves nothing: a model with many terms, or poses with "
                  "poor coverage, can fit well and still be wrong. Judge by the limits, the σ and "
                  "the held-out error above."));
  Table table{{"RMS of |C(y - b)| - reference", "before", "after", "unit"}, "lrrl", {}};
  for (const Triad triad : kTriads) {
    if (!quality.residual_rms[triad]) continue;
    const bool is_turn = triad == Triad::kGyroscope;
    table.rows.push_back({is_turn ? TurnRow(calibration) : TriadTitle(triad),
                          OptionalNumber(quality.residual_rms_before[triad]),
                          OptionalNumber(quality.residual_rms[triad]),
                          is_turn ? "rad" : TruthUnit(triad)});
  }
  section.blocks.emplace_back(std::move(table));
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
  section.blocks.emplace_back(fit + ".");
  AddKnownTurns(quality.rests.turns, &section);
  AddClockOffsets(quality.rests.clock_offsets, &section);
  if (!quality.rests.rejected_poses.empty()) {
    const std::size_t count = quality.rests.rejected_poses.size();
    section.blocks.emplace_back(Subtitle{"Rejected poses (" + std::to_string(count) + ")"});
    Table rejected{{"pose", "sensor", "reason"}, "rll", {}};
    for (std::size_t i = 0; i < std::min(count, kMaxRejectedRows); ++i) {
      const RejectedPose& pose = quality.rests.rejected_poses[i];
      rejected.rows.push_back(
          {std::to_string(pose.pose), std::string(TriadName(pose.triad)), pose.reason});
    }
    section.blocks.emplace_back(std::move(rejected));
    if (count > kMaxRejectedRows) {
      section.blocks.emplace_back("… and " + std::to_string(count - kMaxRejectedRows) + " more.");
    }
  }
  return section;
}

void AddSessions(const RestQuality& quality,
                 Triad triad,
                 const std::string& unit,
                 Section* section) {
  Table table{{"bias by session", "x", "y", "z", "unit", "poses", "recording"}, "lrrrlrl", {}};
  const auto add = [&](const std::string& title,
                       const Eigen::Vector3d& value,
                       const Eigen::Vector3d& sigma,
                       const std::string& poses,
                       const std::string& file) {
    std::vector<std::string> row = {title};
    for (int axis = 0; axis < 3; ++axis) row.push_back(WithSigma(value[axis], sigma[axis]));
    row.insert(row.end(), {unit, poses, file});
    table.rows.push_back(std::move(row));
  };
  for (const SessionBias& session : quality.sessions) {
    if (session.triad != triad) continue;
    add("session " + std::to_string(session.session),
        session.bias_raw,
        session.sigma_raw,
        std::to_string(session.poses),
        session.file);
  }
  for (const BiasRepeatability& scatter : quality.repeatability) {
    if (scatter.triad != triad) continue;
    add("repeatability, 1 σ", scatter.value_raw, scatter.sigma_raw, "", "");
    table.rows.push_back({"next session, 1 σ"});
    for (const double sigma : scatter.next_session_raw) {
      table.rows.back().push_back(Significant(sigma, 2));
    }
    table.rows.back().insert(table.rows.back().end(), {unit, "", ""});
  }
  if (table.rows.empty()) return;
  section->blocks.emplace_back(std::move(table));
  section->blocks.emplace_back(
      std::string("The bias above is the mean of the sessions. Repeatability is how they scatter "
                  "beyond their own σ; next session is how far the bias will be from the mean when "
                  "the unit is switched on again."));
}

Section CoverageSection(const Quality& quality) {
  Section section{SectionKind::kCoverage, "Pose coverage", {}};
  if (quality.coverage.empty()) return section;
  Table table{{"sensor", "spread along the three axes", "largest gap", ""}, "lrrl", {}};
  for (const Coverage& coverage : quality.coverage) {
    const Eigen::Vector3d& spread = coverage.eigenvalues;
    table.rows.push_back(
        {TriadTitle(coverage.triad),
         Fixed(spread(0), 3) + " · " + Fixed(spread(1), 3) + " · " + Fixed(spread(2), 3),
         Fixed(coverage.largest_gap_deg, 0) + " deg",
         spread(0) < 0.05                   ? "nearly in one plane"
         : coverage.largest_gap_deg >= 90.0 ? "one side is missing"
         : spread(0) < 0.15                 ? "uneven"
         : coverage.largest_gap_deg > 60.0  ? "has a gap"
                                            : "even"});
  }
  section.blocks.emplace_back(std::move(table));
  section.blocks.emplace_back(
      std::string("Spread: eigenvalues of the mean of u uᵀ over the pose directions u; 0.333 each "
                  "if even. Gap: radius of the largest cap of the sphere without a direction."));
  return section;
}

}  // namespace truetriad
