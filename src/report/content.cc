// SPDX-License-Identifier: Apache-2.0
#include "report/content.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <optional>
#include <string_view>
#include <utility>

#include "math/distributions.h"
#include "report/format.h"
#include "report/parameter_table.h"
#include "report/soak_content.h"
#include "report/sweep_content.h"
#include "truetriad/base/units.h"

namespace truetriad {
namespace {

/// Beyond this many degrees of freedom Student's t is the normal distribution to three digits.
constexpr double kManyDof = 1e4;
/// Below this many, the σ are themselves known to a quarter at best: 1 / sqrt(2 dof).
constexpr double kFewDof = 10.0;
/// Correlations above this are worth a sentence.
constexpr double kStrongCorrelation = 0.9;

/// More rejected poses than this are counted, not listed.
constexpr std::size_t kMaxRejectedRows = 50;
/// What a gyroscope's residual is.
constexpr const char* kTurnRow = "Gyroscope: direction of gravity after a turn";

std::string NoiseSentence(const TriadNoise& noise, Triad triad, bool from_motion) {
  std::string text = std::string(from_motion ? "Noise is the σ of the mean at one attitude, "
                                             : "Rest noise is the σ of a pose mean, ") +
                     std::string(NoiseSourceWords(noise.source));
  if (noise.excess_sigma > 0.0) {
    text += std::string(from_motion ? "; plus motion noise of " : "; plus pose-to-pose noise of ") +
            Significant(noise.excess_sigma, 2) + " " + TruthUnit(triad);
    if (std::isinf(noise.excess_dof)) {
      text += " (excess σ, as stated)";
    } else if (noise.excess_dof > 0.0) {
      text += " (excess σ, " + Significant(noise.excess_dof, 3) + " degrees of freedom)";
    }
  }
  return text + ".";
}

std::string IntervalSentence(double dof) {
  if (!(dof > 0.0)) return "The ± are one standard deviation (σ).";
  const double factor = dof < kManyDof ? StudentQuantile(0.975, dof) : NormalQuantile(0.975);
  return "The ± are one standard deviation (σ); for 95 % multiply by " + Significant(factor, 3) +
         " (Student's t with " + (dof < kManyDof ? Significant(dof, 3) : "very many") +
         " effective degrees of freedom).";
}

/// A caution where the σ themselves are hardly known, or empty.
std::string FewDofSentence(double dof, bool is_sweep) {
  if (!(dof > 0.0) || dof >= kFewDof) return "";
  return "CAUTION: only " + Significant(dof, 2) +
         " degrees of freedom support σ, so σ itself is known only to about " +
         Percent(1.0 / std::sqrt(2.0 * dof)) +
         (is_sweep
              ? "; the residual of the sweep varies slowly: repeat the sweep, or make it longer."
              : "; add poses.");
}

/// The most correlated pairs in words, or empty.
std::string CorrelationSentence(const NamedCovariance& covariance) {
  struct Pair {
    double rho;
    std::string words;
  };
  std::vector<Pair> strong;
  const Eigen::MatrixXd& matrix = covariance.matrix;
  const auto size = static_cast<Eigen::Index>(covariance.parameters.size());
  if (matrix.rows() != size || matrix.cols() != size) return "";
  for (Eigen::Index i = 0; i < size; ++i) {
    for (Eigen::Index j = 0; j < i; ++j) {
      const double rho = matrix(i, j) / std::sqrt(matrix(i, i) * matrix(j, j));
      // Tied entries have ±1 by design; NaN belongs to fixed ones.
      if (!(std::abs(rho) > kStrongCorrelation) || std::abs(rho) > 1.0 - 1e-9) continue;
      strong.push_back({rho,
                        covariance.parameters[static_cast<std::size_t>(j)] + " with " +
                            covariance.parameters[static_cast<std::size_t>(i)] + " (" +
                            Fixed(rho, 3) + ")"});
    }
  }
  if (strong.empty()) return "";
  std::stable_sort(strong.begin(), strong.end(), [](const Pair& a, const Pair& b) {
    return std::abs(a.rho) > std::abs(b.rho);
  });
  constexpr std::size_t kShown = 3;
  std::string text = "Strongly correlated, so nearly indistinguishable: ";
  for (std::size_t i = 0; i < std::min(strong.size(), kShown); ++i) {
    text += (i ? ", " : "") + strong[i].words;
  }
  if (strong.size() > kShown) text += " and " + std::to_string(strong.size() - kShown) + " more";
  return text + ".";
}

/// The unit in which a limit is stated, by the last part of its name.
std::string LimitUnit(const std::string& name) {
  const auto dot = name.find('.');
  const std::string quantity = dot == std::string::npos ? "" : name.substr(dot + 1);
  if (quantity == "misalignment_rad") return "rad";
  if (quantity != "bias" && quantity != "residual_rms") return "";
  const std::optional<Triad> triad = TriadFromName(name.substr(0, dot));
  if (triad == Triad::kGyroscope && quantity == "residual_rms") return "rad";
  return triad ? TruthUnit(*triad) : "";
}

Section LimitsSection(const Calibration& calibration) {
  Section section{SectionKind::kLimits, "Limits", {}};
  if (!calibration.IsUsable()) {
    section.blocks.emplace_back(std::string("Not checked: the calibration is not usable."));
    return section;
  }
  const std::vector<LimitCheck>& limits = calibration.quality.limits;
  if (limits.empty()) {
    section.blocks.emplace_back(
        std::string("No limits were set, so only usability was checked. To pass or fail units, "
                    "state `limits:` in the experiment."));
    return section;
  }
  Table table{{"limit", "allowed", "worst found", "unit", "used", "result"}, "lrrlrl", {}};
  for (const LimitCheck& check : limits) {
    table.rows.push_back({check.name,
                          Significant(check.limit, 4),
                          WithSigma(check.worst, check.sigma),
                          LimitUnit(check.name),
                          Percent(std::abs(check.worst) / check.limit),
                          check.pass ? "pass" : "FAIL"});
  }
  section.blocks.emplace_back(std::move(table));
  if (std::any_of(limits.begin(), limits.end(), [](const LimitCheck& check) {
        return !check.pass && std::abs(check.worst) <= check.limit;
      })) {
    section.blocks.emplace_back(
        std::string("A guard band was set: a value passes only if it is within its limit by a "
                    "multiple of its σ."));
  }
  return section;
}

/// Refusals, then warnings, then notes.
Section FindingsSection(const Calibration& calibration) {
  Section section{SectionKind::kFindings, calibration.IsUsable() ? "Findings" : "Why", {}};
  for (const Severity severity : {Severity::kRefusal, Severity::kWarning, Severity::kNote}) {
    for (const Finding& finding : calibration.findings) {
      if (finding.severity != severity) continue;
      Bullet bullet{finding.Message()};
      if (finding.code != FindingCode::kMessage) {
        bullet.tag =
            std::string(SeverityName(severity)) + ", " + std::string(FindingCodeName(finding.code));
      }
      section.blocks.emplace_back(std::move(bullet));
    }
  }
  return section;
}

Section ParametersSection(const Calibration& calibration) {
  Section section{SectionKind::kParameters, "Parameters and predicted uncertainty", {}};
  if (!calibration.IsUsable()) return section;
  const Propagation propagation(calibration.covariance);
  const double dof = calibration.quality.effective_dof;
  const bool from_motion = calibration.mode == Mode::kMotion;
  section.blocks.emplace_back(IntervalSentence(dof));
  if (std::string caution = FewDofSentence(dof, calibration.mode == Mode::kSweep);
      !caution.empty()) {
    section.blocks.emplace_back(Bullet{std::move(caution)});
  }
  for (const Triad triad : kTriads) {
    const std::optional<TriadCalibration>& sensor = calibration.sensors[triad];
    if (!sensor) continue;
    section.blocks.emplace_back(Subtitle{TriadTitle(triad)});
    Table table = ParameterTable(*sensor, triad, propagation);
    if (from_motion) table.rows.back().front() = "noise σ";
    section.blocks.emplace_back(std::move(table));
    section.blocks.emplace_back(NoiseSentence(sensor->noise, triad, from_motion));
    if (sensor->thermal) {
      section.blocks.emplace_back(
          "τ is the temperature above " + Significant(sensor->thermal->reference_degc, 4) +
          " °C; calibrated from " + Significant(sensor->thermal->range_degc(0), 3) + " to " +
          Significant(sensor->thermal->range_degc(1), 3) + " °C.");
    }
  }
  section.blocks.emplace_back(Subtitle{"References"});
  section.blocks.emplace_back(ReferenceTable(calibration.reference, propagation));
  if (std::string words = CorrelationSentence(calibration.covariance); !words.empty()) {
    section.blocks.emplace_back(std::move(words));
  }
  return section;
}

Section WeakDirectionsSection(const Quality& quality) {
  Section section{SectionKind::kWeakDirections, "Weak directions", {}};
  for (const WeakDirection& weak : quality.weak_directions) {
    std::string text = weak.description;
    if (weak.sigma > 0.0) text += " (σ " + Percent(weak.sigma) + " of the signal)";
    if (!weak.advice.empty()) text += "; " + weak.advice;
    section.blocks.emplace_back(Bullet{text + "."});
  }
  return section;
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
    const bool is_tiny = model.p_value && *model.p_value < 1e-12;
    table.rows.push_back({model.chosen ? "chosen" : model.description,
                          std::to_string(model.parameters),
                          Fixed(model.minus_2_log_l, 1),
                          is_tiny ? "< 1e-12" : OptionalNumber(model.p_value),
                          Fixed(model.bic, 1),
                          model.held_out ? Significant(*model.held_out, 5) : "–"});
  }
  return table;
}

Section ModelChoiceSection(const Quality& quality) {
  Section section{SectionKind::kModelChoice, "Choice of the model", {}};
  if (quality.rests.model_choice.empty()) return section;
  section.blocks.emplace_back("Chosen: " + quality.rests.model_choice.front().description + ".");
  section.blocks.emplace_back(std::string(
      "The table lists the chosen model, then those that differ from it by one step. A term is "
      "included if three criteria agree: p of the likelihood ratio below 1 % (for thermal terms of "
      "a bias: p of the F test against the scatter between temperatures), a lower BIC, and a lower "
      "error on held-out poses and turns (RMS, in units of their noise; for thermal terms, holding "
      "out one temperature at a time)."));
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
    table.rows.push_back({is_turn ? kTurnRow : TriadTitle(triad),
                          OptionalNumber(held_out.rms[triad]),
                          OptionalNumber(held_out.in_sample_rms[triad]),
                          Ratio(held_out.rms[triad], held_out.in_sample_rms[triad]),
                          is_turn ? "rad" : TruthUnit(triad)});
  }
  section.blocks.emplace_back(std::move(table));
  if (held_out.turns) {
    section.blocks.emplace_back(
        "Direction of gravity at the next rest, each of " +
        std::to_string(held_out.turns->errors_rad.size()) + " turns held out once: median error " +
        MedianAngles(held_out.turns->median_rad, held_out.turns->nominal_median_rad) + ".");
  }
  return section;
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
                          Significant(offset.p_value, 2)});
  }
  section->blocks.emplace_back(std::move(table));
  section->blocks.emplace_back(
      std::string("A delay of minus half a gyroscope sample means that the gyroscope reports mean "
                  "rates, stamped "
                  "at the end of each sample."));
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
    table.rows.push_back({is_turn ? kTurnRow : TriadTitle(triad),
                          OptionalNumber(quality.residual_rms_before[triad]),
                          OptionalNumber(quality.residual_rms[triad]),
                          is_turn ? "rad" : TruthUnit(triad)});
  }
  section.blocks.emplace_back(std::move(table));
  std::string fit = std::to_string(quality.poses) + " poses";
  if (quality.dof > 0.0) {
    fit += ", " + Significant(quality.dof, 4) + " degrees of freedom; reduced χ² ";
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

std::string FirstRefusal(const Findings& findings) {
  const auto refusal = std::find_if(
      findings.begin(), findings.end(), [](const Finding& finding) { return finding.IsRefusal(); });
  return refusal == findings.end() ? "too few poses." : refusal->Message();
}

std::string FailedLimits(const Quality& quality) {
  std::string names;
  for (const LimitCheck& check : quality.limits) {
    if (!check.pass) names += (names.empty() ? "" : ", ") + check.name;
  }
  return names.empty() ? "see the limits" : names;
}

}  // namespace

std::string_view NoiseSourceWords(NoiseSource source) {
  switch (source) {
    case NoiseSource::kStatic:
      return "measured in the recording";
    case NoiseSource::kAllan:
      return "from an Allan deviation";
    case NoiseSource::kDatasheet:
      return "from the data sheet";
    case NoiseSource::kConfig:
      return "as stated in the configuration";
    case NoiseSource::kResidual:
      return "from the residuals (no χ² verdict is possible)";
  }
  return "of unknown origin";
}

Verdict VerdictOf(const Calibration& calibration) {
  switch (calibration.outcome) {
    case Outcome::kConverged:
      if (calibration.covariance.parameters.empty()) {
        return {Grade::kCaution,
                "START VALUES ONLY, as requested",
                "The start values were not refined; no uncertainty available."};
      }
      if (!calibration.within_limits) {
        return {
            Grade::kGood, "USABLE, no limits set", "Converged, and every parameter is observable."};
      }
      if (*calibration.within_limits) {
        return {Grade::kGood,
                "USABLE, within limits",
                "Converged, every parameter is observable, and every limit is met."};
      }
      return {Grade::kCaution,
              "USABLE, OUTSIDE LIMITS",
              "Converged, and every parameter is observable, but outside limits: " +
                  FailedLimits(calibration.quality) + "."};
    case Outcome::kNotObservable:
      return {Grade::kBad,
              "NOT USABLE: not observable",
              "Some enabled parameters are unobservable from these poses."};
    case Outcome::kNotConverged:
      return {Grade::kBad,
              "NOT USABLE: not converged",
              "The fit did not converge, or does not match the readings."};
    case Outcome::kNotEnough:
      return {Grade::kBad,
              "NOT USABLE: not enough",
              "The recording is not enough for the enabled parameters: " +
                  FirstRefusal(calibration.findings)};
    case Outcome::kNotCalled:
      break;
  }
  return {Grade::kBad, "NOT USABLE: nothing was calibrated", "No calibration was run."};
}

std::vector<Section> SectionsOf(const Calibration& calibration) {
  const Quality& quality = calibration.quality;
  std::vector<Section> sections;
  for (Section& section : std::vector<Section>{LimitsSection(calibration),
                                               FindingsSection(calibration),
                                               ParametersSection(calibration),
                                               SoakSection(calibration),
                                               SweepSection(calibration),
                                               WeakDirectionsSection(quality),
                                               ModelChoiceSection(quality),
                                               HeldOutSection(calibration),
                                               ResidualsSection(calibration),
                                               CoverageSection(quality)}) {
    if (!section.blocks.empty()) sections.push_back(std::move(section));
  }
  // A reader of a failure wants the reason and the cure before the limits.
  if (!calibration.IsUsable()) {
    std::stable_partition(sections.begin(), sections.end(), [](const Section& section) {
      return section.kind == SectionKind::kFindings || section.kind == SectionKind::kWeakDirections;
    });
  }
  return sections;
}

Table IdentityTable(const Calibration& calibration) {
  Table table{{}, "ll", {}};
  const auto add = [&](const char* label, const std::string& value) {
    if (!value.empty()) table.rows.push_back({label, value});
  };
  add("device", calibration.serial.empty() ? "no serial number" : calibration.serial);
  add("model", calibration.model);
  for (const InputFile& input : calibration.inputs) {
    add("input",
        input.file +
            // A manifest names files and has none itself.
            (input.samples > 0 ? ", " + std::to_string(input.samples) + " samples" : "") +
            (input.sha256.empty() ? "" : ", sha256 " + input.sha256.substr(0, 12)));
  }
  add("body frame",
      std::string(GaugeName(calibration.gauge)) + ", led by the " +
          std::string(TriadName(calibration.gauge_sensor)));
  add("created", calibration.created);
  add("software",
      calibration.software_version.empty() ? "" : "truetriad " + calibration.software_version);
  return table;
}

Table PoseTable(const Quality& quality) {
  Table table{{"pose",
               "sensor",
               "before",
               "after",
               "Δx",
               "Δy",
               "Δz",
               "unit",
               "normalised",
               "weight",
               "direction"},
              "rlrrrrrlrrr",
              {}};
  for (const PoseResidual& pose : quality.rests.pose_residuals) {
    table.rows.push_back({std::to_string(pose.pose),
                          std::string(TriadName(pose.triad)),
                          Significant(pose.norm_error_before, 3),
                          Significant(pose.norm_error, 3),
                          Significant(pose.residual.x(), 3),
                          Significant(pose.residual.y(), 3),
                          Significant(pose.residual.z(), 3),
                          TruthUnit(pose.triad),
                          Fixed(pose.normalized, 2),
                          Fixed(pose.weight, 2),
                          Fixed(pose.direction.x(), 2) + ", " + Fixed(pose.direction.y(), 2) +
                              ", " + Fixed(pose.direction.z(), 2)});
  }
  return table;
}

std::string MedianAngles(double median_rad, const std::optional<double>& nominal_rad) {
  const auto in_degrees = [](double angle_rad) {
    return Significant(angle_rad * kDegPerRad, 3) + " deg";
  };
  std::string text = in_degrees(median_rad);
  if (nominal_rad) {
    text += "; " + in_degrees(*nominal_rad) + " with nominal gains and the at-rest mean as bias";
  }
  return text;
}

std::string TriadTitle(Triad triad) {
  std::string title(TriadName(triad));
  title.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(title.front())));
  return title;
}

std::string TruthUnit(Triad triad) { return DisplayUnit(TruthUnitName(triad)); }

}  // namespace truetriad
