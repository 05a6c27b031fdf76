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
  std::int64_t stride = 1;     ///< Samples from one second difference to the next.
  std::int64_t terms = 0;      ///< Second differences, of all stretches together.
  std::int64_t stretches = 0;  ///< Stretches that hold at least one.
};

/// The overlapping Allan variance of one axis, streamed in memory that grows with the logarithm of
/// the log's length.
///
///   sigma^2(m) = mean of (x_{i+2m} - 2 x_{i+m} + x_i)^2 / (2 m^2),   x_i = sum of y_0 … y_{i-1}
///
/// There are `per_decade` factors m a decade from 1 on. Level l keeps the sums x at every 2^l-th
/// sample in a short buffer and serves the factors whose stride is 2^l: those between 64 and 128
/// strides, rounded to multiples of the stride. Second differences that are only m/64 apart are
/// nearly equal, so that those left out cost less than 0.1 % of the degrees of freedom.
class AllanCurve {
 public:
  explicit AllanCurve(int per_decade = 10) : per_decade_(per_decade) {}

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
  struct Factor : AllanFactor {
    double sum_of_squares = 0.0;
    bool in_stretch = false;  ///< The current stretch has added terms.
  };
  struct Level {
    Level(std::int64_t stride, int per_decade);
    std::vector<double> sums;
    std::size_t filled = 0;     ///< Sums in the buffer.
    std::size_t evaluated = 0;  ///< Of these, those that are history.
    bool next_goes_up = false;  ///< Every second sum, not the first, goes up to the next level.
    std::vector<Factor> factors;
  };

  /// Adds every `step`-th of the sums.
  void Push(std::size_t level, std::span<const double> sums, std::size_t step);
  void Evaluate(std::size_t level);
  std::vector<Factor> UsedFactors() const;

  int per_decade_;
  std::deque<Level> levels_;      // A deque, so that levels stay in place while others are added.
  std::optional<double> offset_;  ///< Taken off each reading, so that the sum stays small.
  double sum_ = 0.0;
  std::int64_t stretch_ = 0, longest_ = 0;
};

}  // namespace truetriad
