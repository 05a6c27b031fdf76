// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>

#include "base/messages.h"
#include "data/pose_statistics.h"
#include "verdict/checks/check.h"

namespace truetriad {
namespace {

// Chosen: if the temperature changes by more, degC, the mean of a pose spans several temperatures.
constexpr double kMostChangeDegc = 3.0;
// Chosen: if a larger share of the recorded range, at one of its ends, has no rest, it is reported.
constexpr double kMostMissedShare = 0.1;

struct PoseTemperatures {
  Eigen::Vector2d range{std::numeric_limits<double>::infinity(),
                        -std::numeric_limits<double>::infinity()};
  int changing = 0;      // number of poses with too large a change
  double largest = 0.0;  // largest change within a pose, degC
  int worst = 0;         // number of that pose
};

PoseTemperatures TemperaturesOf(const PoseSet& poses) {
  PoseTemperatures seen;
  for (const StaticPose& pose : poses.poses) {
    if (!pose.temperature_degc) continue;
    seen.range[0] = std::min(seen.range[0], *pose.temperature_degc);
    seen.range[1] = std::max(seen.range[1], *pose.temperature_degc);
    const double change = std::abs(pose.temperature_rate_degcps) * pose.duration_s();
    if (change > kMostChangeDegc) ++seen.changing;
    if (change > seen.largest) {
      seen.largest = change;
      seen.worst = pose.number;
    }
  }
  return seen;
}

// Findings about what makes temperature terms less reliable.
Findings CheckTerms(const SettledRun& run) {
  Findings findings;
  const PoseTemperatures seen = TemperaturesOf(run.poses);
  const Eigen::Vector2d& range = seen.range;
  if (seen.changing > 0) {
    findings.push_back(
        Finding(FindingCode::kTemperatureWithinPoses,
                Format("the temperature changed by more than %.0f degC within ", kMostChangeDegc) +
                    Counted(seen.changing, "pose") + ", most in pose " +
                    std::to_string(seen.worst) +
                    Format(" (%.1f degC): their means span several temperatures", seen.largest),
                "state the rests (`poses: { file: … }`), or wait longer before each pose")
            .AtPose(seen.worst)
            .With("poses", seen.changing)
            .With("largest", seen.largest, "degC"));
  }
  const double reference = run.options.reference.temperature_degc;
  if (reference < range[0] || reference > range[1]) {
    findings.push_back(
        Finding(
            FindingCode::kReferenceExtrapolated,
            Format("the reference temperature, %.1f degC, lies outside of the poses' ", reference) +
                Format("%.1f to ", range[0]) +
                Format("%.1f degC: bias and sensitivity at the reference are extrapolated",
                       range[1]))
            .With("reference", reference, "degC")
            .With("lowest", range[0], "degC")
            .With("highest", range[1], "degC"));
  }
  const Eigen::Vector2d& recorded = run.poses.temperature_range_degc.value_or(range);
  const double missed = std::max(range[0] - recorded[0], recorded[1] - range[1]);
  if (missed > kMostMissedShare * (recorded[1] - recorded[0])) {
    findings.push_back(Finding(FindingCode::kTemperatureEndsMissed,
                               Format("the recording reaches %.1f to ", recorded[0]) +
                                   Format("%.1f degC, its rests only ", recorded[1]) +
                                   Format("%.1f to ", range[0]) + Format("%.1f degC", range[1]),
                               "check for rests missed at the ends (`truetriad inspect`)")
                           .With("missed", missed, "degC"));
  }
  return findings;
}

}  // namespace

Findings CheckTemperatures(const SettledRun& run, const SolvedRun&) {
  if (run.options.HasThermal()) return CheckTerms(run);
  const auto recorded = RecordedDegc(run.poses);
  if (!recorded) return {};
  const std::string lowest = Format("%.1f", (*recorded)[0]);
  const std::string highest = Format("%.1f", (*recorded)[2]);
  std::string text = "recorded at " + (lowest == highest ? lowest : lowest + " to " + highest) +
                     " degC; no temperature terms were estimated";
  const double reference = run.options.reference.temperature_degc;
  const bool is_far = std::abs((*recorded)[1] - reference) > kMuchTemperatureDegc;
  if (is_far) {
    text += Format(
        ": bias and sensitivity hold at these temperatures, not at the reference of %.1f degC",
        reference);
  }
  return {Finding(FindingCode::kNoTemperatureTerms, std::move(text))
              .With("lowest", (*recorded)[0], "degC")
              .With("mean", (*recorded)[1], "degC")
              .With("highest", (*recorded)[2], "degC")};
}

// A curve with as many coefficients as temperatures passes through all of them.
Findings CheckCurves(const SettledRun&, const SolvedRun& solved) {
  Findings findings;
  for (const Triad triad : kTriads) {
    const auto& sensor = solved.stated.sensors[triad];
    if (!sensor || !sensor->thermal || sensor->thermal->bias.empty()) continue;
    const auto& settings = solved.stated.quality.rests.temperature_settings;
    const auto count = std::count_if(settings.begin(), settings.end(), [&](const auto& setting) {
      return setting.triad == triad;
    });
    if (count != static_cast<std::ptrdiff_t>(sensor->thermal->bias.size()) + 1) continue;
    findings.push_back(
        Finding(FindingCode::kCurveUnchecked,
                std::string(TriadName(triad)) + ": the bias curve passes through all " +
                    std::to_string(count) +
                    " temperatures: nothing checks it between them, and σ excludes interpolation "
                    "error",
                "add a temperature")
            .About(triad)
            .With("temperatures", static_cast<double>(count)));
  }
  return findings;
}

Findings CheckDrift(const SettledRun&, const SolvedRun& solved) {
  Findings findings;
  for (const Triad triad : kTriads) {
    const double sigma = solved.unmodelled.drift.sigma_raw[triad];
    if (sigma <= 0.0) continue;
    const std::string& unit = solved.stated.sensors[triad]->input_unit;
    findings.push_back(
        Finding(FindingCode::kBiasDrift,
                std::string(TriadName(triad)) +
                    Format(": the bias differs between temperatures by %.2g ", sigma) + unit +
                    " (1 σ) more than the temperature terms explain: the bias drifts, the order is "
                    "too low, or the curve has a knee; reported σ allow for a drift that is "
                    "independent at each temperature",
                "record a sweep with `knots`, which shows the cause")
            .About(triad)
            .With("drift", sigma, unit));
  }
  return findings;
}

}  // namespace truetriad
