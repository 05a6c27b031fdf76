// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "allan/allan_theory.h"

namespace truetriad {

/// The averaging factors evaluated: `per_decade` a decade from 1 on, rounded so that those above
/// 128 are multiples of their stride, a power of two between m/128 and m/64.
std::vector<AllanFactor> AllanFactorsUpTo(std::int64_t largest, int per_decade);

/// The overlapping Allan variance of one axis, streamed in memory that grows with the logarithm of
/// the log's length.
///
///   sigma^2(m) = mean of (x_{i+2m} - 2 x_{i+m} + x_i)^2 / (2 m^2),   x_i = sum of y_0 … y_{i-1}
///
/// Level l keeps the sums x at every 2^l-th sample in a short buffer and serves the factors whose
/// stride is 2^l. Second differences that are only m/64 apart say the same again, so that those
/// left out cost less than 0.1 % of the degrees of freedom.
class AllanCurve {
 public:
  explicit AllanCurve(int per_decade) : per_decade_(per_decade) {}

  /// Adds readings, equally spaced and following the last ones.
  void Add(std::span<const double> readings);
  /// Nothing is differenced across this point.
  void EndStretch();

  /// Factors of which a quarter of the longest stretch holds one, with their counts, and the
  /// variances. Call after EndStretch.
  std::vector<AllanFactor> factors() const;
  Eigen::VectorXd variances() const;
  /// Readings in the longest stretch.
  std::int64_t longest_stretch() const { return longest_; }

 private:
  static constexpr std::int64_t kLargestStrides = 128;  ///< Largest factor, in strides.
  static constexpr std::size_t kHistory = 2 * kLargestStrides;
  static constexpr std::size_t kBatch = 2048;

  struct Factor {
    AllanFactor use;
    double sum_of_squares = 0.0;
    bool in_stretch = false;  ///< The current stretch has added terms.
  };
  struct Level {
    std::array<double, kHistory + kBatch> sums;
    std::size_t filled = 0;     ///< Sums in the buffer.
    std::size_t evaluated = 0;  ///< Of these, those that are history.
    bool next_is_kept = false;  ///< Every second sum, not the first, goes up to the next level.
    std::size_t first_factor = 0, end_factor = 0;
  };

  void Push(std::size_t level, std::span<const double> sums);
  void Evaluate(Level* level);
  Level& LevelAt(std::size_t level);

  int per_decade_;
  std::deque<Level> levels_;  // A deque, so that levels stay in place while others are added.
  std::vector<Factor> factors_;
  bool started_ = false;  ///< The stretch has its first sum.
  bool has_offset_ = false;
  double offset_ = 0.0;  ///< Taken off each reading, so that the sum stays small.
  double sum_ = 0.0;
  std::int64_t stretch_ = 0, longest_ = 0;
};

}  // namespace truetriad
