// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "calibrate/calibrate_settled.h"
#include "config/field_check.h"
#include "data/clock_lags.h"
#include "model/mechanisms.h"
#include "session/steps.h"
#include "truetriad/base/result.h"
#include "truetriad/calibrate/calibrate.h"
#include "truetriad/io/calibration_file.h"
#include "verdict/checks/clock_offsets.h"
#include "verdict/checks/units.h"

namespace truetriad {
namespace {

// The first round subtracts a lag that is known to 0.05 s. Two more rounds subtract the offsets
// that the moves then show.
constexpr int kMostClockRounds = 3;

Result<Calibration> CalibratePoses(const LoadedPoses& loaded, const Experiment& experiment) {
  if (loaded.not_enough) {
    Calibration calibration = StatedCalibration(experiment.options);
    // If the unit of time is wrong, no rest is detected.
    const auto reason = WhyNotAsStated(loaded.poses, experiment.options);
    calibration.findings = {reason ? *reason : RefusalOf(*loaded.not_enough)};
    calibration.outcome = OutcomeOf(calibration.findings);
    calibration.config_yaml = experiment.resolved_yaml;
    return calibration;
  }
  Result<CalibrationSummary> summary = Calibrate(loaded.poses, experiment.options);
  if (!summary) return AtItsKey(experiment, summary.error());
  // If no model could be chosen, the key keeps `auto`, so that the next run chooses again.
  summary->calibration.config_yaml = summary->calibration.IsUsable()
                                         ? ResolvedWithChoice(experiment, summary->options)
                                         : experiment.resolved_yaml;
  return std::move(summary->calibration);
}

// A calibration, with the poses and the experiment (including time offsets) that it came from.
struct Attempt {
  Experiment experiment;
  LoadedPoses loaded;
  Calibration calibration;
};

Result<Attempt> CalibrateAsStated(Experiment experiment,
                                  std::optional<LoadedPoses>* first,
                                  const ProgressCallback& progress,
                                  const RecordingOpener& opener) {
  Attempt attempt;
  Result<LoadedPoses> read = LoadSessions(experiment, first, progress, opener);
  if (!read) return AtItsKey(experiment, read.error());
  attempt.loaded = *std::move(read);
  TRUETRIAD_RETURN_IF_ERROR(SettleWithRecording(&attempt.loaded, &experiment));
  TRUETRIAD_ASSIGN_OR_RETURN(attempt.calibration, CalibratePoses(attempt.loaded, experiment));
  attempt.experiment = std::move(experiment);
  return attempt;
}

// By how much a sensor's times are still later than those of the reference (ClockReference) after
// an offset was subtracted.
struct ClockLeft {
  double later_s = 0.0;
  double sigma_s = 0.0;
};
using Clocks = PerTriad<std::optional<ClockLeft>>;

// The clock offsets that a recording of rests and its calibration show. If a lag was subtracted
// (`taken_off`), which is known only to 0.05 s, any remaining offset counts. Otherwise only a
// notable offset counts.
Clocks ClocksLeft(const PoseSet& poses, const Calibration& calibration, const Clocks& taken_off) {
  Clocks left;
  for (const Triad triad : kTriads) {
    if (poses.clock_lag_s[triad]) left[triad] = {*poses.clock_lag_s[triad], kClockLagSigmaS};
  }
  for (const ClockOffset& offset : calibration.quality.rests.clock_offsets) {
    const std::optional<ClockLeft>& off = taken_off[offset.triad];
    const bool is_rough = off && off->sigma_s >= kClockLagSigmaS;
    if (!is_rough && !IsNotable(offset, poses)) continue;
    left[offset.triad] = {offset.later_s, offset.sigma_s};
  }
  return left;
}

// Adds a finding for each subtracted offset, relative to the clock of `reference`. The finding
// states the effect that the offset had; it is taken from `earlier`, the findings before the
// correction.
void SayClocksCorrected(const Clocks& taken_off,
                        const Findings& earlier,
                        Triad reference,
                        Calibration* calibration) {
  for (const Triad triad : kTriads) {
    if (!taken_off[triad]) continue;
    ClockLeft clock = *taken_off[triad];
    for (const ClockOffset& offset : calibration->quality.rests.clock_offsets) {
      if (offset.triad == triad) clock.sigma_s = offset.sigma_s;
    }
    Finding finding = ClockCorrected(triad, clock.later_s, clock.sigma_s, reference);
    const auto said = std::find_if(earlier.begin(), earlier.end(), [&](const Finding& other) {
      return other.code == FindingCode::kClockOffset && other.sensor == triad;
    });
    if (said != earlier.end()) {
      finding.Shifting(said->Value("effect").value_or(0.0), Treatment::kCorrected);
    }
    calibration->findings.push_back(std::move(finding));
  }
}

// Whether each remaining offset of `next` is at most half of that in `left`. If the calibration of
// `attempt` is usable, that of `next` must be usable as well.
bool IsNearer(const Attempt& next, const Clocks& left, const Attempt& attempt) {
  if (attempt.calibration.IsUsable() && !next.calibration.IsUsable()) return false;
  const auto left_now = ClocksLeft(next.loaded.poses, next.calibration, {});
  return std::all_of(kTriads.begin(), kTriads.end(), [&](Triad triad) {
    const double now_s = left_now[triad] ? std::abs(left_now[triad]->later_s) : 0.0;
    const double before_s = left[triad] ? std::abs(left[triad]->later_s) : 0.0;
    return now_s <= 0.5 * before_s;
  });
}

// Subtracts the clock offsets that the recording shows and calibrates again.
Result<Attempt> CalibrateWithClocks(const Experiment& stated,
                                    std::optional<LoadedPoses> first,
                                    const ProgressCallback& progress,
                                    const RecordingOpener& opener) {
  TRUETRIAD_ASSIGN_OR_RETURN(Attempt attempt, CalibrateAsStated(stated, &first, progress, opener));
  if (!stated.options.corrects_clocks) return attempt;
  Clocks taken_off;
  Findings said;
  for (int round = 0; round < kMostClockRounds; ++round) {
    const auto left = ClocksLeft(attempt.loaded.poses, attempt.calibration, taken_off);
    Clocks wanted = taken_off;
    PerTriad<double> offset_s = stated.poses.time_offset_s;
    for (const Triad triad : kTriads) {
      if (left[triad]) {
        wanted[triad] = {left[triad]->later_s + wanted[triad].value_or(ClockLeft()).later_s,
                         left[triad]->sigma_s};
      }
      if (wanted[triad]) offset_s[triad] += wanted[triad]->later_s;
    }
    if (std::none_of(left.begin(), left.end(), [](const auto& one) { return one.has_value(); })) {
      break;
    }
    Result<Attempt> next =
        CalibrateAsStated(WithTimeOffsets(stated, offset_s), &first, progress, opener);
    if (!next || !IsNearer(*next, left, attempt)) break;
    if (!Acts(Mechanism::kClockCorrection)) break;
    const Findings& found = attempt.calibration.findings;
    said.insert(said.end(), found.begin(), found.end());
    taken_off = wanted;
    attempt = *std::move(next);
  }
  for (const Triad triad : kTriads) {
    if (taken_off[triad]) taken_off[triad]->later_s += stated.poses.time_offset_s[triad];
  }
  SayClocksCorrected(taken_off, said, ClockReference(attempt.loaded.poses), &attempt.calibration);
  return attempt;
}

// Whether no key of the experiment states the kind of poses, and no key applies only to rests.
bool LeavesPosesOpen(const Experiment& experiment) {
  const PosesConfig& poses = experiment.poses;
  return !poses.given && poses.known_motions == KnownMotionsConfig() &&
         experiment.inputs.size() == 1 &&
         experiment.options.attitudes.kind == AttitudeKind::kNone &&
         experiment.forces_file.empty() && experiment.exclude_poses.empty() &&
         !experiment.options.initialise.only;
}

// One way to interpret a recording.
struct Way {
  PoseSelectionKind kind = PoseSelectionKind::kDetect;
  bool ignores_gyroscope = false;

  Experiment Of(const Experiment& stated) const {
    if (kind != PoseSelectionKind::kDetect) return WithPoses(stated, kind);
    Experiment experiment = stated;
    experiment.poses.ignores_gyroscope = ignores_gyroscope;
    return experiment;
  }
  std::string_view words() const {
    return kind == PoseSelectionKind::kMotion     ? "calibrated by its motion"
           : kind == PoseSelectionKind::kEveryRow ? "calibrated row by row"
           : ignores_gyroscope ? "calibrated from rests that are detected without the gyroscope"
                               : "calibrated from rests";
  }
  std::string remedy() const {
    return kind == PoseSelectionKind::kMotion     ? "state `poses: { motion: { spacing_s: 0.1 } }`"
           : kind == PoseSelectionKind::kEveryRow ? "state `poses: every_row`"
           : ignores_gyroscope                    ? "check the gyroscope"
                                                  : "state `poses: { detect: auto }`";
  }
};

// Whether the unit was tumbled: it moves half of the time or more and has fewer rests than faces.
bool LooksTumbled(const PoseSet& poses) {
  constexpr std::size_t kFaces = 6;  // Number of faces of a cube.
  return poses.poses.size() < kFaces && poses.static_share <= 0.5;
}

// The ways to try, in this order: rests; rests that are detected without the gyroscope, if it is
// recorded but not to be calibrated; motion, or each row if only a magnetometer is to be calibrated
// (rows of an accelerometer contain the forces of the hand). If the unit looks tumbled, the last
// way comes first.
std::vector<Way> WaysFor(const Experiment& experiment, const LoadedPoses& loaded) {
  std::vector<Way> ways = {{}};
  if (!loaded.are_detected || !loaded.poses.has_time) return ways;
  const auto has = [&](Triad triad) { return experiment.options.triads[triad].enabled; };
  const bool has_gyroscope = has(Triad::kGyroscope), has_magnetometer = has(Triad::kMagnetometer);
  const bool has_accelerometer = has(Triad::kAccelerometer);
  if (!has_gyroscope && loaded.poses.Find(Triad::kGyroscope) != nullptr) {
    ways.push_back({.ignores_gyroscope = true});
  }
  if (has_gyroscope && (has_accelerometer || has_magnetometer)) {
    ways.push_back({.kind = PoseSelectionKind::kMotion});
  } else if (!has_gyroscope && !has_accelerometer && has_magnetometer) {
    ways.push_back({.kind = PoseSelectionKind::kEveryRow});
  }
  const bool may_lack_rests = ways.back().kind != PoseSelectionKind::kDetect;
  if (may_lack_rests && LooksTumbled(loaded.poses)) std::ranges::rotate(ways, ways.end() - 1);
  return ways;
}

// The finding that makes a calibration unusable or poorly known; null if there is none.
const Finding* WhatIsLacking(const Calibration& calibration) {
  const Finding* const refusal = FirstRefusal(calibration.findings);
  return refusal != nullptr ? refusal : Find(calibration.findings, FindingCode::kPoorlyKnown);
}

// Whether the refusal is due to too few or too similar rests. Refusals for other reasons would
// remain if the recording were interpreted in another way.
bool LacksRests(const Findings& findings) {
  constexpr std::array kCodes = {FindingCode::kNoRest,
                                 FindingCode::kTurnsUnexplained,
                                 FindingCode::kTooFewPoses,
                                 FindingCode::kTooFewDirections,
                                 FindingCode::kNotAnEllipsoid,
                                 FindingCode::kTurnAxesMissing,
                                 FindingCode::kNotDetermined};
  const Finding* const why = FirstRefusal(findings);
  return why != nullptr && std::ranges::find(kCodes, why->code) != kCodes.end();
}

// If the kind of poses is not stated, calibrates in the likeliest way. If this does not determine
// the wanted parameters, tries the other ways and takes the first that does.
Result<Attempt> CalibrateByEvidence(const Experiment& stated,
                                    std::optional<LoadedPoses> first,
                                    const ProgressCallback& progress,
                                    const RecordingOpener& opener) {
  if (!LeavesPosesOpen(stated)) {
    return CalibrateWithClocks(stated, std::move(first), progress, opener);
  }
  Result<LoadedPoses> looked = LoadSessions(stated, &first, progress, opener);
  if (!looked) {
    // If the gyroscope is stuck but not to be calibrated, rests are detected without it.
    const bool asks = stated.options.triads[Triad::kGyroscope].enabled;
    if (asks || looked.error().code != ErrorCode::kStuckSensor) {
      return AtItsKey(stated, looked.error());
    }
    const Way without{.ignores_gyroscope = true};
    return CalibrateWithClocks(without.Of(stated), std::nullopt, progress, opener);
  }
  const std::vector<Way> ways = WaysFor(stated, *looked);
  const auto by = [&](const Way& way) {
    const bool is_as_looked = way.kind == PoseSelectionKind::kDetect && !way.ignores_gyroscope;
    return CalibrateWithClocks(way.Of(stated),
                               is_as_looked ? std::optional(*std::move(looked)) : std::nullopt,
                               progress,
                               opener);
  };
  const bool is_tumbled = ways.front().kind != PoseSelectionKind::kDetect;
  TRUETRIAD_ASSIGN_OR_RETURN(Attempt likeliest, by(ways.front()));
  if (is_tumbled ? likeliest.calibration.IsUsable() : !LacksRests(likeliest.calibration.findings)) {
    return likeliest;
  }
  const auto why = std::ranges::find_if(likeliest.calibration.findings, &Finding::IsRefusal);
  for (const Way& way : std::span(ways).subspan(1)) {
    Result<Attempt> other = by(way);
    if (!other) continue;
    const Finding* const why_not = WhatIsLacking(other->calibration);
    if (why_not != nullptr) {
      why->text += "; if " + std::string(way.words()) + ", the recording gives no result either (" +
                   why_not->text + ")";
      if (why_not->remedy != why->remedy) why->remedy += "; or " + why_not->remedy;
      continue;
    }
    if (!Acts(Mechanism::kOtherWay)) break;
    other->calibration.findings.emplace_back(
        FindingCode::kFollowedMotion,
        "the recording was " + std::string(way.words()) +
            ", since it gives no result otherwise: " + why->text,
        way.remedy());
    return other;
  }
  return likeliest;
}

}  // namespace

Result<Calibration> CalibrateExperiment(Experiment stated,
                                        const ProgressCallback& progress,
                                        std::optional<LoadedPoses> first,
                                        PoseSet* poses,
                                        const RecordingOpener& opener,
                                        std::vector<SensorReadings>* readings) {
  TRUETRIAD_ASSIGN_OR_RETURN(Attempt attempt,
                             CalibrateByEvidence(stated, std::move(first), progress, opener));
  auto& [experiment, loaded, calibration] = attempt;
  calibration.serial = experiment.serial.empty() ? loaded.poses.serial : experiment.serial;
  calibration.model = experiment.model;
  calibration.tags = OrElse(experiment.tags, loaded.poses.tags);
  calibration.software_version = Version();
  calibration.created = TimestampUtc();
  calibration.inputs = std::move(loaded.inputs);
  CheckField(experiment, &calibration);
  // The calibration already contains the refusals of calibrated sensors. Refusals of other sensors
  // do not concern it.
  std::copy_if(loaded.poses.findings.begin(),
               loaded.poses.findings.end(),
               std::back_inserter(calibration.findings),
               [](const Finding& finding) { return !finding.IsRefusal(); });
  for (const Triad triad : kTriads) {
    if (std::optional<TriadCalibration>& sensor = calibration.sensors[triad]) {
      sensor->si_per_count = loaded.si_per_count[triad];
    }
  }
  if (poses != nullptr) *poses = std::move(loaded.poses);
  if (readings != nullptr) *readings = std::move(loaded.readings);
  return calibration;
}

}  // namespace truetriad
