// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

namespace truetriad {

/// Counts of positive numbers by size, eight bins an octave, so that the median of any number of
/// them is known to 5 % in fixed memory.
class SizeHistogram {
 public:
  void Add(double value);
  /// 0 when there are none.
  double Median() const;
  std::int64_t CountAbove(double value) const;
  std::int64_t count() const { return count_; }

 private:
  static constexpr int kLowestExponent = -300, kHighestExponent = 300, kBinsAnOctave = 8;
  static constexpr std::size_t kBins =
      static_cast<std::size_t>(kHighestExponent - kLowestExponent) * kBinsAnOctave;
  static std::size_t Bin(double value);

  std::array<std::int32_t, kBins> bins_{};
  std::int64_t count_ = 0;
};

/// Watches whether one axis rests: the noise within short windows and the steps of their means must
/// be alike throughout.
class RestWatch {
 public:
  /// `window`: samples a window, at least two.
  explicit RestWatch(std::int64_t window) : window_(window) {}

  /// Adds readings that follow the last ones; `start` is the place of the first in the log.
  void Add(std::span<const double> readings, std::int64_t start_ns, double spacing_ns);
  /// The next readings do not follow.
  void Break() { filled_ = 0, last_mean_.reset(); }

  struct Verdict {
    std::int64_t windows = 0;
    std::int64_t disturbed = 0;  ///< Windows with noise or a step far beyond the median.
    std::int64_t worst_ns = 0;   ///< When the furthest of them was.
    double largest_step = 0.0;   ///< Between means of neighbouring windows, raw unit.
    double sigma = 0.0;          ///< Typical within a window, raw unit.
  };
  Verdict Judge() const;

 private:
  void FinishWindow(std::int64_t at_ns);

  std::int64_t window_;
  std::int64_t filled_ = 0;
  double origin_ = 0.0, sum_ = 0.0, sum_of_squares_ = 0.0;
  std::optional<double> last_mean_;
  SizeHistogram variances_, steps_;
  struct Largest {
    double value = 0.0;
    std::int64_t at_ns = 0;
  };
  Largest largest_variance_, largest_step_;
};

}  // namespace truetriad
