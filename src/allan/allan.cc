// SPDX-License-Identifier: Apache-2.0
#include "truetriad/allan/allan.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <utility>

#include "allan/allan_curve.h"
#include "allan/allan_fit.h"
#include "allan/allan_hold.h"
#include "allan/allan_rest.h"
#include "allan/allan_spacing.h"
#include "allan/allan_theory.h"
#include "base/rounded_text.h"
#include "data/stream_checks.h"
#include "truetriad/base/triad.h"

namespace truetriad {
namespace {

/// In the longest stretch.
constexpr std::int64_t kFewestSamples = 100;
// Chosen: a heated room stays within it.
constexpr double kWidestTemperatureDegc = 5.0;
/// Share of the samples that may be filled in before it shows in the curve.
constexpr double kMostFilledShare = 0.01;
// Share of the readings: normal noise cut at 2.6 sigma puts as many on the limit.
constexpr double kMostAtLimit = 0.005;
/// Noise that is rounded reads its furthest value a few times in any log.
constexpr std::int64_t kFewestAtLimit = 5;
/// Share of the windows that may be disturbed in a log at rest: a step in the house, not a move.
constexpr double kMostDisturbed = 0.005;
/// A fit that starts later says little about white noise; so late it can be neither filter nor
/// rounding.
constexpr std::int64_t kLatestFit = 100;

std::string Number(double value, int digits = 4) { return RoundedText(value, digits); }

Status CheckOptions(const RecordingInfo& info, const AllanOptions& options) {
  if (!(options.rate_hz >= 0.0) || !std::isfinite(options.rate_hz)) {
    return Error(ErrorCode::kInvalidArgument,
                 "a rate of " + Number(options.rate_hz) + " Hz; expected one above zero");
  }
  if (options.points_per_decade < 1 || options.points_per_decade > 100) {
    return Error(
        ErrorCode::kInvalidArgument,
        std::to_string(options.points_per_decade) + " points per decade; expected 1 to 100");
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

/// What one stream leaves behind as it passes.
class StreamAnalysis {
 public:
  StreamAnalysis(const StreamInfo& info,
                 const RecordingInfo& recording,
                 const AllanOptions& options)
      : info_(info),
        options_(options),
        has_time_(recording.has_time),
        monitor_(info, recording.has_time),
        stream_([this](const SpacedStream::Readings& readings,
                       std::int64_t start_ns) { Take(readings, start_ns); },
                [this] { EndStretch(); }) {
    for (int axis = 0; axis < 3; ++axis) curves_.emplace_back(options.points_per_decade);
  }
  StreamAnalysis(const StreamAnalysis&) = delete;
  StreamAnalysis& operator=(const StreamAnalysis&) = delete;

  Triad triad() const { return info_.triad; }

  Status Add(const SampleBlock& block) {
    TRUETRIAD_RETURN_IF_ERROR(monitor_.Add(block));
    stream_.Add(block);
    return {};
  }

  Result<AllanTriad> Finish(const StreamCounts& counts);

 private:
  double SpacingSeconds() const {
    return has_time_ ? stream_.spacing_ns() * 1e-9 : 1.0 / options_.rate_hz;
  }
  void Take(const SpacedStream::Readings& readings, std::int64_t start_ns);
  void EndStretch() {
    for (AllanCurve& curve : curves_) curve.EndStretch();
    for (RestWatch& watch : rests_) watch.Break();
    for (FreezeWatch& watch : freezes_) watch.Break();
    hold_.Break();
  }
  Status CheckCurves() const;
  Result<AllanAxis> Analyse(const Eigen::VectorXd& variances,
                            const std::vector<AllanFactor>& factors,
                            const AllanCovariance& covariance,
                            int axis,
                            std::vector<std::string>* warnings);
  Status FitDensity(const Eigen::VectorXd& variances,
                    const std::vector<AllanFactor>& factors,
                    const AllanCovariance& covariance,
                    const AllanFit& fit,
                    AllanAxis* result) const;
  std::string Disturbance(const AllanTriad& result, std::vector<std::string>* warnings) const;
  void WarnOfAxis(int axis, const AllanAxis& result, std::vector<std::string>* warnings) const;
  std::string Name() const { return std::string(TriadName(info_.triad)); }
  std::string Name(int axis) const { return Name() + " " + AxisLetter(axis) + " axis"; }

  StreamInfo info_;
  AllanOptions options_;
  bool has_time_;
  StreamMonitor monitor_;
  SpacedStream stream_;
  std::vector<AllanCurve> curves_;
  std::vector<RestWatch> rests_;  // One an axis once the rate is known.
  std::array<FreezeWatch, 3> freezes_;
  HoldWatch hold_;
  std::array<LimitWatch, 3> limits_;
  std::array<bool, 3> described_{};  // By the four noises.
};

void StreamAnalysis::Take(const SpacedStream::Readings& readings, std::int64_t start_ns) {
  const double to_ns = has_time_ ? 1.0 : 1e9 / options_.rate_hz;  // Without time they are rows.
  const double spacing_ns = stream_.typical_ns() * to_ns;
  if (rests_.empty()) {
    // A second shows a knock as well as a slow turn; fewer samples do not tell noise from noise.
    const double a_second = spacing_ns > 0.0 ? std::clamp(1e9 / spacing_ns, 32.0, 1e6) : 32.0;
    rests_.assign(3, RestWatch(std::llround(a_second)));
  }
  const std::int64_t at_ns =
      std::llround(static_cast<double>(start_ns - monitor_.first_ns()) * to_ns);
  hold_.Add(readings);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    curves_[axis].Add(readings[axis]);
    rests_[axis].Add(readings[axis], at_ns, spacing_ns);
    freezes_[axis].Add(readings[axis], at_ns, spacing_ns);
    limits_[axis].Add(readings[axis]);
  }
}

Status StreamAnalysis::CheckCurves() const {
  const std::vector<AllanFactor> factors = curves_[0].factors();
  if (curves_[0].longest_stretch() < kFewestSamples) {
    return Error(ErrorCode::kNotEnoughData,
                 {info_.file},
                 "the longest stretch of the " + Name() + " without a gap has " +
                     std::to_string(curves_[0].longest_stretch()) +
                     " samples; an Allan deviation needs " + std::to_string(kFewestSamples) +
                     ", and about an hour at rest to be useful");
  }
  if (!(SpacingSeconds() > 0.0)) {
    return Error(ErrorCode::kTimeGoesBack,
                 {info_.file},
                 "all samples of the " + Name() + " have the same time; expected increasing times");
  }
  for (int axis = 0; axis < 3; ++axis) {
    if (!curves_[static_cast<std::size_t>(axis)].variances().allFinite()) {
      return Error(ErrorCode::kValueOutOfRange,
                   {info_.file},
                   "the " + Name(axis) + " has readings too large to compute with; check its unit");
    }
  }
  return {};
}

Result<AllanTriad> StreamAnalysis::Finish(const StreamCounts& counts) {
  stream_.Finish();
  TRUETRIAD_ASSIGN_OR_RETURN(const StreamSummary summary, monitor_.Summary(counts));
  TRUETRIAD_RETURN_IF_ERROR(CheckCurves());

  AllanTriad result;
  result.triad = info_.triad;
  result.unit = info_.unit;
  result.si_per_count = info_.si_per_count;
  result.rate_hz = 1.0 / SpacingSeconds();
  result.samples = monitor_.samples();
  result.duration_s = has_time_
                          ? static_cast<double>(monitor_.last_ns() - monitor_.first_ns()) * 1e-9
                          : static_cast<double>(result.samples) * SpacingSeconds();
  result.filled_samples = stream_.filled();
  result.breaks = stream_.breaks();
  for (const Finding& finding : monitor_.Check(summary))
    result.warnings.push_back(finding.Message());
  if (const std::optional<double> held = hold_.SamplesHeld()) {
    result.warnings.push_back(Name() + ": each reading is held for " + Number(*held, 3) +
                              " samples on average: the sensor updates at " +
                              Number(result.rate_hz / *held) +
                              " Hz, slower than the log; N is fitted at longer tau, and the noise "
                              "of one sample is N times the square root of the log's rate");
  }
  if (stream_.irregular()) {
    result.warnings.push_back(Name() +
                              ": the time stamps are irregular; samples are assumed to be equally "
                              "spaced, and missing ones are not filled");
  }
  if (static_cast<double>(result.filled_samples) >
      kMostFilledShare * static_cast<double>(result.samples)) {
    result.warnings.push_back(
        Name() + ": " + std::to_string(result.filled_samples) +
        " missing samples are interpolated, which lowers the noise at the shortest tau");
  }
  if (monitor_.has_temperature()) {
    const Eigen::Vector2d range = monitor_.temperature_range_degc();
    if (range[1] - range[0] > kWidestTemperatureDegc) {
      result.warnings.push_back(
          Name() + ": the temperature went from " + Number(range[0]) + " to " + Number(range[1]) +
          " degC; the bias follows it, which looks like random walk at long tau: hold the "
          "temperature constant, or wait until the unit is warm");
    }
  }

  const std::vector<AllanFactor> factors = curves_[0].factors();
  const AllanCovariance covariance(factors);
  std::vector<std::string> doubts;  // About coefficients.
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    TRUETRIAD_ASSIGN_OR_RETURN(AllanAxis analysed,
                               Analyse(curves_[i].variances(), factors, covariance, axis, &doubts));
    result.axes[i] = std::move(analysed);
    WarnOfAxis(axis, result.axes[i], &result.warnings);
  }
  result.disturbance = Disturbance(result, &result.warnings);
  if (result.at_rest()) {
    result.warnings.insert(result.warnings.end(), doubts.begin(), doubts.end());
  } else {
    for (AllanAxis& axis : result.axes) {
      AllanAxis curve;
      curve.points = std::move(axis.points);
      axis = std::move(curve);
    }
  }
  return result;
}

bool LateFit(const std::vector<AllanFactor>& factors, const AllanFit& fit) {
  return factors[static_cast<std::size_t>(fit.range.begin)].m > kLatestFit;
}

Result<AllanAxis> StreamAnalysis::Analyse(const Eigen::VectorXd& variances,
                                          const std::vector<AllanFactor>& factors,
                                          const AllanCovariance& covariance,
                                          int axis,
                                          std::vector<std::string>* warnings) {
  AllanAxis result;
  const AllanFit fit = FitNoises(factors, variances, covariance);
  if (fit.strengths.isZero(0.0)) return result;  // A dead axis; the monitor has warned of it.
  const double spacing_s = SpacingSeconds();
  // A filter's share is not that of the factors before the fit.
  const NoiseStrengths strengths = fit.strengths.cwiseMax(0.0);
  for (std::size_t i = 0; i < factors.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    const auto m = static_cast<double>(factors[i].m);
    const double expected = strengths.dot(UnitAllanVariance(m));
    AllanPoint point;
    point.tau_s = m * spacing_s;
    point.terms = factors[i].terms;
    point.degrees_of_freedom = 2.0 * expected * expected / covariance.Variance(row, strengths);
    point.deviation = Root(ChiSquareInterval(variances[row], point.degrees_of_freedom), 1.0);
    result.points.push_back(point);
  }

  const auto& [quantisation, white, flicker, walk, ramp] = fit.shown;
  TRUETRIAD_RETURN_IF_ERROR(FitDensity(variances, factors, covariance, fit, &result));
  if (quantisation) result.quantisation = Root(*quantisation, spacing_s);
  if (walk) result.random_walk = Root(*walk, 1.0 / std::sqrt(spacing_s));
  result.instability = Instability(result.points, !flicker && !walk);
  described_[static_cast<std::size_t>(axis)] = fit.follows;
  if (fit.follows && ramp) {
    const double drift = std::sqrt(ramp->value) / spacing_s;
    warnings->push_back(
        Name(axis) + ": drifts steadily by about " + Number(drift, 3) + " " + info_.unit.name +
        " per second (a rate ramp, slope +1), " +
        Number(static_cast<double>(monitor_.samples()) * spacing_s * drift, 3) + " " +
        info_.unit.name +
        " over the log; it is excluded from the coefficients, but limits how low B can be");
  }
  if (RisesFar(result)) {
    warnings->push_back(Name(axis) +
                        ": the deviation rises far above that of single samples, which is unusual "
                        "for noise at rest; check that the unit was still");
  }
  if (!fit.follows) {
    warnings->push_back(Name(axis) +
                        ": N, B, K and Q together do not fit the curve; the coefficients are "
                        "rough, check the plot");
  } else if (LateFit(factors, fit)) {
    warnings->push_back(Name(axis) + ": N, B, K and Q fit the curve only from tau = " +
                        Number(result.points[static_cast<std::size_t>(fit.range.begin)].tau_s) +
                        " s; at shorter tau there is a filter, a vibration or another cycle; check "
                        "the plot before using N");
  } else if (fit.misfit > 1.0 && walk) {
    warnings->push_back(Name(axis) +
                        ": the fit of N, B, K and Q is worse than chance, typical of a slow cycle; "
                        "K is rough, check the plot");
  }
  return result;
}

Status StreamAnalysis::FitDensity(const Eigen::VectorXd& variances,
                                  const std::vector<AllanFactor>& factors,
                                  const AllanCovariance& covariance,
                                  const AllanFit& fit,
                                  AllanAxis* result) const {
  const double spacing_s = SpacingSeconds();
  std::optional<Interval> strength = fit.shown[static_cast<std::size_t>(NoiseTerm::kWhite)];
  if (options_.white_range_s) {
    // Limits that are meant as a point of the curve do not miss it by rounding.
    const double low = options_.white_range_s->front() / spacing_s * (1.0 - 1e-6);
    const double high = options_.white_range_s->back() / spacing_s * (1.0 + 1e-6);
    const auto index = [&](double m) {
      return std::count_if(factors.begin(), factors.end(), [&](const AllanFactor& factor) {
        return static_cast<double>(factor.m) < m;
      });
    };
    const Eigen::Index begin = index(low);
    const Eigen::Index end = index(high);
    if (begin == end) {
      return Error(ErrorCode::kInvalidArgument,
                   "white noise over tau from " + Number(options_.white_range_s->front()) +
                       " s to " + Number(options_.white_range_s->back()) + " s: the curve of the " +
                       Name() + " has no points there; it covers " +
                       Number(result->points.front().tau_s) + " s to " +
                       Number(result->points.back().tau_s) + " s");
    }
    strength = FitWhite(factors, variances, covariance, {begin, end});
    result->white_range_s = options_.white_range_s;
  } else {
    const auto set_range = [&](const FactorRange& range) {
      if (range.begin == range.end) return;
      result->white_range_s = {result->points[static_cast<std::size_t>(range.begin)].tau_s,
                               result->points[static_cast<std::size_t>(range.end - 1)].tau_s};
    };
    AllanFit used = fit;
    if (!fit.by_chance || LateFit(factors, fit)) {
      used = FitWidestWhite(factors, variances, covariance, fit);
    }
    strength = used.shown[static_cast<std::size_t>(NoiseTerm::kWhite)];
    const bool is_white_known = used.by_chance || (used.follows && !LateFit(factors, used));
    if (!strength || !is_white_known) {
      const FactorRange part = WhitePart(factors, variances);
      if (part.begin < part.end) {
        strength = FitWhite(factors, variances, covariance, part);
        set_range(part);
      }
    } else {
      set_range(WhiteRange(factors, used));
    }
  }
  if (strength) {
    result->white_density = Root(*strength, std::sqrt(spacing_s));
    result->white_sigma_sample = result->white_density->value / std::sqrt(spacing_s);
  }
  return {};
}

std::string StreamAnalysis::Disturbance(const AllanTriad& result,
                                        std::vector<std::string>* warnings) const {
  std::string jumping_axes, swaying_axes;
  RestWatch::Verdict worst;
  bool shows = false;  // In the curve.
  const auto add = [](std::size_t axis, std::string* axes) {
    *axes += (axes->empty() ? "" : ", ") + std::string(1, AxisLetter(axis));
  };
  for (std::size_t i = 0; i < 3; ++i) {
    if (result.axes[i].points.empty()) continue;
    const RestWatch::Verdict rest = rests_[i].Judge();
    if (rest.disturbed > 0) {
      add(i, &jumping_axes);
      shows =
          shows || RisesFar(result.axes[i]) ||
          static_cast<double>(rest.disturbed) > kMostDisturbed * static_cast<double>(rest.windows);
      if (rest.disturbed > worst.disturbed) worst = rest;
    }
    // A unit that is never still has windows that are all alike; a random walk rises as well, but
    // is described.
    if (RisesFar(result.axes[i]) && !described_[i]) add(i, &swaying_axes);
  }
  if (!jumping_axes.empty()) {
    const std::string what = "the unit moved or was knocked, or its readings jumped (axes " +
                             jumping_axes + "): " + std::to_string(worst.disturbed) + " of " +
                             std::to_string(worst.windows) +
                             " windows are outliers, the worst at " +
                             Number(static_cast<double>(worst.worst_ns) * 1e-9, 6) +
                             " s; cut these parts out, or record again";
    if (shows) return what;
    warnings->push_back(Name() + ": " + what);
  }
  if (swaying_axes.empty()) return "";
  return "the deviation rises far above that of single samples, unlike noise (axes " +
         swaying_axes + "): the unit moved, or something drifts; record again at rest";
}

void StreamAnalysis::WarnOfAxis(int axis,
                                const AllanAxis& result,
                                std::vector<std::string>* warnings) const {
  if (result.points.empty()) return;
  const auto i = static_cast<std::size_t>(axis);
  const double sigma = rests_[i].Judge().sigma;
  const double step = monitor_.resolution_raw()[axis];
  if (step > 0.0 && sigma < 0.5 * step) {
    warnings->push_back(Name(axis) + ": the noise of " + Number(sigma) + " " + info_.unit.name +
                        " is below the resolution of " + Number(step) + " " + info_.unit.name +
                        "; short tau shows rounding rather than noise");
  }
  const FreezeWatch::Verdict freeze = freezes_[i].Judge();
  // Rounding to coarse steps freezes readings as well.
  if (freeze.frozen > 0 && freeze.typical > step) {
    const std::string first =
        freeze.first_zero_ns < 0
            ? ""
            : ", first at " + Number(static_cast<double>(freeze.first_zero_ns) * 1e-9, 6) + " s";
    warnings->push_back(Name(axis) + ": " + std::to_string(freeze.frozen) + " of " +
                        std::to_string(freeze.windows) + " windows of " +
                        std::to_string(FreezeWatch::kWindow) +
                        " samples are constant or nearly so" + first +
                        ": the sensor froze, or lost samples were repeated; N is too low and K is "
                        "wrong: cut these parts out");
  }
  if (sigma > 2.0 * step && limits_[i].most() >= kFewestAtLimit &&
      static_cast<double>(limits_[i].most()) >
          kMostAtLimit * static_cast<double>(monitor_.samples())) {
    warnings->push_back(Name(axis) + ": " + std::to_string(limits_[i].most()) + " readings are " +
                        Number(limits_[i].limit(), 9) + " " + info_.unit.name +
                        ", the extreme value; check for clipping");
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
