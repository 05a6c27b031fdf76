// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <initializer_list>

#include <Eigen/Core>

namespace truetriad {

namespace ziggurat {

// One byte of the random word selects a layer. With 256 layers, 99 % of the numbers need only one
// product.
inline constexpr int kLayers = 256;
/// Right ends of the layers, widest first, and the density exp(-x^2/2) there.
struct Table {
  std::array<double, kLayers + 1> edge{};
  std::array<double, kLayers + 1> density{};
};
extern const Table kTable;

}  // namespace ziggurat

// The polar method is not used: its std::log does not give the same bits everywhere, and `simulate`
// would take 22 % more processor time (four hours of nine axes at rest). The distributions of std
// promise no sequence at all.

/// A generator for hundreds of millions of numbers: xoshiro256++ (Blackman and Vigna, ACM TOMS 47,
/// 2021) and, for normals, the ziggurat of Marsaglia and Tsang (J. Stat. Software 5(8), 2000) with
/// 256 layers and one word per number. It uses integer arithmetic, + - * / and square roots in
/// double, and no library function, so that a seed gives the same numbers with every compiler that
/// keeps to IEEE 754 and does not fuse multiplications with additions.
class FastRandom {
 public:
  /// `key`: the seed, followed by numbers for the purpose. Each key starts an independent sequence.
  explicit FastRandom(std::initializer_list<std::uint64_t> key);

  std::uint64_t Bits() {
    const std::uint64_t result = std::rotl(state_[0] + state_[3], 23) + state_[0];
    const std::uint64_t shifted = state_[1] << 17U;
    state_[2] ^= state_[0];
    state_[3] ^= state_[1];
    state_[1] ^= state_[2];
    state_[0] ^= state_[3];
    state_[2] ^= shifted;
    state_[3] = std::rotl(state_[3], 45);
    return result;
  }

  /// Uniform on [0, 1), 53 bits.
  double Uniform() { return static_cast<double>(Bits() >> 11U) * 0x1.0p-53; }
  /// Integer on [0, count); count > 0, far below 2^53.
  int Below(int count) { return static_cast<int>(Uniform() * count); }

  /// Standard normal.
  double Normal() {
    const std::uint64_t bits = Bits();
    const std::size_t layer = bits & (ziggurat::kLayers - 1);
    // The sign is set without a branch, since the processor would mispredict half of the branches.
    const std::uint64_t sign = (bits << 55U) & (std::uint64_t{1} << 63U);
    const double x = static_cast<double>(static_cast<std::int64_t>(bits >> 11U)) * 0x1.0p-53 *
                     ziggurat::kTable.edge[layer];
    const double size = x < ziggurat::kTable.edge[layer + 1] ? x : Outside(layer, x);
    return std::bit_cast<double>(std::bit_cast<std::uint64_t>(size) ^ sign);
  }

  Eigen::Vector3d Normal3() {
    const double x = Normal();
    const double y = Normal();
    return {x, y, Normal()};
  }

 private:
  /// The absolute value of a normal number; called if the point `x` in `layer` may be above the
  /// density.
  double Outside(std::size_t layer, double x);

  std::array<std::uint64_t, 4> state_{};
};

}  // namespace truetriad
