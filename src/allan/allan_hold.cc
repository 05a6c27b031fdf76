// SPDX-License-Identifier: Apache-2.0
#include "allan/allan_hold.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include <Eigen/Core>

namespace truetriad {
namespace {

/// Of the median. 256 samples of noise through a filter of 2 % of the rate still are about ten
/// independent numbers, whose mean square is so small once in 10^7.
constexpr double kLeastChange = 0.03;
/// Readings that are held while others change: noise well above the step of the readings repeats on
/// all axes at once in less than 1 % of the samples.
constexpr double kLeastHeld = 0.05;
/// Axes of which each changes by chance seldom change together.
constexpr double kLeastTogether = 0.5;

}  // namespace

void FreezeWatch::Add(std::span<const double> readings, std::int64_t start_ns, double spacing_ns) {
  for (std::size_t i = 0; i < readings.size(); ++i) {
    const double change = readings[i] - last_.value_or(readings[i]);
    last_ = readings[i];
    sum_of_squares_ += change * change;
    if (++filled_ < kWindow) continue;
    if (sum_of_squares_ > 0.0) {
      changes_.Add(sum_of_squares_ / static_cast<double>(kWindow));
    } else {
      ++zeros_;
      if (first_zero_ns_ < 0) {
        first_zero_ns_ = start_ns + std::llround(static_cast<double>(i) * spacing_ns);
      }
    }
    filled_ = 0;
    sum_of_squares_ = 0.0;
  }
}

FreezeWatch::Verdict FreezeWatch::Judge() const {
  Verdict verdict;
  const double median = changes_.Median();
  verdict.windows = zeros_ + changes_.count();
  verdict.frozen = zeros_ + changes_.count() - changes_.CountAbove(kLeastChange * median);
  verdict.typical = std::sqrt(median);
  verdict.first_zero_ns = first_zero_ns_;
  return verdict;
}

void HoldWatch::Add(const std::array<std::span<const double>, 3>& readings) {
  for (std::size_t i = 0; i < readings[0].size(); ++i) {
    const std::array<double, 3> now = {readings[0][i], readings[1][i], readings[2][i]};
    if (last_) {
      int changes = 0;
      for (std::size_t axis = 0; axis < 3; ++axis) changes += now[axis] != (*last_)[axis] ? 1 : 0;
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
  const auto changes = static_cast<double>(any_changes_);
  if (any_changes_ == 0 || static_cast<double>(holds_) < kLeastHeld * changes ||
      static_cast<double>(all_changes_) < kLeastTogether * changes) {
    return std::nullopt;
  }
  return static_cast<double>(samples_) / changes;
}

void LimitWatch::Add(std::span<const double> readings) {
  const Eigen::Map<const Eigen::ArrayXd> values(readings.data(),
                                                static_cast<Eigen::Index>(readings.size()));
  const auto count = [&](double extreme, double sign, double* limit, std::int64_t* hits) {
    if (*hits > 0 && sign * extreme < sign * *limit) return;
    if (*hits > 0 && extreme != *limit) *hits = 0;
    *limit = extreme;
    *hits += (values == extreme).count();
  };
  count(values.maxCoeff(), 1.0, &top_, &at_top_);
  count(values.minCoeff(), -1.0, &bottom_, &at_bottom_);
}

}  // namespace truetriad
