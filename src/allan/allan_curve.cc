// SPDX-License-Identifier: Apache-2.0
#include "allan/allan_curve.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <iterator>

namespace truetriad {
namespace {

// The largest averaging factor of a level, in strides. At the level's smallest factor (64 strides),
// neighbouring second differences share all but 1/64 of their samples, so that a finer stride would
// add no information.
constexpr std::int64_t kStrides = 128;
// Number of a level's sums that are evaluated at a time: 16 kB, half of a first-level cache.
constexpr std::size_t kBatch = 2048;
constexpr std::size_t kHistory = 2 * kStrides;  // A second difference spans two factors.

std::int64_t StrideOf(std::int64_t m) {
  const auto strides = static_cast<std::uint64_t>((m + kStrides - 1) / kStrides);
  return static_cast<std::int64_t>(std::bit_ceil(strides));
}

}  // namespace

AllanCurve::Level::Level(std::int64_t stride, int per_decade) : sums(kHistory + kBatch) {
  for (int k = 0;; ++k) {
    std::int64_t m = std::llround(std::pow(10.0, static_cast<double>(k) / per_decade));
    const std::int64_t rounding = StrideOf(m);
    m = (m + rounding / 2) / rounding * rounding;
    if (StrideOf(m) > stride) return;
    if (StrideOf(m) < stride || (!factors.empty() && factors.back().m == m)) continue;
    factors.push_back({{.m = m, .stride = stride}});
  }
}

void AllanCurve::Push(std::size_t index, std::span<const double> sums, std::size_t step) {
  if (index == levels_.size()) levels_.emplace_back(std::int64_t{1} << index, per_decade_);
  Level& level = levels_[index];
  for (std::size_t i = 0; i < sums.size();) {
    const std::size_t end = std::min(sums.size(), i + step * (level.sums.size() - level.filled));
    double* to = level.sums.data() + level.filled;
    for (; i < end; i += step) *to++ = sums[i];
    level.filled = static_cast<std::size_t>(to - level.sums.data());
    if (level.filled == level.sums.size()) Evaluate(index);
  }
}

void AllanCurve::Add(std::span<const double> readings) {
  if (readings.empty()) return;
  if (!offset_) {
    // The median of the first readings is itself a reading, so that sums of whole counts stay
    // exact.
    std::vector<double> first(readings.begin(), readings.end());
    if (first.size() > 1024) first.resize(1024);
    const auto middle = first.begin() + static_cast<std::ptrdiff_t>(first.size() / 2);
    std::nth_element(first.begin(), middle, first.end());
    offset_ = *middle;
  }
  double sum = stretch_ == 0 ? 0.0 : sum_;
  if (stretch_ == 0) Push(0, {&sum, 1}, 1);
  std::vector<double> sums(readings.size());
  std::transform(
      readings.begin(), readings.end(), sums.begin(), [&sum, offset = *offset_](double reading) {
        return sum += reading - offset;
      });
  sum_ = sum;
  Push(0, sums, 1);
  stretch_ += static_cast<std::int64_t>(readings.size());
}

void AllanCurve::Evaluate(std::size_t index) {
  using Sums = Eigen::Map<const Eigen::ArrayXd>;
  Level& level = levels_[index];
  for (Factor& factor : level.factors) {
    const auto k = static_cast<std::size_t>(factor.m / factor.stride);
    const std::size_t begin = std::max(level.evaluated, 2 * k);
    if (begin >= level.filled) continue;
    const auto count = static_cast<Eigen::Index>(level.filled - begin);
    const double* const last = level.sums.data() + begin;
    factor.sum_of_squares +=
        (Sums(last, count) - 2.0 * Sums(last - k, count) + Sums(last - 2 * k, count))
            .square()
            .sum();
    factor.terms += count;
    factor.stretches += factor.in_stretch ? 0 : 1;
    factor.in_stretch = true;
  }
  const std::span<const double> added(level.sums.data() + level.evaluated,
                                      level.filled - level.evaluated);
  const std::size_t skipped = level.next_goes_up ? 0 : 1;
  if (added.size() > skipped) Push(index + 1, added.subspan(skipped), 2);
  if (added.size() % 2 == 1) level.next_goes_up = !level.next_goes_up;
  const std::size_t history = std::min(level.filled, kHistory);
  const auto end = level.sums.begin() + static_cast<std::ptrdiff_t>(level.filled);
  std::copy(end - static_cast<std::ptrdiff_t>(history), end, level.sums.begin());
  level.filled = level.evaluated = history;
}

void AllanCurve::EndStretch() {
  for (std::size_t index = 0; index < levels_.size(); ++index) {
    Evaluate(index);
    Level& level = levels_[index];
    level.filled = level.evaluated = 0;
    level.next_goes_up = false;
    for (Factor& factor : level.factors) factor.in_stretch = false;
  }
  longest_ = std::max(longest_, stretch_);
  stretch_ = 0;
}

std::vector<AllanCurve::Factor> AllanCurve::UsedFactors() const {
  std::vector<Factor> used;
  for (const Level& level : levels_) {
    std::copy_if(
        level.factors.begin(),
        level.factors.end(),
        std::back_inserter(used),
        [&](const Factor& factor) { return 4 * factor.m <= longest_ && factor.terms > 0; });
  }
  return used;
}

std::vector<AllanFactor> AllanCurve::factors() const {
  const std::vector<Factor> used = UsedFactors();
  return {used.begin(), used.end()};
}

Eigen::VectorXd AllanCurve::variances() const {
  const std::vector<Factor> used = UsedFactors();
  Eigen::VectorXd variances(static_cast<Eigen::Index>(used.size()));
  std::transform(used.begin(), used.end(), variances.begin(), [](const Factor& factor) {
    const auto m = static_cast<double>(factor.m);
    return factor.sum_of_squares / static_cast<double>(factor.terms) / (2.0 * m * m);
  });
  return variances;
}

}  // namespace truetriad
