// SPDX-License-Identifier: Apache-2.0
#include "math/fast_random.h"

#include <cmath>

namespace truetriad {
namespace {

// Start r of the tail, and the area of each of 256 layers. Marsaglia and Tsang 2000.
constexpr double kTailStart = 3.6541528853610088;
constexpr double kLayerArea = 0.00492867323399;  // r exp(-r^2/2) + the area of the tail.

/// exp(x) for x in [-40, 0]: Taylor's series at x / 64, squared six times. Error below 1e-14.
constexpr double Exp(double x) {
  // 64 = 2^6.
  constexpr int kSquarings = 6;
  const double reduced = x / (1 << kSquarings);
  double sum = 1.0;
  for (int term = 16; term >= 1; --term) sum = 1.0 + reduced / term * sum;
  for (int i = 0; i < kSquarings; ++i) sum *= sum;
  return sum;
}

constexpr double Density(double x) { return Exp(-0.5 * x * x); }

/// ln(x) for x in (0, 1], through atanh after x has been brought to [0.7, 1.5) by powers of two.
constexpr double Log(double x) {
  // ln 2.
  constexpr double kLn2 = 0.693147180559945309417;
  int halvings = 0;
  for (; x < 0.7; x *= 2.0) ++halvings;
  const double ratio = (x - 1.0) / (x + 1.0);  // Within 0.2: terms fall by 25 each.
  double sum = 0.0;
  for (int power = 25; power >= 1; power -= 2) sum = sum * ratio * ratio + 1.0 / power;
  return 2.0 * ratio * sum - halvings * kLn2;
}

/// Square root by Newton's iteration, from above.
constexpr double Sqrt(double x) {
  double root = x > 1.0 ? x : 1.0;
  for (double next = 0.5 * (root + x / root); next < root; next = 0.5 * (root + x / root)) {
    root = next;
  }
  return root;
}

constexpr ziggurat::Table MakeTable() {
  ziggurat::Table table;
  // The lowest layer is stored as a box with the area of the layer and the tail. The part of the
  // box beyond the start of the tail represents the tail.
  table.edge[0] = kLayerArea / Density(kTailStart);
  table.edge[1] = kTailStart;
  for (std::size_t i = 2; i < ziggurat::kLayers; ++i) {
    const double below = table.edge[i - 1];
    table.edge[i] = Sqrt(-2.0 * Log(kLayerArea / below + Density(below)));
  }
  table.edge[ziggurat::kLayers] = 0.0;
  for (std::size_t i = 0; i <= ziggurat::kLayers; ++i) table.density[i] = Density(table.edge[i]);
  return table;
}

/// splitmix64 (Steele, Lea and Flood, OOPSLA 2014): each bit of the result depends on all of `x`.
std::uint64_t Mix(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15U;
  x = (x ^ (x >> 30U)) * 0xbf58476d1ce4e5b9U;
  x = (x ^ (x >> 27U)) * 0x94d049bb133111ebU;
  return x ^ (x >> 31U);
}

}  // namespace

constinit const ziggurat::Table ziggurat::kTable = MakeTable();

FastRandom::FastRandom(std::initializer_list<std::uint64_t> key) {
  std::uint64_t hash = key.size();
  for (const std::uint64_t word : key) hash = Mix(hash ^ Mix(word));
  for (std::uint64_t& word : state_) word = hash = Mix(hash);
}

double FastRandom::Outside(std::size_t layer, double x) {
  const ziggurat::Table& table = ziggurat::kTable;
  for (;;) {
    if (x < table.edge[layer + 1]) return x;
    if (layer == 0) {
      // Tail: G. Marsaglia, Technometrics 6(1), 1964.
      for (;;) {
        const double beyond = -Log(1.0 - Uniform()) / kTailStart;
        if (-2.0 * Log(1.0 - Uniform()) > beyond * beyond) return kTailStart + beyond;
      }
    }
    const double low = table.density[layer];
    const double high = table.density[layer + 1];
    if (low + Uniform() * (high - low) < Density(x)) return x;
    const std::uint64_t bits = Bits();
    layer = bits & (ziggurat::kLayers - 1);
    x = static_cast<double>(bits >> 11U) * 0x1.0p-53 * table.edge[layer];
  }
}

}  // namespace truetriad
