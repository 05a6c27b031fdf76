// SPDX-License-Identifier: Apache-2.0
#include "allan/allan_watch.h"

#include <algorithm>
#include <cmath>

#include "math/distributions.h"

namespace truetriad {
namespace {

// 1025 samples have 1024 spacings: fifty below the 5 % quantile and fifty above the 95 % quantile.
constexpr std::size_t kFirstSamples = 1025;
/// Chosen: up to this many missing samples in a row are filled by a straight line, so that only
/// their noise is lost.
constexpr std::int64_t kMostFilledSteps = 10;
// The limits of a window's variance and step, each divided by its median. By chance a window of 32
// samples reaches three times the median variance once in 10^8, and a step of Gaussian noise seven
// times the median step once in 10^6. Both limits are twice these.
constexpr double kVarianceRatio = 6.0, kStepRatio = 14.0;
// The limit of the variance if the mean wanders by more than the noise within a window, as in a
// random walk. A window's variance is then distributed nearly as the square of one Gaussian number
// and reaches forty times its median once in 10^10. The limit is twice as large.
constexpr double kWanderingVarianceRatio = 80.0;

}  // namespace

void EvenStream::Add(const SampleBlock& block) {
  held_.Append(block);
  if (!settled_ && held_.size() < kFirstSamples) return;
  Process();
}

void EvenStream::Finish() {
  Process();
  end_();
}

void EvenStream::Settle() {
  settled_ = true;
  std::vector<double> spacings_ns;
  for (std::size_t i = 1; i < std::min(held_.size(), kFirstSamples); ++i) {
    spacings_ns.push_back(static_cast<double>(held_.time_ns[i] - held_.time_ns[i - 1]));
  }
  if (spacings_ns.empty()) return;
  // The usual spacing is the mean of the spacings without gaps: if stamps are in whole
  // milliseconds, single spacings are too long or too short. If stamps come in bursts, the median
  // is zero, and gaps are not recognised.
  const double median = LowerQuantile(spacings_ns, 0.5), late = LowerQuantile(spacings_ns, 0.95);
  double sum = 0.0, count = 0.0;
  for (const double spacing_ns : spacings_ns) {
    if (median > 0.0 && spacing_ns > 3.0 * median) continue;
    sum += spacing_ns, count += 1.0;
  }
  typical_ns_ = sum / count;
  irregular_ = late > 1.5 * typical_ns_ || LowerQuantile(spacings_ns, 0.05) < 0.5 * typical_ns_;
  break_ns_ = std::max((kMostFilledSteps + 1.5) * typical_ns_, irregular_ ? 3.0 * late : 0.0);
}

std::int64_t EvenStream::MissingBefore(std::size_t i) const {
  const std::int64_t time_ns = held_.time_ns[i];
  const auto spacing_ns = static_cast<double>(time_ns - last_ns_);
  if (spacing_ns > break_ns_) return -1;
  if (irregular_ || spacing_ns <= 1.5 * typical_ns_) return 0;
  std::int64_t missing = std::llround(spacing_ns / typical_ns_) - 1;
  if (i + 1 < held_.size()) {
    // If a stamp is only late, the next spacing is short, and the sum of both spacings is usual.
    const auto next_ns = static_cast<double>(held_.time_ns[i + 1] - time_ns);
    if (next_ns < 0.75 * typical_ns_) {
      missing =
          std::min<std::int64_t>(missing, std::llround((spacing_ns + next_ns) / typical_ns_) - 2);
    }
  }
  return std::max<std::int64_t>(missing, 0);
}

void EvenStream::Process() {
  if (!settled_) Settle();
  for (std::size_t i = 0; i < held_.size(); ++i) {
    const std::int64_t time_ns = held_.time_ns[i];
    const Eigen::Vector3d reading = held_.reading(i);
    const std::int64_t missing = started_ ? MissingBefore(i) : 0;
    if (missing < 0) {
      HandOver();
      end_();
      ++breaks_;
    } else if (started_) {
      intervals_ += missing + 1;
      span_ns_ += time_ns - last_ns_;
      filled_ += missing;
      for (std::int64_t k = 1; k <= missing; ++k) {
        const double share = static_cast<double>(k) / static_cast<double>(missing + 1);
        const auto at = [&](double from, double to) { return std::lerp(from, to, share); };
        Push(at(static_cast<double>(last_ns_), static_cast<double>(time_ns)),
             last_.binaryExpr(reading, at));
      }
    }
    Push(static_cast<double>(time_ns), reading);
    started_ = true;
    last_ns_ = time_ns;
    last_ = reading;
  }
  HandOver();
  held_.Resize(0);
}

void EvenStream::Push(double time_ns, const Eigen::Vector3d& reading) {
  even_.end_ns.push_back(std::llround(time_ns + typical_ns_));
  for (std::size_t axis = 0; axis < 3; ++axis) {
    even_.axes[axis].push_back(reading[static_cast<Eigen::Index>(axis)]);
  }
}

void EvenStream::HandOver() {
  if (!even_.end_ns.empty()) add_(even_);
  even_.end_ns.clear();
  for (std::vector<double>& axis : even_.axes) axis.clear();
}

int SizeHistogram::Bin(double size) {
  return static_cast<int>(std::floor(8.0 * std::log2(std::max(size, std::exp2(-300.0)))));
}

double SizeHistogram::Median() const {
  std::int64_t below = 0;
  for (const auto& [bin, count] : bins_) {
    below += count;
    if (2 * below > count_) return std::exp2((static_cast<double>(bin) + 0.5) / 8.0);
  }
  return 0.0;
}

std::int64_t SizeHistogram::CountAbove(double size) const {
  std::int64_t above = 0;
  for (auto bin = bins_.upper_bound(Bin(size)); bin != bins_.end(); ++bin) above += bin->second;
  return above;
}

void AxisWatch::Sizes::Add(double size, std::int64_t at_ns) {
  all.Add(size);
  if (size > largest) largest = size, largest_ns = at_ns;
}

void AxisWatch::Add(std::span<const double> readings, std::span<const std::int64_t> end_ns) {
  const Eigen::Map<const Eigen::ArrayXd> values(readings.data(),
                                                static_cast<Eigen::Index>(readings.size()));
  bottom_.Add(values, values.minCoeff(), -1.0);
  top_.Add(values, values.maxCoeff(), 1.0);
  for (std::size_t i = 0; i < readings.size();) {
    if (filled_ == 0) origin_ = readings[i], sum_ = sum_of_squares_ = 0.0;
    const std::size_t count = std::min(readings.size() - i, window_ - filled_);
    double sum = sum_, sum_of_squares = sum_of_squares_;
    for (const double reading : readings.subspan(i, count)) {
      const double value = reading - origin_;
      sum += value;
      sum_of_squares += value * value;
    }
    sum_ = sum, sum_of_squares_ = sum_of_squares;
    i += count;
    filled_ += count;
    if (filled_ == window_) FinishWindow(end_ns[i - 1]);
  }
}

void AxisWatch::FinishWindow(std::int64_t at_ns) {
  const auto count = static_cast<double>(window_);
  variances_.Add(std::max(0.0, (sum_of_squares_ - sum_ * sum_ / count) / (count - 1.0)), at_ns);
  const double mean = origin_ + sum_ / count;
  if (last_mean_) steps_.Add(std::abs(mean - *last_mean_), at_ns);
  last_mean_ = mean;
  if (sum_of_squares_ == 0.0 && constant_++ == 0) constant_ns_ = at_ns;
  filled_ = 0;
}

AxisWatch::Verdict AxisWatch::Judge() const {
  const double variance = variances_.all.Median(), step = steps_.all.Median();
  const double step_sigma = kMadToSigma * step;
  // If the means of the windows change smoothly, their steps are compared with the steps that noise
  // alone would cause.
  const double expected_step =
      std::max(step, std::sqrt(2.0 * variance / static_cast<double>(window_)) / kMadToSigma);
  const std::int64_t loud = variances_.all.CountAbove(
      variance * (step_sigma * step_sigma > variance ? kWanderingVarianceRatio : kVarianceRatio));
  const std::int64_t stepped = steps_.all.CountAbove(kStepRatio * expected_step);
  const Extreme& extreme = top_.count >= bottom_.count ? top_ : bottom_;
  return {.windows = variances_.all.count(),
          .disturbed = std::max(loud, stepped),
          .worst_ns = stepped > 0 ? steps_.largest_ns : variances_.largest_ns,
          .sigma = std::sqrt(variance),
          .constant = constant_,
          .constant_ns = constant_ns_,
          .extreme = extreme.value,
          .at_extreme = extreme.count};
}

void HoldWatch::Add(const EvenReadings& readings) {
  for (std::size_t i = 0; i < readings.axes[0].size(); ++i) {
    const Eigen::Array3d now(readings.axes[0][i], readings.axes[1][i], readings.axes[2][i]);
    if (last_) {
      const Eigen::Index changes = (now != *last_).count();
      ++samples_;
      any_changes_ += changes > 0 ? 1 : 0;
      all_changes_ += changes == 3 ? 1 : 0;
      holds_ += changes == 0 && !is_held_ ? 1 : 0;
      is_held_ = changes == 0;
    }
    last_ = now;
  }
}

std::optional<double> HoldWatch::SamplesHeld() const {
  // If the noise is well above the resolution, all axes repeat their readings at once in less than
  // 1 % of the samples; from 5 % on, readings count as held. If each axis repeats by chance, the
  // axes seldom change all at once.
  const auto changes = static_cast<double>(any_changes_);
  if (any_changes_ == 0 || static_cast<double>(holds_) < 0.05 * changes ||
      static_cast<double>(all_changes_) < 0.5 * changes) {
    return std::nullopt;
  }
  return static_cast<double>(samples_) / changes;
}

}  // namespace truetriad
