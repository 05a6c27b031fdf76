// SPDX-License-Identifier: Apache-2.0
#include "allan/allan_curve.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace truetriad {
namespace {

// Chosen: neighbouring differences share all but a 128th of their samples, so that further ones
// would tell nothing new.
constexpr std::int64_t kStrides = 128;
/// Sums handed to the levels at a time.
constexpr std::size_t kSumsAtOnce = 1024;
/// Shortest share of a stretch: a factor needs four times itself.
constexpr std::int64_t kFactorsInStretch = 4;

std::int64_t StrideOf(std::int64_t m) {
  const auto strides = static_cast<std::uint64_t>((m + kStrides - 1) / kStrides);
  return static_cast<std::int64_t>(std::bit_ceil(strides));
}

}  // namespace

std::vector<AllanFactor> AllanFactorsUpTo(std::int64_t largest, int per_decade) {
  std::vector<AllanFactor> factors;
  for (int k = 0;; ++k) {
    std::int64_t m = std::llround(std::pow(10.0, static_cast<double>(k) / per_decade));
    const std::int64_t stride = StrideOf(m);
    m = (m + stride / 2) / stride * stride;
    if (m > largest) return factors;
    if (!factors.empty() && factors.back().m == m) continue;
    factors.push_back({.m = m, .stride = StrideOf(m)});
  }
}

AllanCurve::Level& AllanCurve::LevelAt(std::size_t level) {
  while (levels_.size() <= level) {
    const std::int64_t stride = std::int64_t{1} << levels_.size();
    Level& added = levels_.emplace_back();
    added.first_factor = factors_.size();
    for (const AllanFactor& factor : AllanFactorsUpTo(kStrides * stride, per_decade_)) {
      if (factor.stride == stride) factors_.push_back({.use = factor});
    }
    added.end_factor = factors_.size();
  }
  return levels_[level];
}

void AllanCurve::Add(std::span<const double> readings) {
  if (readings.empty()) return;
  if (!has_offset_) {
    // A reading near the middle; one of them, so that sums of whole counts stay exact.
    std::vector<double> first(
        readings.begin(),
        readings.begin() + static_cast<std::ptrdiff_t>(std::min(readings.size(), kSumsAtOnce)));
    std::nth_element(
        first.begin(), first.begin() + static_cast<std::ptrdiff_t>(first.size() / 2), first.end());
    offset_ = first[first.size() / 2];
    has_offset_ = true;
  }
  if (!started_) {
    sum_ = 0.0;
    Push(0, {&sum_, 1});
    started_ = true;
  }
  stretch_ += static_cast<std::int64_t>(readings.size());
  std::array<double, kSumsAtOnce> sums;
  while (!readings.empty()) {
    const std::size_t count = std::min(readings.size(), kSumsAtOnce);
    for (std::size_t i = 0; i < count; ++i) sums[i] = sum_ += readings[i] - offset_;
    Push(0, {sums.data(), count});
    readings = readings.subspan(count);
  }
}

void AllanCurve::Push(std::size_t index, std::span<const double> sums) {
  Level& level = LevelAt(index);
  std::array<double, kSumsAtOnce> kept;
  std::size_t kept_count = 0;
  for (const double sum : sums) {
    if (level.next_is_kept) kept[kept_count++] = sum;
    level.next_is_kept = !level.next_is_kept;
  }
  while (!sums.empty()) {
    if (level.filled == level.sums.size()) Evaluate(&level);
    const std::size_t count = std::min(sums.size(), level.sums.size() - level.filled);
    std::copy_n(
        sums.begin(), count, level.sums.begin() + static_cast<std::ptrdiff_t>(level.filled));
    level.filled += count;
    sums = sums.subspan(count);
  }
  if (kept_count > 0) Push(index + 1, {kept.data(), kept_count});
}

void AllanCurve::Evaluate(Level* level) {
  using Sums = Eigen::Map<const Eigen::ArrayXd>;
  for (std::size_t f = level->first_factor; f < level->end_factor; ++f) {
    Factor& factor = factors_[f];
    const auto k = static_cast<std::size_t>(factor.use.m / factor.use.stride);
    const std::size_t begin = std::max(level->evaluated, 2 * k);
    if (begin >= level->filled) continue;
    const auto count = static_cast<Eigen::Index>(level->filled - begin);
    const double* const last = level->sums.data() + begin;
    factor.sum_of_squares +=
        (Sums(last, count) - 2.0 * Sums(last - k, count) + Sums(last - 2 * k, count))
            .square()
            .sum();
    factor.use.terms += count;
    factor.use.stretches += factor.in_stretch ? 0 : 1;
    factor.in_stretch = true;
  }
  const std::size_t history = std::min(level->filled, kHistory);
  std::copy(level->sums.begin() + static_cast<std::ptrdiff_t>(level->filled - history),
            level->sums.begin() + static_cast<std::ptrdiff_t>(level->filled),
            level->sums.begin());
  level->filled = history;
  level->evaluated = history;
}

void AllanCurve::EndStretch() {
  for (Level& level : levels_) {
    Evaluate(&level);
    level.filled = level.evaluated = 0;
    level.next_is_kept = false;
  }
  for (Factor& factor : factors_) factor.in_stretch = false;
  longest_ = std::max(longest_, stretch_);
  stretch_ = 0;
  started_ = false;
}

std::vector<AllanFactor> AllanCurve::factors() const {
  std::vector<AllanFactor> used;
  for (const Factor& factor : factors_) {
    if (kFactorsInStretch * factor.use.m <= longest_ && factor.use.terms > 0) {
      used.push_back(factor.use);
    }
  }
  return used;
}

Eigen::VectorXd AllanCurve::variances() const {
  const std::vector<AllanFactor> used = factors();
  Eigen::VectorXd variances(static_cast<Eigen::Index>(used.size()));
  for (std::size_t i = 0; i < used.size(); ++i) {
    const auto m = static_cast<double>(used[i].m);
    variances[static_cast<Eigen::Index>(i)] =
        factors_[i].sum_of_squares / static_cast<double>(used[i].terms) / (2.0 * m * m);
  }
  return variances;
}

}  // namespace truetriad
