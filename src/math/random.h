// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <random>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace truetriad {

/// Seeded random numbers. This class defines their sequence, while std::normal_distribution would
/// leave it to the library; only std::log may differ in its last bit between libraries.
class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}

  /// Uniform on [0, 1), 53 bits.
  double Uniform() { return static_cast<double>(engine_() >> 11U) * 0x1.0p-53; }
  double Uniform(double low, double high) { return low + (high - low) * Uniform(); }
  /// Integer on [0, count).
  int Below(int count) { return static_cast<int>(Uniform() * count); }

  /// Standard normal, by Marsaglia's polar method.
  double Normal();
  Eigen::Vector3d Normal3() {
    const double x = Normal();
    const double y = Normal();
    return {x, y, Normal()};
  }

  /// Uniform over SO(3): a normalised four-dimensional normal vector.
  Eigen::Quaterniond Rotation();

 private:
  std::mt19937_64 engine_;
  double spare_ = 0.0;
  bool has_spare_ = false;
};

}  // namespace truetriad
