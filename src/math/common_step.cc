// SPDX-License-Identifier: Apache-2.0
#include "math/common_step.h"

#include <algorithm>
#include <cmath>

namespace truetriad {
namespace {

// If a remainder is below this share of the largest distance, it counts as the rounding of doubles.
constexpr double kRounding = 1e-9;
// Least step, as a share of the largest distance: converters have at most 20 bits, 2^-20 = 1e-6.
constexpr double kFinest = 1e-6;
// Fewest distances: so many random whole numbers are all even with probability 2^-kFewest = 1.6 %.
constexpr int kFewest = 6;
// Largest step, as a share of the largest distance: no converter has fewer than 50 steps, so values
// with a larger step are not rounded.
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
