// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>
#include <span>
#include <utility>

namespace truetriad {

// So many readings of a stream show its smallest step: with noise σ of a hundred steps neighbours
// differ by one step once in √π σ = 177 times.
inline constexpr std::int64_t kStepReadings = 20000;

// The lesser of `step` and the smallest difference between readings that follow each other, from
// `before` on. What is smaller than 1e-9 of the `largest` reading is rounding of its conversion.
inline double SmallestStep(std::span<const double> values,
                           double before,
                           double largest,
                           double step) {
  const double rounding = 1e-9 * largest;
  for (const double value : values) {
    const double difference = std::abs(value - std::exchange(before, value));
    step = difference > rounding && difference < step ? difference : step;
  }
  return step;
}

}  // namespace truetriad
