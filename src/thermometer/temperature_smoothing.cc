// SPDX-License-Identifier: Apache-2.0
#include "thermometer/temperature_smoothing.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <utility>

#include <Eigen/Core>

#include "math/dense/cholesky.h"
#include "math/distributions.h"
#include "model/mechanisms.h"
#include "thermometer/coarse_thermometer.h"
#include "thermometer/thermometer.h"
#include "truetriad/model/finding.h"

namespace truetriad {
namespace {

// Steps of up to 1/400 of the range, half of the change in a sweep's window, are treated as noise.
constexpr double kCoarseShare = 1.0 / 400.0;
// Chosen: noise gives the smoothed rate a σ of at most 1 % of the typical rate.
constexpr double kRateNoiseShare = 0.01;
// Chosen: the half-width is at most 1/20 of the recording; a wider one rounds off turning points.
constexpr double kWidestShare = 1.0 / 20.0;
// Chosen: if a coarse thermometer changes, or a slow one is read, fewer times than this, all cells
// are smoothed.
constexpr std::size_t kFewestPlaces = 8;
// In steps. If readings have this noise or more, beside the variance 1/12 of rounding, the track's
// noise is that of local fits. If they have less, rounding counts as the only error, and the track
// keeps its step.
constexpr double kDithered = 0.15;
// Tukey's biweight: residuals beyond 6 σ get a weight of 1e-6; 2 in 10^9 normal errors are larger.
constexpr double kTukey = 6.0;
// The second round weighs by the residuals of a fit that already excludes the outliers.
constexpr int kRobustRounds = 2;

// Readings of the thermometer at ascending times.
struct Readings {
  std::vector<double> time_s, degc, weight;
  void Add(double time, double value) {
    time_s.push_back(time), degc.push_back(value), weight.push_back(1.0);
  }
};

double SpanOf(const std::vector<double>& values) {
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  return *high - *low;
}

// σ of a single reading, from second differences; a steady drift does not change these.
double NoiseOf(const std::vector<double>& degc) {
  std::vector<double> differences;
  for (std::size_t i = 2; i < degc.size(); ++i) {
    differences.push_back(degc[i] - 2.0 * degc[i - 1] + degc[i - 2]);
  }
  return MadSigma(std::move(differences)) / std::sqrt(6.0);
}

// Mean absolute rate of change, from differences over some 64 intervals.
double TypicalRate(const std::vector<double>& time_s, const std::vector<double>& degc) {
  // Chosen: in 1/64 of a sweep the temperature changes by more than the noise; a ramp takes longer.
  constexpr std::size_t kStretches = 64;
  const std::size_t every = std::max<std::size_t>(degc.size() / kStretches, 1);
  double change = 0.0;
  for (std::size_t i = every; i < degc.size(); i += every) {
    change += std::abs(degc[i] - degc[i - every]);
  }
  return change / (time_s.back() - time_s.front());
}

// Value and slope of a local fit. weights[j]: weights of reading begin + j in the value and in the
// slope.
struct LocalFit {
  double value = 0.0, slope = 0.0;
  std::size_t begin = 0;
  std::vector<Eigen::Vector2d> weights;
};

// Fits a parabola about `time` to the readings within `half_width` on both sides. If readings are
// missing on one side, the fit reaches further on the other. It covers at least kFewestSmoothed
// readings. `first` advances from call to call with `time`.
void FitAbout(
    const Readings& readings, double time, double half_width, std::size_t* first, LocalFit* local) {
  const std::vector<double>& at = readings.time_s;
  const double missing =
      std::max({0.0, half_width - (time - at.front()), half_width - (at.back() - time)});
  double reach = half_width + missing;
  while (*first < at.size() && at[*first] < time - reach) ++*first;
  std::size_t begin = std::min(*first, at.size() - 1);
  std::size_t end = begin;
  while (end < at.size() && at[end] <= time + reach) ++end;
  while (end - begin < std::min(kFewestSmoothed, at.size())) {
    const bool later = begin == 0 || (end < at.size() && at[end] - time <= time - at[begin - 1]);
    if (later) {
      ++end;
    } else {
      --begin;
    }
    reach = std::max(reach, 1.05 * std::max(time - at[begin], at[end - 1] - time));
  }
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  local->begin = begin;
  local->weights.clear();
  const auto row_of = [&](std::size_t j) {
    const double u = (at[j] - time) / reach;
    return Eigen::Vector3d(1.0, u, u * u);
  };
  for (std::size_t j = begin; j < end; ++j) {
    const Eigen::Vector3d row = row_of(j);
    const double far = std::abs(row[1]);
    const double less = std::max(0.0, 1.0 - far * far * far);
    const double weight = readings.weight[j] * less * less * less;
    normal += weight * row * row.transpose();
    local->weights.emplace_back(weight, 0.0);
  }
  // If readings are too few for a parabola, a ridge of 1e-9 makes the fit as straight as possible.
  const double ridge = 1e-9 * normal(0, 0);
  normal.diagonal() += Eigen::Vector3d(0.0, ridge, ridge);
  Eigen::Matrix<double, 3, 2> wanted = Eigen::Matrix<double, 3, 2>::Zero();
  wanted(0, 0) = 1.0, wanted(1, 1) = 1.0 / reach;
  const Eigen::Matrix<double, 3, 2> solved = SolveSymmetric32(normal, wanted);
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (std::size_t j = begin; j < end; ++j) {
    Eigen::Vector2d& weight = local->weights[j - begin];
    weight = weight[0] * (solved.transpose() * row_of(j));
    sum += readings.degc[j] * weight;
  }
  local->value = sum[0];
  local->slope = sum[1];
}

// A width chosen by the noise alone may smooth a turning point away. Returns the width, at most
// `half_width`, that has the least score of generalised cross-validation.
double NotTooWide(const Readings& readings, double half_width, double spacing_s) {
  // Chosen: two widths per octave are tried; the minimum of the score is flat.
  constexpr double kNarrower = 0.7;
  constexpr double kFewestOver = 20.0;  // Least number of readings in a half-width.
  // Chosen: 2000 readings give the score to 1 / √2000 = 2 %; more only take time.
  constexpr std::size_t kPlaces = 2000;
  const std::size_t every = readings.time_s.size() / kPlaces + 1;
  double best = half_width, least = std::numeric_limits<double>::infinity();
  LocalFit local;
  for (double width = half_width; width >= kFewestOver * spacing_s; width *= kNarrower) {
    double square = 0.0, freedom = 0.0;
    std::size_t first = 0;
    for (std::size_t i = 0; i < readings.time_s.size(); i += every) {
      FitAbout(readings, readings.time_s[i], width, &first, &local);
      square += std::pow(readings.degc[i] - local.value, 2);
      freedom += 1.0 - local.weights[i - local.begin][0];
    }
    const double score = square / (freedom * freedom);
    if (score >= least) continue;
    least = score;
    best = width;
  }
  return best;
}

// Records how much the noise of each block of readings changes each point of a track.
class NoiseBlocks {
 public:
  // Blocks last a quarter of the half-width, or longer if there were over kMostBlocks otherwise.
  NoiseBlocks(const Readings& readings,
              double half_width,
              double sigma_degc,
              TemperatureNoise* noise)
      : noise_(*noise) {
    // Chosen: each block is an unknown of the calibration, so this bounds the number of unknowns.
    constexpr double kMostBlocks = 400.0;
    const double begin = readings.time_s.front();
    const double length =
        std::max(0.25 * half_width, (readings.time_s.back() - begin) / kMostBlocks);
    std::vector<double> count;
    for (const double time : readings.time_s) {
      block_.push_back(static_cast<std::size_t>((time - begin) / length));
      if (block_.back() >= count.size()) count.resize(block_.back() + 1, 0.0);
      count[block_.back()] += 1.0;
    }
    for (const double readings_in_block : count) {
      noise_.sigma_degc.push_back(sigma_degc / std::sqrt(std::max(readings_in_block, 1.0)));
    }
    // A one-sided fit at an end reaches twice as far.
    noise_.reach = std::min(static_cast<std::size_t>(2.1 * half_width / length) + 3, count.size());
  }

  void Note(const LocalFit& local) {
    const std::size_t first =
        std::min(block_[local.begin], noise_.sigma_degc.size() - noise_.reach);
    noise_.first.push_back(first);
    const std::size_t at = noise_.degc.size();
    noise_.degc.resize(at + noise_.reach, 0.0F);
    noise_.rate.resize(at + noise_.reach, 0.0F);
    for (std::size_t j = 0; j < local.weights.size(); ++j) {
      const std::size_t place = block_[local.begin + j] - first;
      if (place >= noise_.reach) continue;
      noise_.degc[at + place] += static_cast<float>(local.weights[j][0]);
      noise_.rate[at + place] += static_cast<float>(local.weights[j][1]);
    }
  }

 private:
  TemperatureNoise& noise_;
  std::vector<std::size_t> block_;  // The block of each reading.
};

// The track of a coarse thermometer, from the times at which its reading changes; unset if these
// are too few. Its `step_degc` is set only if rounding is the only error of the readings. If noise
// spreads them over several steps, it stays 0, and the caller takes the noise from local fits.
std::optional<TemperatureTrack> StepsFollowed(const std::vector<double>& time_s,
                                              const std::vector<double>& degc,
                                              double step_degc) {
  const StepPlaces places = PlacesOfChange(time_s, degc, step_degc);
  if (places.time_s.size() < kFewestPlaces) return std::nullopt;
  TemperatureTrack track = ThroughPlaces(places, time_s);
  // Mean square of the residuals: the variance of rounding plus that of noise.
  double square = 0.0;
  for (std::size_t i = 0; i < time_s.size(); ++i) {
    square += std::pow(track.degc[i] - degc[i], 2) / static_cast<double>(time_s.size());
  }
  const double noise_steps = std::sqrt(square) / step_degc;
  if (!(noise_steps * noise_steps < 1.0 / 12.0 + kDithered * kDithered)) return track;
  track.step_degc = step_degc;
  for (std::size_t i = 0; i < time_s.size(); ++i) {
    track.degc[i] = std::clamp(track.degc[i], degc[i] - step_degc, degc[i] + step_degc);
  }
  return track;
}

// Reduces the weight of readings that are far from the local parabola.
void WeighRobustly(double half_width, double least_sigma, Readings* readings) {
  LocalFit local;
  std::vector<double> values;
  for (int round = 0; round < kRobustRounds; ++round) {
    std::size_t first = 0;
    values.clear();
    for (const double time : readings->time_s) {
      FitAbout(*readings, time, half_width, &first, &local);
      values.push_back(local.value);
    }
    std::vector<double> residuals;
    for (std::size_t i = 0; i < values.size(); ++i) {
      residuals.push_back(std::abs(readings->degc[i] - values[i]));
    }
    const double sigma = std::max(kMadToSigma * Median(residuals), least_sigma);
    for (std::size_t i = 0; i < values.size(); ++i) {
      const double u = residuals[i] / (kTukey * sigma);
      readings->weight[i] = u < 1.0 ? std::pow(1.0 - u * u, 2) : 1e-6;
    }
  }
}

}  // namespace

Result<TemperatureTrack> SmoothTemperature(const std::vector<double>& time_s,
                                           const std::vector<double>& degc,
                                           double step_degc,
                                           double hold_s) {
  TemperatureTrack track;
  track.time_s = time_s;
  const double duration = time_s.back() - time_s.front();
  const double span = SpanOf(degc);
  if (!(span > 0.0) || !(duration > 0.0)) {
    return NotEnoughError(
        Finding(FindingCode::kTemperatureRangeTooSmall,
                "the temperature is " + std::to_string(degc.front()) + " degC throughout",
                "a sweep needs a temperature that goes up and down")
            .With("temperature", degc.front(), "degC"));
  }
  const double rate = std::max(TypicalRate(time_s, degc), span / duration);
  const double widest = kWidestShare * duration;
  if (step_degc > kCoarseShare * span) {
    if (std::optional<TemperatureTrack> steps = StepsFollowed(time_s, degc, step_degc);
        steps && Acts(Mechanism::kCoarseThermometer)) {
      track = *std::move(steps);
      track.smoothing_s = std::min(widest, step_degc / rate);
      if (track.step_degc > 0.0) return track;
    }
  }
  Readings readings;
  // Chosen: a reading that is repeated for more than four cells counts once, at the time at which
  // it was taken. A shorter repetition only delays the means of the cells, by half of its duration.
  constexpr double kSlow = 4.0;
  double spacing = duration / static_cast<double>(time_s.size() - 1);
  TakenReadings taken{time_s, degc};
  if (hold_s > kSlow * spacing) {
    TakenReadings slow = ReadingsAsTaken(time_s, degc, hold_s);
    if (slow.time_s.size() >= kFewestPlaces) {
      taken = std::move(slow);
      spacing = hold_s;
    }
  } else if (hold_s > 0.0) {
    for (double& time : taken.time_s) time -= 0.5 * hold_s;
  }
  for (std::size_t i = 0; i < taken.degc.size(); ++i) {
    readings.Add(taken.time_s[i], taken.degc[i]);
  }
  // Errors of rounding are correlated over the time that a step lasts.
  const double noise = NoiseOf(taken.degc);
  const double rounding = step_degc * step_degc / 12.0 * std::max(spacing, step_degc / rate);
  const double density = noise * noise * spacing + rounding;
  // Variance of a local parabola's slope: about 2.3 density / half-width^3.
  const double noise_width = std::cbrt(2.3 * density / std::pow(kRateNoiseShare * rate, 2));
  track.smoothing_s = NotTooWide(
      readings, std::clamp(noise_width, 3.0 * spacing, std::max(widest, 3.0 * spacing)), spacing);
  WeighRobustly(track.smoothing_s, 1e-6 * span, &readings);
  LocalFit local;
  NoiseBlocks blocks(readings, track.smoothing_s, std::sqrt(density / spacing), &track.noise);
  std::size_t first = 0;
  const bool has_values = !track.degc.empty();
  for (const double time : time_s) {
    FitAbout(readings, time, track.smoothing_s, &first, &local);
    blocks.Note(local);
    if (has_values) continue;
    track.degc.push_back(local.value);
    track.rate_degcps.push_back(local.slope);
  }
  return track;
}

}  // namespace truetriad
