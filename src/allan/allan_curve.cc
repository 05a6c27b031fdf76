// SPDX-License-Identifier: Apache-2.0
#include "allan/allan_curve.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <iterator>

namespace truetriad {
namespace {

// The largest factor of a level, in its strides: neighbouring differences of the smallest one share
// all but a 64th of their samples, so that further ones would tell nothing new.
constexpr std::int64_t kStrides = 128;
// Sums of a level that are evaluated at a time: 16 kB, half of a first-level cache.
constexpr std::size_t kBatch = 2048;
constexpr std::size_t kHistory = 2 * kStrides;  // A second difference spans two factors.

std::int64_t StrideOf(std::int64_t m) {
  const auto strides = static_cast<std::uint64_t>((m + kStrides - 1) / kStrides);
  return static_cast<std::int64_t>(std::bit_ceil(strides));
}

}  // namespace

void AllanCurve::Add(std::span<const double> readings) {
  if (readings.empty()) return;
  if (!offset_) {
    // A reading near the middle; one of them, so that sums of whole counts stay exact.
    std::vector<double> first(readings.begin(), readings.end());
    if (first.size() > 1024) first.resize(1024);
    const auto middle = first.begin() + static_cast<std::ptrdiff_t>(first.size() / 2);
    std::nth_element(first.begin(), middle, first.end());
    offset_ = *middle;
  }
  if (stretch_ == 0) Push(0, sum_ = 0.0);
  for (const double reading : readings) Push(0, sum_ += reading - *offset_);
  stretch_ += static_cast<std::int64_t>(readings.size());
}

void AllanCurve::Push(std::size_t index, double sum) {
  if (index == levels_.size()) {
    Level& added = levels_.emplace_back();
    added.sums.reserve(kHistory + kBatch);
    const std::int64_t stride = std::int64_t{1} << index;
    for (int k = 0;; ++k) {
      std::int64_t m = std::llround(std::pow(10.0, static_cast<double>(k) / per_decade_));
      const std::int64_t rounding = StrideOf(m);
      m = (m + rounding / 2) / rounding * rounding;
      if (StrideOf(m) > stride) break;
      if (StrideOf(m) < stride || (!added.factors.empty() && added.factors.back().m == m)) continue;
      added.factors.push_back({{.m = m, .stride = stride}});
    }
  }
  Level& level = levels_[index];
  level.sums.push_back(sum);
  if (level.sums.size() == kHistory + kBatch) Evaluate(index);
}

void AllanCurve::Evaluate(std::size_t index) {
  using Sums = Eigen::Map<const Eigen::ArrayXd>;
  Level& level = levels_[index];
  for (Factor& factor : level.factors) {
    const auto k = static_cast<std::size_t>(factor.m / factor.stride);
    const std::size_t begin = std::max(level.evaluated, 2 * k);
    if (begin >= level.sums.size()) continue;
    const auto count = static_cast<Eigen::Index>(level.sums.size() - begin);
    const double* const last = level.sums.data() + begin;
    factor.sum_of_squares +=
        (Sums(last, count) - 2.0 * Sums(last - k, count) + Sums(last - 2 * k, count))
            .square()
            .sum();
    factor.terms += count;
    factor.stretches += factor.in_stretch ? 0 : 1;
    factor.in_stretch = true;
  }
  for (std::size_t i = level.evaluated; i < level.sums.size(); ++i) {
    if (level.next_goes_up) Push(index + 1, level.sums[i]);
    level.next_goes_up = !level.next_goes_up;
  }
  level.evaluated = std::min(level.sums.size(), kHistory);
  level.sums.erase(level.sums.begin(),
                   level.sums.end() - static_cast<std::ptrdiff_t>(level.evaluated));
}

void AllanCurve::EndStretch() {
  for (std::size_t index = 0; index < levels_.size(); ++index) {
    Evaluate(index);
    Level& level = levels_[index];
    level.sums.clear();
    level.evaluated = 0;
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
