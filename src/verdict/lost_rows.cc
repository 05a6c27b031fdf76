// SPDX-License-Identifier: Apache-2.0
#include "verdict/lost_rows.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace truetriad {
namespace {

// A step is skipped if its turn is below this many σ of a difference of two readings: noise
// dominates it.
constexpr double kLeastSigmas = 0.2;
// Variance that k^3 has without noise, since the rate varies within a step.
constexpr double kLeastVariance = 0.01;
// Number of σ that normal noise exceeds in one of 3.5 million runs.
constexpr double kSureSigmas = 5.0;
// The mean of this many neighbouring steps on each side is subtracted from a step.
constexpr std::size_t kBeside = 4;
// The variance of a step minus the mean of at least four neighbours is at most this many times the
// variance of the step alone.
constexpr double kWithBeside = 1.25;
// Largest k by lost rows: that of a step across two consecutive lost rows.
constexpr double kMostBeyond = 2.0;
// k is limited to kMostBeyond plus this many σ of its noise, so that outliers do not dominate.
constexpr double kFarNoise = 4.0;
// Fewer steps do not determine a share: one lost row would be 2 %.
constexpr std::size_t kFewestSteps = 50;
// Longest period that is tested: rarer lost rows are hidden in the noise of most logs.
constexpr std::size_t kLongestPeriod = 24;
// Number of σ by which a phase of a period must stand out. About 300 phases are tested; normal
// noise exceeds this number in 1e-8 of runs.
constexpr double kSurePhaseSigmas = 6.5;
// Range of the contrast, which is the mean of k at the steps across lost rows minus the mean at all
// other steps. Lost rows give one step, less the part that the fitted gain absorbs. Moves at
// regular times, and hum, give other values.
constexpr double kLeastContrast = 0.7, kMostContrast = 1.3;
// If more than this share of a turning body's steps have equal readings, readings are repeated.
constexpr double kRepeatedShare = 0.05;

}  // namespace

void LostRowCounter::Add(std::span<const std::int64_t> time_ns,
                         std::span<const Eigen::Vector3d> gyroscope_raw,
                         std::span<const Eigen::Vector3d> vector_raw) {
  if (vector_raw.size() != gyroscope_raw.size()) return;
  if (spacing_ns_ <= 0 && time_ns.size() > 1) spacing_ns_ = time_ns[1] - time_ns[0];
  const Eigen::Matrix3d to_rate = gyroscope_.Correction(), to_field = vector_.Correction();
  const double least = kLeastSigmas * std::numbers::sqrt2 * sigma_;
  std::vector<Step> steps(vector_raw.size());
  Eigen::Vector3d before = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < vector_raw.size(); ++i) {
    const Eigen::Vector3d field = (to_field * (vector_raw[i] - vector_.bias)).normalized();
    if (i > 0) {
      const double step_s = 1e-9 * static_cast<double>(time_ns[i] - time_ns[i - 1]);
      const Eigen::Vector3d rates = gyroscope_raw[i] + gyroscope_raw[i - 1] - 2.0 * gyroscope_.bias;
      const Eigen::Vector3d told = before.cross(0.5 * step_s * to_rate * rates);
      const double size = told.norm();
      if (size > least) {
        ++turned_;
        if (vector_raw[i] == vector_raw[i - 1] || gyroscope_raw[i] == gyroscope_raw[i - 1]) {
          ++repeated_;
        }
        steps[i] = {told.dot(field - before) / (size * size) - 1.0,
                    std::numbers::sqrt2 * sigma_ / size,
                    true};
      }
    }
    before = field;
  }
  for (std::size_t i = kBeside; i + kBeside < steps.size(); ++i) {
    double sum = 0.0, count = 0.0;
    for (std::size_t j = i - kBeside; j <= i + kBeside; ++j) {
      if (j == i || !steps[j].is_told) continue;
      sum += steps[j].more;
      count += 1.0;
    }
    if (!steps[i].is_told || count < kBeside || spacing_ns_ <= 0) continue;
    AddStep(
        (time_ns[i] + spacing_ns_ / 2) / spacing_ns_, steps[i].more - sum / count, steps[i].noise);
  }
}

void LostRowCounter::AddStep(std::int64_t row, double beyond, double noise) {
  const double variance = kWithBeside * noise * noise;
  const double most = kMostBeyond + kFarNoise * std::sqrt(variance);
  told_.push_back({row, std::clamp(beyond, -most, most), variance});
}

bool LostRowCounter::CanTell() const {
  return told_.size() >= kFewestSteps &&
         static_cast<double>(repeated_) <= kRepeatedShare * static_cast<double>(turned_);
}

double LostRowCounter::Share() const {
  if (!CanTell()) return 0.0;
  const ShareOfRows random = AtRandom();
  const double sure = 0.5 * std::erfc(kSureSigmas / std::numbers::sqrt2);
  return std::max(random.chance < sure ? random.share : 0.0, PeriodicShare());
}

ShareOfRows LostRowCounter::AtRandom() const {
  if (!CanTell()) return {};
  // Sums of weights, of weight times k^3, and of their products.
  double weights = 0.0, cubes = 0.0, weight_squares = 0.0, cross = 0.0, cube_squares = 0.0;
  for (const Told& step : told_) {
    // The cube of normal noise of variance v has the variance 15 v^3.
    const double weight = 1.0 / (15.0 * std::pow(step.variance, 3) + kLeastVariance);
    const double cube = weight * std::pow(std::clamp(step.beyond, -kMostBeyond, kMostBeyond), 3);
    weights += weight;
    cubes += cube;
    weight_squares += weight * weight;
    cross += weight * cube;
    cube_squares += cube * cube;
  }
  const double mean = cubes / weights;
  const double variance =
      (cube_squares - 2.0 * mean * cross + mean * mean * weight_squares) / (weights * weights);
  if (!(mean > 0.0)) return {};
  return {std::min(mean, 0.5), 0.5 * std::erfc(mean / std::sqrt(2.0 * variance))};
}

double LostRowCounter::PeriodicShare() const {
  double weight = 0.0, sum = 0.0, square = 0.0;
  const auto weight_of = [](const Told& step) { return 1.0 / (step.variance + kLeastVariance); };
  for (const Told& step : told_) {
    weight += weight_of(step);
    sum += weight_of(step) * step.beyond;
    square += weight_of(step) * step.beyond * step.beyond;
  }
  const double mean = sum / weight;
  // The variance of a step of unit weight.
  const double variance = (square - weight * mean * mean) / static_cast<double>(told_.size() - 1);
  double best = kSurePhaseSigmas;
  std::size_t period = 0;
  std::array<double, kLongestPeriod> weights, sums;
  for (std::size_t every = 2; every <= kLongestPeriod; ++every) {
    const auto count = static_cast<double>(every);
    const double least = kLeastContrast * count / (count + 1.0);
    weights.fill(0.0);
    sums.fill(0.0);
    for (const Told& step : told_) {
      const std::size_t phase = static_cast<std::size_t>(step.row) % every;
      weights[phase] += weight_of(step);
      sums[phase] += weight_of(step) * step.beyond;
    }
    for (std::size_t phase = 0; phase < every; ++phase) {
      const double rest = weight - weights[phase];
      if (!(weights[phase] > 0.0) || !(rest > 0.0)) continue;
      const double contrast = sums[phase] / weights[phase] - (sum - sums[phase]) / rest;
      const double sigma = std::sqrt(variance * (1.0 / weights[phase] + 1.0 / rest));
      if (contrast < least || contrast > kMostContrast || contrast < best * sigma) continue;
      best = contrast / sigma;
      period = every;
    }
  }
  return period == 0 ? 0.0 : 1.0 / static_cast<double>(period + 1);
}

}  // namespace truetriad
