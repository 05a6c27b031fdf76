// SPDX-License-Identifier: Apache-2.0
#include "verdict/left_out_terms.h"

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include "base/messages.h"
#include "base/sensor_line.h"
#include "truetriad/base/units.h"
#include "verdict/checks/check.h"

namespace truetriad {
namespace {

// A term is told from the noise from about so many of its own σ on.
constexpr double kToldSigmas = 3.0;
// What a result may be off by and still be right.
constexpr double kTrustedSigmas = 5.0;

std::string SizeOf(const LeftOutTerm& term) {
  return Format("%.2g ", term.size) + std::string(TruthUnitName(term.triad));
}

std::string WordsOf(const LeftOutTerm& term) {
  switch (term.kind) {
    case LeftOutKind::kAxisTerm:
      return std::string("has ") + WithArticle(InfoOf(term.axis_term).words) +
             (term.is_beyond_stated ? " beyond its stated non-linearity" : "");
    case LeftOutKind::kMatrix:
      return std::string(term.is_shared ? "is turned against the others, with which it has a matrix"
                                        : "has a matrix") +
             " that its `model:` does not allow";
    case LeftOutKind::kGSensitivity:
      return "follows the specific force (g-sensitivity)";
    case LeftOutKind::kDrift:
      return "has a bias that drifts, by " + SizeOf(term) +
             " over the run; what is stated is its mean";
    case LeftOutKind::kGainDrift:
      return "has gains that drift over the run";
    case LeftOutKind::kThermalGain:
      return "has a matrix that follows the temperature beyond its terms; what is stated is its "
             "mean "
             "over the poses";
    case LeftOutKind::kLeverArm:
      return Format("sits %.2g m from the point about which the unit is turned", term.size);
    case LeftOutKind::kLowPass:
      return "reads less the faster it is turned (low-pass)";
    case LeftOutKind::kOneSided:
      return "has readings that are off to one side, which the means follow";
    case LeftOutKind::kLostRows:
      return Format(
          "turned further than its readings say: %.2g %% of the rows are missing, though "
          "their times are regular",
          100.0 * term.share);
    case LeftOutKind::kRounding:
      return "reads in steps that are larger than its noise, so its bias is known to a step only";
    case LeftOutKind::kSettling:
      return "has turns that are all too short by about the same angle";
    case LeftOutKind::kTurnScatter:
      return Format(
          "has turns that miss along their axes, as if %.2g %% of the rows were lost or "
          "their times were off",
          100.0 * term.share);
  }
  return {};
}

std::string RemedyOf(const LeftOutTerm& term, bool has_temperature) {
  const std::string sensor(TriadName(term.triad));
  switch (term.kind) {
    case LeftOutKind::kAxisTerm:
      if (InfoOf(term.axis_term).triad == term.triad) {
        return "state " + SensorLine(sensor, std::string(InfoOf(term.axis_term).name) + ": true");
      }
      return "look whether the " + sensor + " is near the end of its range";
    case LeftOutKind::kMatrix:
      return "state " + SensorLine(sensor, "model: full") +
             (term.is_shared ? ", and of the other sensors, too" : "");
    case LeftOutKind::kGSensitivity:
      return "state " + SensorLine(Triad::kGyroscope, "g_sensitivity: true");
    case LeftOutKind::kDrift:
    case LeftOutKind::kGainDrift:
      return std::string("let the unit warm up first") +
             (has_temperature ? ", or state temperature terms" : "");
    case LeftOutKind::kThermalGain:
      return "state " + SensorLine(sensor, "thermal: { matrix_order: auto }") +
             ", or a higher order";
    case LeftOutKind::kLeverArm:
      return "turn the unit about the sensor, or more slowly";
    case LeftOutKind::kLowPass:
      return "turn the unit more slowly, or set a wider bandwidth";
    case LeftOutKind::kOneSided:
      return "look for spikes in the log";
    case LeftOutKind::kRounding:
      return "log it with more digits, or set a smaller full-scale range";
    case LeftOutKind::kSettling:
      return "wait longer before and after each move, or set a wider bandwidth";
    case LeftOutKind::kLostRows:
      return "log the times at which readings were taken, and all of them";
    case LeftOutKind::kTurnScatter:
      return "rest for some seconds between turns; log the times at which readings were taken, and "
             "all of them";
  }
  return {};
}

}  // namespace

std::optional<Finding> LinearityAssumed(const std::vector<LeftOutTest>& tests,
                                        const std::vector<StatedBend>& stated) {
  std::vector<std::string> bends;
  double largest = 0.0;
  for (const LeftOutTest& test : tests) {
    const bool is_bend =
        std::any_of(kAxisTerms.begin(), kAxisTerms.end(), [&](const AxisTermInfo& info) {
          return info.name == test.term;
        });
    const bool is_known =
        test.is_shown || std::any_of(stated.begin(), stated.end(), [&](const StatedBend& bend) {
          return bend.triad == test.triad;
        });
    if (!is_bend || is_known || !test.kappa) continue;
    const double shift_sigmas = kToldSigmas * *test.kappa;
    if (shift_sigmas < kTrustedSigmas) continue;
    bends.push_back(Format("%.2g σ (", shift_sigmas) + std::string(TriadName(test.triad)) + " " +
                    test.term + ")");
    largest = std::max(largest, shift_sigmas);
  }
  if (bends.empty()) return std::nullopt;
  return Finding(FindingCode::kLinearityAssumed,
                 "σ hold for linear sensors: a bend just too small to show would shift some "
                 "parameter by " +
                     Listed(bends))
      .With("shift", largest);
}

Finding FindingOf(const StatedBend& bend) {
  const Nonlinearity& stated = bend.nonlinearity;
  return Finding(
             FindingCode::kNonlinearityStated,
             Format(bend.widening < 10.0
                        ? "σ are up to %.2f times those without the stated non-linearity of the "
                        : "σ are up to %.0f times those without the stated non-linearity of the ",
                    bend.widening) +
                 std::string(TriadName(bend.triad)) +
                 Format(", %.3g %% of", stated.percent_of_full_scale) +
                 Format(" ± %.4g ", stated.full_scale) + std::string(TruthUnitName(bend.triad)))
      .About(bend.triad)
      .With("widening", bend.widening);
}

Findings FindingsOf(const LeftOutTerms& terms) {
  Findings findings;
  for (const LeftOutTerm& term : terms.found) {
    findings.push_back(
        Finding(
            FindingCode::kLeftOutTerm,
            "the " + std::string(TriadName(term.triad)) + " " + WordsOf(term) +
                Format("; it moves parameters by up to %.2g times the σ that noise alone gives, ",
                       term.effect_sigmas) +
                (term.is_tied ? "and entries that the model ties have no σ to allow for it"
                              : "and σ are widened for it"),
            RemedyOf(term, terms.has_temperature))
            .About(term.triad)
            .Shifting(term.effect_sigmas, Treatment::kWidened)
            .With("p_value", term.p_value));
    if (term.effect_sigmas < 1.0) findings.back().As(Severity::kNote);
    // Entries that are tied to others have no σ of their own to widen.
    if (term.is_tied) findings.back().As(Severity::kRefusal).treatment = Treatment::kNone;
  }
  for (const LeftOutTerm& term : terms.doubtful) {
    findings.push_back(
        Finding(FindingCode::kTermInDoubt,
                "it is neither shown nor ruled out that the " + std::string(TriadName(term.triad)) +
                    " " + WordsOf(term) +
                    Format(" (p = %.2g), which would shift parameters", term.p_value) +
                    Format(" by up to %.2g σ; ", term.effect_sigmas) +
                    Format("σ are up to %.2g times as large for that", kMostByDoubt) +
                    (term.effect_sigmas > kTrustedSigmas * kMostByDoubt
                         ? ", which does not cover all of it"
                         : ""),
                "take more poses, or " + RemedyOf(term, terms.has_temperature))
            .About(term.triad)
            .With("p_value", term.p_value));
  }
  if (const auto assumed = LinearityAssumed(terms.tests, terms.stated))
    findings.push_back(*assumed);
  for (const StatedBend& bend : terms.stated) findings.push_back(FindingOf(bend));
  return findings;
}

}  // namespace truetriad
