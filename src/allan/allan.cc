// SPDX-License-Identifier: Apache-2.0
#include "truetriad/allan/allan.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "allan/allan_curve.h"
#include "allan/allan_fit.h"
#include "allan/allan_theory.h"
#include "allan/allan_watch.h"
#include "base/rounded_text.h"
#include "data/stream_checks.h"
#include "truetriad/base/triad.h"

namespace truetriad {
namespace {

/// The fewest samples of the longest stretch. The curve reaches up to a quarter of them, m = 25. It
/// then has 12 points, from which 5 noise strengths are fitted.
constexpr std::int64_t kFewestSamples = 100;

std::string Number(double value, int digits = 4) { return RoundedText(value, digits); }

Status CheckOptions(const RecordingInfo& info, const AllanOptions& options) {
  if (!(options.rate_hz >= 0.0) || !std::isfinite(options.rate_hz)) {
    return Error(ErrorCode::kInvalidArgument,
                 "a rate of " + Number(options.rate_hz) + " Hz; expected one above zero");
  }
  if (options.white_range_s) {
    const auto [low, high] = *options.white_range_s;
    if (!(low > 0.0 && low < high) || !std::isfinite(high)) {
      return Error(ErrorCode::kInvalidArgument,
                   "white noise over tau from " + Number(low) + " s to " + Number(high) +
                       " s; expected two numbers above zero, the smaller first");
    }
  }
  if (info.has_time && options.rate_hz > 0.0) {
    return Error(ErrorCode::kConflictingArguments,
                 {info.path},
                 "has its own times; remove the rate of " + Number(options.rate_hz) + " Hz");
  }
  if (!info.has_time && options.rate_hz == 0.0) {
    return Error(ErrorCode::kMissingArgument,
                 {info.path},
                 "has no time, so tau is unknown; give the rate (--rate_hz=100), or state "
                 "it in a manifest: `time: { unit: samples, rate_hz: 100 }`");
  }
  return {};
}

/// The analysis of one stream while it is read.
class StreamAnalysis {
 public:
  StreamAnalysis(const StreamInfo& info,
                 const RecordingInfo& recording,
                 const AllanOptions& options)
      : info_(info),
        options_(options),
        // If the recording has no times, its stamps are row numbers.
        ns_per_stamp_(recording.has_time ? 1.0 : 1e9 / options.rate_hz),
        monitor_(info, recording.has_time),
        even_([this](const EvenReadings& readings) { Take(readings); }, [this] { EndStretch(); }),
        curves_(3) {}
  StreamAnalysis(const StreamAnalysis&) = delete;
  StreamAnalysis& operator=(const StreamAnalysis&) = delete;

  Triad triad() const { return info_.triad; }

  Status Add(const SampleBlock& block) {
    TRUETRIAD_RETURN_IF_ERROR(monitor_.Add(block));
    even_.Add(block);
    return {};
  }

  Result<AllanTriad> Finish(const StreamCounts& counts);

 private:
  double SpacingSeconds() const { return even_.spacing_ns() * ns_per_stamp_ * 1e-9; }
  /// A time stamp of the stream, in seconds since its first sample, as text.
  std::string Seconds(std::int64_t stamp) const {
    return Number(static_cast<double>(stamp - monitor_.first_ns()) * ns_per_stamp_ * 1e-9, 6) +
           " s";
  }
  void Take(const EvenReadings& readings);
  void EndStretch() {
    for (AllanCurve& curve : curves_) curve.EndStretch();
    for (AxisWatch& watch : watches_) watch.Break();
    hold_.Break();
  }
  Status CheckCurves() const;
  Result<AllanAxis> Analyse(const AllanEstimates& estimates, std::size_t axis);
  Result<WhiteNoise> WhiteOverTheRangeGiven(const AllanEstimates& estimates) const;
  std::string Disturbance(const AllanTriad& result);
  void WarnOfStream(const AllanTriad& result);
  void WarnOfAxis(std::size_t axis);
  void DoubtFit(const AllanFit& fit, const AllanAxis& result, std::size_t axis);

  void Warn(const std::string& who, const std::string& what) {
    warnings_.push_back(who + ": " + what);
  }
  void Doubt(std::size_t axis, const std::string& what) {
    doubts_.push_back(Name(axis) + ": " + what);
  }
  std::string Name() const { return std::string(TriadName(info_.triad)); }
  std::string Name(std::size_t axis) const { return Name() + " " + AxisLetter(axis) + " axis"; }
  std::string Reading(double value, int digits = 4) const {
    return Number(value, digits) + " " + info_.unit.name;
  }

  StreamInfo info_;
  AllanOptions options_;
  double ns_per_stamp_;
  StreamMonitor monitor_;
  EvenStream even_;
  std::vector<AllanCurve> curves_;
  std::vector<AxisWatch> watches_;  ///< One per axis once the rate is known.
  HoldWatch hold_;
  std::array<bool, 3> is_described_{};  ///< Whether the fitted noises describe the axis' curve.
  std::vector<std::string> warnings_;
  std::vector<std::string> doubts_;  ///< Warnings about coefficients.
};

void StreamAnalysis::Take(const EvenReadings& readings) {
  if (watches_.empty()) {
    // A window lasts one second, which shows a knock as well as a slow turn, but has at least 32
    // samples: with fewer, the σ of a window's variance exceeds 25 % of the variance.
    const double spacing_ns = even_.typical_ns() * ns_per_stamp_;
    const double a_second = spacing_ns > 0.0 ? std::clamp(1e9 / spacing_ns, 32.0, 1e6) : 32.0;
    watches_.assign(3, AxisWatch(static_cast<std::size_t>(std::llround(a_second))));
  }
  hold_.Add(readings);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    curves_[axis].Add(readings.axes[axis]);
    watches_[axis].Add(readings.axes[axis], readings.end_ns);
  }
}

Status StreamAnalysis::CheckCurves() const {
  if (curves_[0].longest_stretch() < kFewestSamples) {
    return Error(ErrorCode::kNotEnoughData,
                 {info_.file},
                 "the longest part of the " + Name() + " without a gap has " +
                     std::to_string(curves_[0].longest_stretch()) +
                     " samples; an Allan deviation needs " + std::to_string(kFewestSamples) +
                     ", and about an hour at rest to be useful");
  }
  if (!(SpacingSeconds() > 0.0)) {
    return Error(ErrorCode::kTimeGoesBack,
                 {info_.file},
                 "all samples of the " + Name() + " have the same time; expected increasing times");
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (curves_[axis].variances().allFinite()) continue;
    return Error(ErrorCode::kValueOutOfRange,
                 {info_.file},
                 "the " + Name(axis) + " has readings too large to compute with; check its unit");
  }
  return {};
}

Result<AllanTriad> StreamAnalysis::Finish(const StreamCounts& counts) {
  even_.Finish();
  TRUETRIAD_ASSIGN_OR_RETURN(const StreamSummary summary, monitor_.Summary(counts));
  TRUETRIAD_RETURN_IF_ERROR(CheckCurves());

  AllanTriad result;
  result.triad = info_.triad;
  result.unit = info_.unit;
  result.si_per_count = info_.si_per_count;
  result.rate_hz = 1.0 / SpacingSeconds();
  result.samples = monitor_.samples();
  result.duration_s = ns_per_stamp_ == 1.0
                          ? static_cast<double>(monitor_.last_ns() - monitor_.first_ns()) * 1e-9
                          : static_cast<double>(result.samples) * SpacingSeconds();
  result.filled_samples = even_.filled();
  result.breaks = even_.breaks();
  for (const Finding& finding : monitor_.Check(summary)) warnings_.push_back(finding.Message());
  WarnOfStream(result);

  const std::vector<AllanFactor> factors = curves_[0].factors();
  const AllanCovariance covariance(factors);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    TRUETRIAD_ASSIGN_OR_RETURN(result.axes[axis],
                               Analyse({factors, covariance, curves_[axis].variances()}, axis));
    if (!result.axes[axis].points.empty()) WarnOfAxis(axis);
  }
  result.disturbance = Disturbance(result);
  if (result.at_rest()) {
    warnings_.insert(warnings_.end(), doubts_.begin(), doubts_.end());
  } else {
    for (AllanAxis& axis : result.axes) {
      AllanAxis curve;
      curve.points = std::move(axis.points);
      axis = std::move(curve);
    }
  }
  result.warnings = std::move(warnings_);
  return result;
}

void StreamAnalysis::WarnOfStream(const AllanTriad& result) {
  if (const std::optional<double> held = hold_.SamplesHeld()) {
    Warn(Name(),
         "each reading is held for " + Number(*held, 3) +
             " samples on average: the sensor updates at " + Number(result.rate_hz / *held) +
             " Hz, slower than the log; N is fitted at longer tau. The noise of one reading is N "
             "times the square root of the sensor's rate, not of the log's rate");
  }
  if (even_.irregular()) {
    Warn(Name(),
         "the time stamps are irregular; samples are assumed to be equally spaced, and missing "
         "ones are not filled");
  }
  // If at most 1 % of the samples were filled by interpolation, the curve does not show this.
  if (static_cast<double>(result.filled_samples) > 0.01 * static_cast<double>(result.samples)) {
    Warn(Name(),
         std::to_string(result.filled_samples) +
             " missing samples are interpolated, which lowers the noise at the shortest tau");
  }
  // The temperature of a heated room varies by less than five degrees.
  const Eigen::Vector2d range = monitor_.temperature_range_degc();
  if (monitor_.has_temperature() && range[1] - range[0] > 5.0) {
    Warn(Name(),
         "the temperature went from " + Number(range[0]) + " to " + Number(range[1]) +
             " degC; the bias follows the temperature, which looks like random walk at long tau: "
             "hold the temperature constant, or wait until the unit is warm");
  }
}

Result<AllanAxis> StreamAnalysis::Analyse(const AllanEstimates& estimates, std::size_t axis) {
  AllanAxis result;
  const AllanFit fit = FitNoises(estimates);
  if (fit.strengths.isZero(0.0)) return result;  // A dead axis; the monitor has warned of it.
  const double spacing_s = SpacingSeconds();
  // A negative quantisation describes the effect of a filter. It is set to zero here, since it does
  // not hold at factors shorter than the fitted ones.
  const NoiseStrengths strengths = fit.strengths.cwiseMax(0.0);
  for (Eigen::Index i = 0; i < estimates.variances.size(); ++i) {
    const double expected = strengths.dot(UnitAllanVariance(estimates.m(i)));
    const double freedoms = 2.0 * expected * expected / estimates.covariance.Variance(i, strengths);
    result.points.push_back(
        {.tau_s = estimates.m(i) * spacing_s,
         .deviation = Root(ChiSquareInterval(estimates.variances[i], freedoms), 1.0),
         .degrees_of_freedom = freedoms,
         .terms = estimates.factors[static_cast<std::size_t>(i)].terms});
  }

  WhiteNoise white;
  if (options_.white_range_s) {
    TRUETRIAD_ASSIGN_OR_RETURN(white, WhiteOverTheRangeGiven(estimates));
    result.white_range_s = options_.white_range_s;
  } else {
    white = FindWhite(estimates, fit);
    if (!white.range.is_empty()) {
      result.white_range_s = {estimates.m(white.range.begin) * spacing_s,
                              estimates.m(white.range.end - 1) * spacing_s};
    }
  }
  if (white.strength) result.white_density = Root(*white.strength, std::sqrt(spacing_s));
  const std::optional<Interval>&quantisation = fit.shown[kQuantisation], &walk = fit.shown[kWalk];
  if (quantisation) result.quantisation = Root(*quantisation, spacing_s);
  if (walk) result.random_walk = Root(*walk, 1.0 / std::sqrt(spacing_s));
  result.instability = Instability(result.points, !fit.shown[kFlicker] && !walk);
  is_described_[axis] = fit.follows();
  DoubtFit(fit, result, axis);
  return result;
}

Result<WhiteNoise> StreamAnalysis::WhiteOverTheRangeGiven(const AllanEstimates& estimates) const {
  const auto [low_s, high_s] = *options_.white_range_s;
  const double spacing_s = SpacingSeconds();
  // If a stated limit equals the tau of a point, the point is included despite rounding.
  const auto index = [&](double m) {
    return std::count_if(
        estimates.factors.begin(), estimates.factors.end(), [&](const AllanFactor& factor) {
          return static_cast<double>(factor.m) < m;
        });
  };
  const FactorRange range{index(low_s / spacing_s * (1.0 - 1e-6)),
                          index(high_s / spacing_s * (1.0 + 1e-6))};
  if (!range.is_empty()) return WhiteNoise{FitWhite(estimates, range), range};
  return Error(ErrorCode::kInvalidArgument,
               "white noise over tau from " + Number(low_s) + " s to " + Number(high_s) +
                   " s: the curve of the " + Name() + " has no points there; it covers " +
                   Number(estimates.m(0) * spacing_s) + " s to " +
                   Number(estimates.m(estimates.variances.size() - 1) * spacing_s) + " s");
}

void StreamAnalysis::DoubtFit(const AllanFit& fit, const AllanAxis& result, std::size_t axis) {
  const double spacing_s = SpacingSeconds();
  if (fit.follows() && fit.shown[kRamp]) {
    const double drift = std::sqrt(fit.shown[kRamp]->value) / spacing_s;
    Doubt(axis,
          "drifts steadily by about " + Reading(drift, 3) +
              " per second (a rate ramp, slope +1), " +
              Reading(static_cast<double>(monitor_.samples()) * spacing_s * drift, 3) +
              " over the log; the ramp is excluded from the coefficients, but may hide a lower B");
  }
  if (RisesFar(result)) {
    Doubt(axis,
          "at long tau the deviation rises far above that of single samples, which is unusual for "
          "noise at rest; check that the unit was still");
  }
  if (!fit.follows()) {
    Doubt(axis,
          "N, B, K and Q together do not fit the curve; the coefficients are inaccurate: check "
          "the plot");
  } else if (fit.is_late) {
    Doubt(axis,
          "N, B, K and Q fit the curve only from tau = " +
              Number(result.points[static_cast<std::size_t>(fit.range.begin)].tau_s) +
              " s; at shorter tau the curve shows a filter, a vibration or another cycle; check "
              "the plot before using N");
  } else if (fit.misfit > 1.0 && result.random_walk) {
    Doubt(axis,
          "the curve differs from the fit of N, B, K and Q by more than chance, as with a slow "
          "cycle; K is inaccurate: check the plot");
  }
}

std::string StreamAnalysis::Disturbance(const AllanTriad& result) {
  std::string jumping_axes, swaying_axes;
  AxisWatch::Verdict worst;
  bool shows = false;  // The disturbance is visible in the curve.
  for (std::size_t i = 0; i < 3; ++i) {
    if (result.axes[i].points.empty()) continue;
    const bool rises = RisesFar(result.axes[i]);
    const auto add = [&](std::string* axes) {
      *axes += (axes->empty() ? "" : ", ") + std::string(1, AxisLetter(i));
    };
    const AxisWatch::Verdict rest = watches_[i].Judge();
    if (rest.disturbed > 0) {
      add(&jumping_axes);
      // If at most one window in 200 is disturbed, the cause is a footstep in the house, not a move
      // of the unit.
      shows = shows || rises || 200 * rest.disturbed > rest.windows;
      if (rest.disturbed > worst.disturbed) worst = rest;
    }
    // If a unit is never still, its windows are all alike, but its curve rises. A random walk makes
    // the curve rise as well, but then the fit describes the curve.
    if (rises && !is_described_[i]) add(&swaying_axes);
  }
  if (!jumping_axes.empty()) {
    const std::string what = "the unit moved or was knocked, or its readings jumped (axes " +
                             jumping_axes + "): " + std::to_string(worst.disturbed) + " of " +
                             std::to_string(worst.windows) +
                             " windows have unusual noise or a step, the worst at " +
                             Seconds(worst.worst_ns) + "; cut these parts out, or record again";
    if (shows) return what;
    Warn(Name(), what);
  }
  if (swaying_axes.empty()) return "";
  return "at long tau the deviation rises far above that of single samples, unlike noise (axes " +
         swaying_axes + "): the unit moved, or its readings drift; record again at rest";
}

void StreamAnalysis::WarnOfAxis(std::size_t axis) {
  const AxisWatch::Verdict seen = watches_[axis].Judge();
  const double step = monitor_.resolution_raw()[static_cast<Eigen::Index>(axis)];
  if (step > 0.0 && seen.sigma < 0.5 * step) {
    Warn(Name(axis),
         "the noise of " + Reading(seen.sigma) + " is below the resolution of " + Reading(step) +
             "; at short tau the curve shows rounding, not noise");
  }
  // If the noise is as large as the resolution, all 32 readings of the shortest window are equal by
  // chance only once in 10^13.
  if (seen.constant > 0 && seen.sigma > step) {
    Warn(Name(axis),
         std::to_string(seen.constant) + " of " + std::to_string(seen.windows) +
             " windows are constant, the first at " + Seconds(seen.constant_ns) +
             ": the sensor froze, or lost samples were repeated; N is too low and K is wrong: "
             "cut these parts out");
  }
  // If normal noise is clipped at 2.6 sigma, 0.5 % of the readings are at the limit. Noise that is
  // only rounded reaches its extreme value a few times in any log.
  if (seen.sigma > 2.0 * step && seen.at_extreme >= 5 &&
      200 * seen.at_extreme > monitor_.samples()) {
    Warn(Name(axis),
         std::to_string(seen.at_extreme) + " readings have the extreme value, " +
             Reading(seen.extreme, 9) + "; check for clipping");
  }
}

}  // namespace

Result<AllanResult> AnalyseAllan(SampleSource& source,
                                 const AllanOptions& options,
                                 const ProgressCallback& progress) {
  const RecordingInfo& info = source.info();
  TRUETRIAD_RETURN_IF_ERROR(CheckOptions(info, options));
  PerTriad<std::unique_ptr<StreamAnalysis>> analyses;
  for (const StreamInfo& stream : info.streams) {
    analyses[stream.triad] = std::make_unique<StreamAnalysis>(stream, info, options);
  }
  std::vector<SampleBlock> blocks;
  for (;;) {
    TRUETRIAD_ASSIGN_OR_RETURN(const bool more, source.Next(&blocks));
    if (!more) break;
    for (const SampleBlock& block : blocks) {
      TRUETRIAD_RETURN_IF_ERROR(analyses[block.triad]->Add(block));
    }
    if (progress) progress(source.progress());
  }

  AllanResult result;
  result.source = info.path;
  result.serial = info.serial;
  result.tags = info.tags;
  result.inputs = source.inputs();
  for (const auto& analysis : analyses) {
    if (analysis == nullptr) continue;
    TRUETRIAD_ASSIGN_OR_RETURN(AllanTriad triad,
                               analysis->Finish(source.counts(analysis->triad())));
    result.triads.push_back(std::move(triad));
  }
  return result;
}

}  // namespace truetriad
