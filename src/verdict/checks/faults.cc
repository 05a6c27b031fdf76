// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <string>
#include <vector>

#include "base/messages.h"
#include "base/sensor_line.h"
#include "faults/words.h"
#include "truetriad/base/triad.h"
#include "verdict/checks/check.h"

namespace truetriad {
namespace {

PerTriad<std::string> UnitsOf(const PoseSet& poses) {
  PerTriad<std::string> units;
  for (const StreamSummary& stream : poses.streams) units[stream.triad] = stream.unit.name;
  return units;
}

// Whether the fault is in matrix entries that the model ties in pairs (kSymmetric), so that they
// have no σ of their own. Models without ties (kBias, kDiagonal) have at most three free columns.
bool IsTied(const TakenFault& fault, const SharedLayout& layout) {
  return fault.place.kind->parameter == ParameterKind::kSensitivity &&
         layout.ColumnsOf(layout.sensitivity[fault.place.triad], 9).size() > 3;
}

// The remedy: the line that makes the fault a parameter; `otherwise` if there is no such line.
std::string RemedyOf(const TakenFault& fault, const std::string& otherwise) {
  const FaultKind& kind = *fault.place.kind;
  if (kind.parameter == ParameterKind::kSensitivity) {
    return "state " + SensorLine(fault.place.triad, "model: full");
  }
  if (!kind.parameter) return otherwise;
  return "state " +
         SensorLine(fault.place.triad, std::string(InfoOf(*kind.parameter).name) + ": true");
}

Finding FindingOf(const TakenFault& fault, const SettledRun& run) {
  const FaultWords words = WordsOf(fault, UnitsOf(run.poses));
  const std::string treated = fault.is_trusted() ? "; corrected"
                              : fault.is_corrected
                                  ? "; corrected, and σ are widened by its whole effect"
                                  : "; not corrected, but σ are widened by its whole effect";
  Finding finding(FindingCode::kFault, words.Statement() + treated, RemedyOf(fault, words.remedy));
  finding.About(fault.place.triad)
      .Shifting(fault.shift_sigmas,
                fault.is_trusted() ? Treatment::kCorrected : Treatment::kWidened)
      .With("p_value", std::exp(fault.log_p));
  if (fault.place.first_pose > 0) finding.AtPose(fault.place.first_pose);
  if (fault.shift_sigmas < 1.0) finding.As(Severity::kNote);
  const std::optional<double>& most = run.options.strict_shift_sigmas;
  const bool is_beyond = most && fault.shift_sigmas > *most;
  if (is_beyond) finding.remedy = "record again; `strict` refuses corrections this large";
  // A fault in a tied matrix is refused, unless rejecting some readings explains the others, too.
  const bool is_alone = fault.left_out_instead.empty();
  if (is_beyond || (is_alone && IsTied(fault, run.graph.layout))) {
    finding.As(Severity::kRefusal).treatment = Treatment::kNone;
  }
  return finding;
}

Finding FindingOf(const LostRowsFound& lost) {
  return Finding(FindingCode::kFault,
                 WordsOf(lost) + "; σ allow for it",
                 "record again, without gaps in the log")
      .About(Triad::kGyroscope)
      .With("share", lost.share)
      .With("p_value", std::exp(lost.log_p));
}

std::string TermOf(const FaultKind& kind) {
  return std::string(kind.parameter ? InfoOf(*kind.parameter).name : kind.name);
}

// The finding if two faults show that two recordings were joined: gains or mountings of two sensors
// change together only if the unit is exchanged. The positions of the two faults may differ by one
// pose.
std::optional<Finding> JoinedOf(const std::vector<TakenFault>& faults) {
  const auto is_of_unit = [](const TakenFault& fault) {
    const FaultKind& kind = *fault.place.kind;
    return kind.shape == FaultShape::kStep &&
           (kind.varies == Varies::kGain || kind.varies == Varies::kMounting);
  };
  for (const TakenFault& a : faults) {
    for (const TakenFault& b : faults) {
      const bool is_pair = is_of_unit(a) && is_of_unit(b) && a.place.triad < b.place.triad;
      if (!is_pair || std::abs(a.place.first_pose - b.place.first_pose) > 1) continue;
      const int pose = std::min(a.place.first_pose, b.place.first_pose);
      Finding finding(FindingCode::kJoinedRecording,
                      "the gains or axes of " + std::string(TriadName(a.place.triad)) + " and " +
                          std::string(TriadName(b.place.triad)) + " change at pose " +
                          std::to_string(pose) + ": these are readings of two units",
                      "calibrate each part by itself");
      finding.As(Severity::kRefusal).AtPose(pose);
      return finding;
    }
  }
  return std::nullopt;
}

// A fault is detected if it exceeds about this many of its own σ.
constexpr double kToldSigmas = 3.0;
// Error, in σ, up to which a result counts as right.
constexpr double kTrustedSigmas = 5.0;

// A sensor's nonlinearity stated by its data sheet, and its effect.
struct StatedBend {
  Triad triad = Triad::kAccelerometer;
  Nonlinearity nonlinearity;
  double widening = 1.0;  // largest factor by which it widens the σ of a parameter
};

// The finding that names nonlinearities which could shift a parameter by over kTrustedSigmas and
// still not be detected; unset if there are none.
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
  return Finding(
             FindingCode::kLinearityAssumed,
             "σ assume linear sensors: a nonlinearity just too small to be detected would shift a "
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

// `widening`: the largest factor by which the rounding widens the σ of a parameter.
Finding RoundingFinding(double widening) {
  const double sigmas = std::sqrt(std::max(widening * widening - 1.0, 0.0));
  Finding finding(
      FindingCode::kFault,
      "the gyroscope has a resolution coarser than its noise, so all its rests share a "
      "rounding error of up to half a step" +
          Format("; σ include this, which makes them up to %.2g times as large", widening),
      "log it with more digits, or set a smaller full-scale range");
  finding.About(Triad::kGyroscope).Shifting(sigmas, Treatment::kWidened);
  if (sigmas < 1.0) finding.As(Severity::kNote);
  return finding;
}

}  // namespace

Findings CheckFaultsAllow(const SettledRun& run, const SolvedRun& solved) {
  Findings findings;
  for (const TakenFault& fault : solved.unmodelled.faults.faults) {
    Finding finding = FindingOf(fault, run);
    if (finding.IsRefusal()) findings.push_back(std::move(finding));
  }
  if (auto joined = JoinedOf(solved.unmodelled.faults.faults)) {
    findings.push_back(*std::move(joined));
  }
  return findings;
}

Findings CheckFaults(const SettledRun& run, const SolvedRun& solved) {
  const FaultFindings& faults = solved.unmodelled.faults;
  Findings findings;
  for (const TakenFault& fault : faults.faults) {
    findings.push_back(FindingOf(fault, run));
  }
  if (faults.lost_rows) {
    findings.push_back(FindingOf(*faults.lost_rows));
  }
  if (faults.misfit.is_unexplained || faults.misfit.has_more_faults) {
    findings.push_back(Finding(FindingCode::kMisfit, WordsOf(faults.misfit))
                           .With("times", faults.misfit.excess_ratio));
  }
  for (const FaultNote& note : faults.notes) {
    if (!note.is_doubtful) continue;
    findings.push_back(Finding(FindingCode::kTermInDoubt, WordsOf(note))
                           .About(note.place.triad)
                           .With("p_value", std::exp(note.log_p)));
  }
  std::vector<StatedBend> stated;
  for (std::size_t i = 0; i < solved.unmodelled.stated_bends.size(); ++i) {
    const Triad triad = solved.unmodelled.stated_bends[i];
    stated.push_back({triad, *run.options.triads[triad].nonlinearity, faults.widening[i]});
  }
  if (const auto assumed = LinearityAssumed(TestsOf(faults), stated)) findings.push_back(*assumed);
  for (const StatedBend& bend : stated) findings.push_back(FindingOf(bend));
  if (solved.unmodelled.has_rounding) {
    findings.push_back(RoundingFinding(faults.widening[stated.size()]));
  }
  const Findings& of_readings = solved.unmodelled.of_recording.findings;
  findings.insert(findings.end(), of_readings.begin(), of_readings.end());
  return findings;
}

std::vector<LeftOutTest> TestsOf(const FaultFindings& faults) {
  std::vector<LeftOutTest> tests;
  for (const TakenFault& fault : faults.faults) {
    tests.push_back(
        {fault.place.triad, TermOf(*fault.place.kind), std::exp(fault.log_p), true, fault.kappa});
  }
  for (const FaultNote& note : faults.notes) {
    tests.push_back(
        {note.place.triad, TermOf(*note.place.kind), std::exp(note.log_p), false, note.kappa});
  }
  return tests;
}

}  // namespace truetriad
