// SPDX-License-Identifier: Apache-2.0
#include "math/common_step.h"

#include <algorithm>
#include <cmath>

namespace truetriad {
namespace {

// Of the largest distance: what binary numbers leave of decimal ones; the finest step that is told.
constexpr double kRounding = 1e-9;
// 20 bits, the finest converters of these sensors.
constexpr double kFinest = 1e-6;
// Numbers drawn at random share a factor of two with a chance of 2^-kFewest.
constexpr int kFewest = 6;
// Of the range of a sensor: readings of a few exact values are no readings.
constexpr double kCoarsest = 0.02;

double CommonDivisor(double a, double b, double rounding) {
  while (b > rounding) {
    const double rest = std::fmod(a, b);
    a = b;
    b = a - rest > rounding ? rest : 0.0;
  }
  return a;
}

}  // namespace

double CommonStep(const std::vector<double>& distances) {
  if (distances.empty()) return 0.0;
  const double largest = *std::max_element(distances.begin(), distances.end());
  double step = 0.0;
  int count = 0;
  for (const double distance : distances) {
    if (!(distance > kRounding * largest)) continue;
    ++count;
    step = CommonDivisor(distance, step, kRounding * largest);
    if (step < kFinest * largest) return 0.0;
  }
  return count < kFewest || step > kCoarsest * largest ? 0.0 : step;
}

}  // namespace truetriad
