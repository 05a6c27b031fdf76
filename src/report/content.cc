// SPDX-License-Identifier: Apache-2.0
#include "report/content.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "base/messages.h"
#include "base/utf8.h"
#include "math/distributions.h"
#include "report/charts.h"
#include "report/table.h"
#include "truetriad/base/triad.h"

namespace truetriad {
namespace {

/// Only the first three findings of a kind, and the first three correlations, are listed.
constexpr std::size_t kFewAlike = 3;
/// Beyond this many degrees of freedom Student's t is the normal distribution to three digits.
constexpr double kManyDof = 1e4;
/// Correlations above this are reported. If two parameters of equal σ have ρ = 0.9, the σ of their
/// difference is √(2 · 0.1) = 0.45 of it.
constexpr double kStrongCorrelation = 0.9;

std::string NoiseSentence(const TriadNoise& noise, Triad triad, bool from_motion) {
  std::string text = std::string(from_motion ? "Noise is the σ of the mean at one attitude, "
                                             : "Rest noise is the σ of a pose mean, ") +
                     std::string(NoiseSourceWords(noise.source));
  if (noise.excess_sigma > 0.0) {
    text += std::string(from_motion ? "; plus motion noise of " : "; plus pose-to-pose noise of ") +
            Significant(noise.excess_sigma, 2) + " " + TruthUnit(triad);
    if (std::isinf(noise.excess_dof)) {
      text += " (excess σ, as stated, not estimated)";
    } else if (noise.excess_dof > 0.0) {
      // States the degrees of freedom of the total noise, which determines the weights. Those of
      // the excess noise alone may be few, but have little effect if the rest noise dominates.
      text += " (excess σ; both noises together have " +
              (noise.excess_dof < kManyDof ? Significant(noise.excess_dof, 3) : "very many") +
              " degrees of freedom)";
    }
  }
  if (noise.turn_excess_sigma_rad > 0.0) {
    text += "; plus turn noise of " + Significant(kDegPerRad * noise.turn_excess_sigma_rad, 2) +
            "° about each axis (excess σ)";
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

/// The most correlated pairs in words; empty if no pair is strongly correlated.
std::string CorrelationSentence(const NamedCovariance& covariance) {
  std::vector<std::pair<double, std::string>> strong;  // |ρ| and the pair in words.
  Eigen::MatrixXd matrix = covariance.matrix;
  const auto size = static_cast<Eigen::Index>(covariance.parameters.size());
  if (matrix.rows() != size || matrix.cols() != size) return "";
  // The model correlates all gains with gravity, so correlations are stated for fixed gravity.
  const auto gravity = std::find(
      covariance.parameters.begin(), covariance.parameters.end(), "reference.gravity_mps2");
  if (gravity != covariance.parameters.end()) {
    const auto at = gravity - covariance.parameters.begin();
    const Eigen::VectorXd with = covariance.matrix.col(at);
    if (with[at] > 0.0) matrix -= with * with.transpose() / with[at];
    matrix.row(at).setZero();
    matrix.col(at).setZero();
  }
  for (Eigen::Index i = 0; i < size; ++i) {
    for (Eigen::Index j = 0; j < i; ++j) {
      const double rho = matrix(i, j) / std::sqrt(matrix(i, i) * matrix(j, j));
      // Tied parameters have ρ = ±1 by design; fixed parameters have NaN.
      if (!(std::abs(rho) > kStrongCorrelation) || std::abs(rho) > 1.0 - 1e-9) continue;
      strong.emplace_back(std::abs(rho),
                          covariance.parameters[static_cast<std::size_t>(j)] + " with " +
                              covariance.parameters[static_cast<std::size_t>(i)] + " (" +
                              Fixed(rho, 3) + ")");
    }
  }
  if (strong.empty()) return "";
  std::stable_sort(
      strong.begin(), strong.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  std::string text = "Strongly correlated, so nearly indistinguishable: ";
  for (std::size_t i = 0; i < std::min(strong.size(), kFewAlike); ++i) {
    text += (i ? ", " : "") + strong[i].second;
  }
  if (strong.size() > kFewAlike)
    text += " and " + std::to_string(strong.size() - kFewAlike) + " more";
  return text + ".";
}

/// The unit of a limit; empty for a share and for a name that this version does not know.
std::string LimitUnit(const std::string& name) {
  const Result<LimitName> parsed = ParseLimitName(name);
  return parsed ? DisplayUnit(parsed->Unit()) : "";
}

/// "± 0.5", "0.98 to 1.02", "at most 3".
std::string AllowedText(const std::string& name, const Limit& limit) {
  const Result<LimitName> parsed = ParseLimitName(name);
  const bool is_never_negative = parsed && parsed->IsNeverNegative();
  if (std::isinf(limit.lower) || (is_never_negative && limit.lower <= 0.0)) {
    return "at most " + Significant(limit.upper, 4);
  }
  if (limit.lower == -limit.upper) return "± " + Significant(limit.upper, 4);
  if (std::isinf(limit.upper)) return "at least " + Significant(limit.lower, 4);
  return Significant(limit.lower, 4) + " to " + Significant(limit.upper, 4);
}

/// " (± 0.4978)": the allowed values less the guard band of k σ; empty without a guard band.
std::string GuardedText(const LimitCheck& check) {
  const double guard = check.guard_band_k * check.sigma;
  if (!(guard > 0.0)) return "";
  Limit left = check.limit;
  left.lower += guard, left.upper -= guard;
  if (left.lower > left.upper) return " (no value passes)";
  return " (" + AllowedText(check.name, left) + ")";
}

}  // namespace

Section LimitsSection(const Calibration& calibration, double coverage_factor) {
  Section section{"Limits", {}};
  if (!calibration.IsUsable()) {
    section.Add("Not checked: the calibration is not usable.");
    return section;
  }
  const std::vector<LimitCheck>& limits = calibration.quality.limits;
  if (limits.empty()) {
    section.Add(
        "No limits were set, so only usability was checked. To pass or fail units, state "
        "`limits:` in the experiment.");
    return section;
  }
  const std::string sign =
      coverage_factor == 1.0 ? "± σ" : "± U, k = " + Significant(coverage_factor, 2);
  Table table =
      Headed("limit; result; allowed; worst found " + sign + "; unit; P outside", "llrrlr");
  for (const LimitCheck& check : limits) {
    table.Add() << check.FullName() << (check.pass ? "pass" : "FAIL")
                << AllowedText(check.name, check.limit) + GuardedText(check)
                << WithSigma(check.worst, coverage_factor * check.sigma) << LimitUnit(check.name)
                << (check.sigma > 0.0 ? Probability(check.outside) : "–");
  }
  section.Add(std::move(table));
  section.Add(
      "All values are in true units, so a bias is divided by its gain. P outside: the probability "
      "that the true value is outside its limit on any axis, each axis at its worst temperature.");
  // Files of earlier versions state no guard band.
  if (const double k = limits.front().guard_band_k; k > 0.0) {
    section.Add("A guard band is set: a value passes only if it is inside its limit by at least " +
                Significant(k, 3) + " σ, that is, within the limit in brackets.");
  }
  section.draw = [limits] { return std::vector{LimitDrawing(limits)}; };
  return section;
}

namespace {

/// A finding, and all sensors that have this finding with the same words.
struct SharedFinding {
  const Finding* finding;
  std::vector<std::string> sensors;  ///< The sensors with which the text begins.
};

/// The message without the sensor's name at its beginning.
std::string_view WithoutSensor(const Finding& finding, std::string_view message) {
  if (!finding.sensor) return message;
  const std::string head = std::string(TriadName(*finding.sensor)) + ": ";
  return message.starts_with(head) ? message.substr(head.size()) : message;
}

std::vector<SharedFinding> SharedFindings(const Findings& findings, Severity severity) {
  std::vector<SharedFinding> shared;
  for (const Finding& finding : findings) {
    if (finding.severity != severity) continue;
    const std::string message = finding.Message();
    const std::string_view rest = WithoutSensor(finding, message);
    const bool names_sensor = rest.size() < message.size();
    const auto same = std::find_if(shared.begin(), shared.end(), [&](const SharedFinding& other) {
      return !other.sensors.empty() && other.finding->code == finding.code &&
             WithoutSensor(*other.finding, other.finding->Message()) == rest;
    });
    if (names_sensor && same != shared.end()) {
      same->sensors.emplace_back(TriadName(*finding.sensor));
      continue;
    }
    shared.push_back({&finding, {}});
    if (names_sensor) shared.back().sensors.emplace_back(TriadName(*finding.sensor));
  }
  return shared;
}

/// Refusals, then warnings, then notes. If a kind has many findings, only the first few are listed.
Section FindingsSection(const Calibration& calibration) {
  Section section{calibration.IsUsable() ? "Findings" : "Why", {}};
  for (const Severity severity : {Severity::kRefusal, Severity::kWarning, Severity::kNote}) {
    const std::vector<SharedFinding> shared = SharedFindings(calibration.findings, severity);
    std::map<FindingCode, std::size_t> left, shown;
    for (const SharedFinding& each : shared) ++left[each.finding->code];
    for (const auto& [finding, sensors] : shared) {
      const FindingCode code = finding->code;
      const std::string tag =
          std::string(SeverityName(severity)) + ", " + std::string(FindingCodeName(code));
      // If only one finding is left, it is listed, since a line "1 more" would need as much room.
      if (code != FindingCode::kMessage && shown[code] == kFewAlike && left[code] > 1) {
        section.Add(Bullet{std::to_string(left[code]) +
                               " more findings like the last one; calibration.yaml lists all",
                           tag});
        left[code] = 0;
      }
      if (left[code] == 0) continue;
      --left[code], ++shown[code];
      const std::string message = finding->Message();
      section.Add(Bullet{sensors.size() < 2 ? message
                                            : Listed(sensors) + ": " +
                                                  std::string(WithoutSensor(*finding, message)),
                         code == FindingCode::kMessage ? "" : tag});
    }
  }
  return section;
}

/// Adds the corrections of all sensors, as firmware applies them, in one place.
void AddCorrections(const Calibration& calibration, Section* section) {
  section->Add(Subtitle{"Correction: corrected = C (raw − b)"});
  bool has_more = false;
  for (const Triad triad : kTriads) {
    const std::optional<TriadCalibration>& sensor = calibration.sensors[triad];
    if (!sensor) continue;
    section->Add(CorrectionTable(*sensor, triad));
    has_more = has_more || sensor->thermal || sensor->g_sensitivity ||
               std::any_of(kAxisTerms.begin(), kAxisTerms.end(), [&](const AxisTermInfo& info) {
                 return sensor->axis_term_sigma[info.term].has_value();
               });
  }
  if (has_more) {
    section->Add(
        "These corrections hold at the reference temperature and leave out the further terms "
        "above; `export` also writes the terms that its format can hold.");
  }
}

Section ParametersSection(const Calibration& calibration) {
  Section section{"Parameters and predicted uncertainty", {}};
  if (!calibration.IsUsable()) return section;
  const NamedCovariance& covariance = calibration.covariance;
  const double dof = calibration.quality.effective_dof;
  const bool from_motion = calibration.mode == Mode::kMotion;
  section.Add(IntervalSentence(dof));
  for (const Triad triad : kTriads) {
    const std::optional<TriadCalibration>& sensor = calibration.sensors[triad];
    if (!sensor) continue;
    section.Add(Subtitle{TriadTitle(triad)});
    Table table = ParameterTable(*sensor, triad, covariance);
    if (from_motion) table.rows.back().front() = "noise σ";
    section.Add(std::move(table));
    section.Add(NoiseSentence(sensor->noise, triad, from_motion));
    section.Add(MisalignmentTable(*sensor, triad, covariance));
    AddSessions(calibration.quality.rests, triad, sensor->input_unit, &section);
    if (sensor->thermal) {
      section.Add("τ is the temperature above " + Significant(sensor->thermal->reference_degc, 4) +
                  " °C; calibrated from " + Significant(sensor->thermal->range_degc(0), 3) +
                  " to " + Significant(sensor->thermal->range_degc(1), 3) + " °C.");
    }
  }
  AddCorrections(calibration, &section);
  section.Add(Subtitle{"References"});
  section.Add(ReferenceTable(calibration.reference, covariance));
  if (std::string words = CorrelationSentence(calibration.covariance); !words.empty()) {
    section.Add(std::move(words));
  }
  section.draw = [&covariance = calibration.covariance] {
    return std::vector{CorrelationDrawing(covariance)};
  };
  return section;
}

Section WeakDirectionsSection(const Quality& quality) {
  Section section{"Weak directions", {}};
  for (const WeakDirection& weak : quality.weak_directions) {
    std::string text = weak.description;
    if (weak.sigma > 0.0) text += " (σ " + Percent(weak.sigma) + " of the signal)";
    if (!weak.advice.empty()) text += "; " + weak.advice;
    section.Add(Bullet{text + "."});
  }
  return section;
}

/// The finding that caused the outcome. Files written before findings had codes hold none.
Finding WhyRefused(const Findings& findings) {
  if (const Finding* refusal = FirstRefusal(findings)) return *refusal;
  return {FindingCode::kDidNotConverge, "the result does not say why"};
}

/// The meaning of the refusal's code, as part of a sentence: "the optimiser did not converge".
std::string ReasonOf(const Calibration& calibration) {
  if (calibration.outcome == Outcome::kNotCalled) return "no calibration was run";
  const Finding refusal = WhyRefused(calibration.findings);
  // If findings of this code are usually warnings, the code's meaning would not explain a refusal,
  // so the message is used instead.
  if (FindingKindOf(refusal.code).severity != Severity::kRefusal) {
    const std::string_view sensor = refusal.sensor ? TriadName(*refusal.sensor) : "";
    return PrintableLine(std::string(sensor) + (sensor.empty() ? "" : ": ") + refusal.text);
  }
  std::string meaning(FindingKindOf(refusal.code).meaning);
  if (meaning.size() > 1 && std::isupper(static_cast<unsigned char>(meaning[1])) == 0) {
    meaning[0] = static_cast<char>(std::tolower(static_cast<unsigned char>(meaning[0])));
  }
  return meaning;
}

/// What the outcome means for the user, if there is no result.
std::string_view ScopeOf(Outcome outcome) {
  switch (outcome) {
    case Outcome::kNotObservable:
      return "Some enabled parameters are unobservable from these poses.";
    case Outcome::kNotEnough:
      return "The recording is not enough for the enabled parameters.";
    default:
      return "No number of this run can be used.";
  }
}

std::string FailedLimits(const Quality& quality) {
  std::string names;
  for (const LimitCheck& check : quality.limits) {
    if (check.pass) continue;
    names += (names.empty() ? "" : ", ") + check.FullName();
    const bool is_inside = check.worst <= check.limit.upper && check.worst >= check.limit.lower;
    if (is_inside && check.guard_band_k > 0.0) {
      names += " (inside, but not by " + Significant(check.guard_band_k, 3) + " σ)";
    }
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

std::string OriginOf(const std::string& file, const Calibration& calibration) {
  std::string origin = file;
  const auto add = [&origin, &file](const std::string& text) {
    origin += (origin == file ? ": " : ", ") + text;
  };
  if (!calibration.serial.empty()) add("unit " + calibration.serial);
  if (!calibration.created.empty()) add("calibrated " + calibration.created);
  return origin;
}

std::string MissedText(const LimitCheck& check) {
  const std::string unit = LimitUnit(check.name);
  return check.FullName() + ' ' + Significant(check.worst, 3) + " of " +
         AllowedText(check.name, check.limit) + (unit.empty() || unit == "1" ? "" : ' ' + unit);
}

const LimitCheck& WorstLimit(const std::vector<LimitCheck>& limits) {
  return *std::max_element(
      limits.begin(), limits.end(), [](const LimitCheck& one, const LimitCheck& other) {
        return std::pair(!one.pass, one.outside) < std::pair(!other.pass, other.outside);
      });
}

std::string DecisionText(const Decision& decision) {
  return PrintableLine(std::string(VerdictName(decision.verdict)) + " by " + decision.who + " on " +
                       decision.created + ": " + decision.why);
}

Headline HeadlineOf(const Calibration& calibration) {
  const Verdict verdict = calibration.verdict();
  const std::string head =
      std::string(VerdictWords(verdict)) +
      (calibration.serial.empty() ? "" : ", " + PrintableLine(calibration.serial)) + ": ";
  const std::vector<LimitCheck>& limits = calibration.quality.limits;
  constexpr std::string_view kUsable = "Converged, and every parameter is observable.";
  if (calibration.IsUsable() && !calibration.decisions.empty()) {
    const Verdict by_limits = calibration.LimitsVerdict();
    return {verdict == Verdict::kPass ? Grade::kGood : Grade::kBad,
            head + DecisionText(calibration.decisions.back()),
            "By the limits alone it is " + std::string(VerdictWords(by_limits)) +
                (by_limits == Verdict::kFail ? ": " + FailedLimits(calibration.quality) : "") +
                "."};
  }
  switch (verdict) {
    case Verdict::kNoLimits:
      if (calibration.covariance.parameters.empty()) {
        return {Grade::kCaution,
                head + "start values only, as requested",
                "The start values were not refined; no uncertainty available."};
      }
      return {Grade::kNeutral, head + "usable, neither passed nor failed", std::string(kUsable)};
    case Verdict::kPass:
      return {
          Grade::kGood,
          head + (limits.size() == 1 ? "its limit is met"
                                     : "all " + std::to_string(limits.size()) + " limits are met"),
          std::string(kUsable)};
    case Verdict::kFail:
      return {Grade::kBad,
              head + (limits.empty() ? "outside limits" : MissedText(WorstLimit(limits))),
              std::string(kUsable) + " Outside limits: " + FailedLimits(calibration.quality) + "."};
    case Verdict::kNoResult:
      break;
  }
  return {Grade::kBad, head + ReasonOf(calibration), std::string(ScopeOf(calibration.outcome))};
}

std::vector<Section> SectionsOf(const Calibration& calibration, bool turns) {
  const Quality& quality = calibration.quality;
  std::vector<Section> sections = {LimitsSection(calibration, 1.0),
                                   FindingsSection(calibration),
                                   CorrectedErrorSection(calibration, turns),
                                   ParametersSection(calibration),
                                   SoakSection(calibration),
                                   SweepSection(calibration),
                                   WeakDirectionsSection(quality),
                                   ModelChoiceSection(quality),
                                   HeldOutSection(calibration),
                                   ResidualsSection(calibration),
                                   LeftOutSection(quality),
                                   CoverageSection(calibration)};
  // If the calibration failed, the reasons and the weak directions come before the limits.
  if (!calibration.IsUsable()) {
    std::rotate(sections.begin() + 2, sections.begin() + 6, sections.begin() + 7);
    std::rotate(sections.begin(), sections.begin() + 1, sections.begin() + 3);
  }
  std::erase_if(sections, [](const Section& section) { return section.blocks.empty(); });
  return sections;
}

Table IdentityTable(const Calibration& calibration) {
  Table table{.header = {}, .alignment = "ll", .rows = {}, .style = "identity"};
  const auto add = [&](std::string_view label, const std::string& value) {
    if (!value.empty()) table.Add() << label << value;
  };
  add("device", calibration.serial.empty() ? "no serial number" : calibration.serial);
  add("model", calibration.model);
  for (const TagKey& tag : kDeviceTags) add(tag.key, calibration.tags.*tag.value);
  for (const TagKey& tag : kRunTags) add(tag.key, calibration.tags.*tag.value);
  for (const InputFile& input : calibration.inputs) {
    // A manifest only names files and has no samples of its own.
    add("input",
        input.file + (input.samples > 0 ? ", " + std::to_string(input.samples) + " samples" : "") +
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
