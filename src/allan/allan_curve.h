// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace truetriad {

/// How one averaging factor was evaluated.
struct AllanFactor {
  std::int64_t m = 1;          ///< Averaging factor, in samples; a multiple of `stride`.
  std::int64_t stride = 1;     ///< Number of samples from one second difference to the next.
  std::int64_t terms = 0;      ///< Number of second differences, of all stretches together.
  std::int64_t stretches = 0;  ///< Number of stretches with second differences.
};

/// The overlapping Allan variance of one axis, streamed in memory that grows with the logarithm of
/// the log's length.
///
///   sigma^2(m) = mean of (x_{i+2m} - 2 x_{i+m} + x_i)^2 / (2 m^2),   x_i = sum of y_0 … y_{i-1}
///
/// The factors m begin at 1; there are `per_decade` per decade. Level l has a stride of 2^l
/// samples: a short buffer keeps every 2^l-th sum x. The level evaluates the factors of 64 to 128
/// strides (level 0: all up to 128), rounded to whole strides. Second differences that are less
/// than m/64 apart are nearly equal. Within each stride, only one is therefore computed, which
/// costs less than 0.1 % of the degrees of freedom.
class AllanCurve {
 public:
  explicit AllanCurve(int per_decade = 10) : per_decade_(per_decade) {}

  /// Adds equally spaced readings. They must directly follow the readings added before.
  void Add(std::span<const double> readings);
  /// Ends a stretch: no second difference reaches across its end.
  void EndStretch();

  /// The factors up to a quarter of the longest stretch, with their counts, and the Allan variance
  /// at each of them. Call after EndStretch.
  std::vector<AllanFactor> factors() const;
  Eigen::VectorXd variances() const;
  /// Number of readings in the longest stretch.
  std::int64_t longest_stretch() const { return longest_; }

 private:
  struct Factor : AllanFactor {
    double sum_of_squares = 0.0;
    bool in_stretch = false;  ///< The current stretch has added terms.
  };
  struct Level {
    Level(std::int64_t stride, int per_decade);
    std::vector<double> sums;
    std::size_t filled = 0;     ///< Number of sums in the buffer.
    std::size_t evaluated = 0;  ///< Number of these that were evaluated.
    bool next_goes_up = false;  ///< The next sum is passed to the next level; every second sum is.
    std::vector<Factor> factors;
  };

  /// Adds every `step`-th of `sums` to the buffer of a level.
  void Push(std::size_t level, std::span<const double> sums, std::size_t step);
  void Evaluate(std::size_t level);
  std::vector<Factor> UsedFactors() const;

  int per_decade_;
  std::deque<Level> levels_;      // A deque, so that levels stay in place while others are added.
  std::optional<double> offset_;  ///< Subtracted from each reading, so that the sum stays small.
  double sum_ = 0.0;
  std::int64_t stretch_ = 0, longest_ = 0;
};

}  // namespace truetriad
