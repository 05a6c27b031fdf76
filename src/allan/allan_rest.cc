// SPDX-License-Identifier: Apache-2.0
#include "allan/allan_rest.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace truetriad {
namespace {

// Noise varies: windows of 32 samples reach three times the median variance once in 10^8, and steps
// of Gaussian noise seven times their median once in 10^6. Both limits are twice that.
constexpr double kVarianceRatio = 6.0;
constexpr double kStepRatio = 14.0;
// Where the mean wanders by more than the noise within a window, as a random walk does, the
// variance of a window is nearly that of one Gaussian number: it reaches forty times its median
// once in 10^10.
constexpr double kWanderingVarianceRatio = 80.0;
// Median over standard deviation of the size of a Gaussian number.
constexpr double kMedianSize = 0.6745;

}  // namespace

std::size_t SizeHistogram::Bin(double value) {
  const double octaves = std::log2(std::max(value, 1e-300));
  const double bin = (octaves - kLowestExponent) * kBinsAnOctave;
  return static_cast<std::size_t>(std::clamp(bin, 0.0, kBins - 1.0));
}

void SizeHistogram::Add(double value) {
  ++bins_[Bin(value)];
  ++count_;
}

double SizeHistogram::Median() const {
  std::int64_t below = 0;
  for (std::size_t i = 0; i < bins_.size(); ++i) {
    below += bins_[i];
    if (2 * below > count_) {
      return std::exp2(kLowestExponent + (static_cast<double>(i) + 0.5) / kBinsAnOctave);
    }
  }
  return 0.0;
}

std::int64_t SizeHistogram::CountAbove(double value) const {
  std::int64_t above = 0;
  for (std::size_t i = Bin(value) + 1; i < bins_.size(); ++i) above += bins_[i];
  return above;
}

void RestWatch::Add(std::span<const double> readings, std::int64_t start_ns, double spacing_ns) {
  for (std::size_t i = 0; i < readings.size();) {
    if (filled_ == 0) origin_ = readings[i], sum_ = sum_of_squares_ = 0.0;
    const std::size_t end =
        std::min(readings.size(), i + static_cast<std::size_t>(window_ - filled_));
    filled_ += static_cast<std::int64_t>(end - i);
    for (; i < end; ++i) {
      const double value = readings[i] - origin_;
      sum_ += value;
      sum_of_squares_ += value * value;
    }
    if (filled_ == window_) {
      FinishWindow(start_ns + std::llround(static_cast<double>(end) * spacing_ns));
    }
  }
}

void RestWatch::FinishWindow(std::int64_t at_ns) {
  const auto count = static_cast<double>(window_);
  const double variance = std::max(0.0, (sum_of_squares_ - sum_ * sum_ / count) / (count - 1.0));
  variances_.Add(variance);
  if (variance > largest_variance_.value) largest_variance_ = {variance, at_ns};
  const double mean = origin_ + sum_ / count;
  if (last_mean_) {
    const double step = std::abs(mean - *last_mean_);
    steps_.Add(step);
    if (step > largest_step_.value) largest_step_ = {step, at_ns};
  }
  last_mean_ = mean;
  filled_ = 0;
}

RestWatch::Verdict RestWatch::Judge() const {
  const double variance = variances_.Median();
  const double step = steps_.Median();
  // Steps of a smooth mean are compared with what the noise alone would make of them.
  const double expected_step =
      std::max(step, kMedianSize * std::sqrt(2.0 * variance / static_cast<double>(window_)));
  const double step_sigma = step / kMedianSize;
  const double variance_ratio =
      step_sigma * step_sigma > variance ? kWanderingVarianceRatio : kVarianceRatio;
  Verdict verdict;
  verdict.windows = variances_.count();
  const std::int64_t loud = variances_.CountAbove(variance_ratio * variance);
  const std::int64_t stepped = steps_.CountAbove(kStepRatio * expected_step);
  verdict.disturbed = std::max(loud, stepped);
  verdict.worst_ns = stepped > 0 ? largest_step_.at_ns : largest_variance_.at_ns;
  verdict.largest_step = largest_step_.value;
  verdict.sigma = std::sqrt(variance);
  return verdict;
}

}  // namespace truetriad
