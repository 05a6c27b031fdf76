// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "data/held_samples.h"
#include "truetriad/data/sample_source.h"

namespace truetriad {

/// Readings that follow each other at equal spacings.
struct EvenReadings {
  std::vector<std::int64_t> end_ns;  ///< End of each reading: one spacing after its stamp.
  std::array<std::vector<double>, 3> axes;
};

/// Turns a stream into stretches of equally spaced readings: jitter of the time stamps is ignored,
/// a few missing samples are filled by straight lines, and longer gaps end the stretch.
///
/// The spacing is that of the first thousand samples. If time stamps are so irregular that missing
/// samples cannot be distinguished from late ones, nothing is filled and only long gaps end a
/// stretch.
class EvenStream {
 public:
  /// `add` takes the next readings of a stretch; `end` is called after the last readings of a
  /// stretch.
  EvenStream(std::function<void(const EvenReadings&)> add, std::function<void()> end)
      : add_(std::move(add)), end_(std::move(end)) {}

  void Add(const SampleBlock& block);
  void Finish();  ///< To be called after the last sample.

  /// Spacing of the first samples, ns; known once readings are passed on.
  double typical_ns() const { return typical_ns_; }
  /// Mean spacing over the stretches, ns; 0 if none has two samples or no time passes.
  double spacing_ns() const {
    return intervals_ > 0 ? static_cast<double>(span_ns_) / static_cast<double>(intervals_) : 0.0;
  }
  std::int64_t filled() const { return filled_; }
  std::int64_t breaks() const { return breaks_; }
  bool irregular() const { return irregular_; }

 private:
  void Settle();
  void Process();
  /// Number of samples missing before held sample i; negative: the stretch ends there.
  std::int64_t MissingBefore(std::size_t i) const;
  void Push(double time_ns, const Eigen::Vector3d& reading);
  void HandOver();

  std::function<void(const EvenReadings&)> add_;
  std::function<void()> end_;
  HeldSamples held_;  ///< The first samples until the spacing is known; then the last block.
  EvenReadings even_;
  bool settled_ = false, started_ = false, irregular_ = false;
  double typical_ns_ = 0.0, break_ns_ = 0.0;
  std::int64_t last_ns_ = 0;
  Eigen::Vector3d last_ = Eigen::Vector3d::Zero();
  std::int64_t filled_ = 0, breaks_ = 0, intervals_ = 0, span_ns_ = 0;
};

/// A histogram of sizes with eight bins per octave: the median of any number of sizes is known to 5
/// %, in memory that does not grow.
class SizeHistogram {
 public:
  void Add(double size) { ++bins_[Bin(size)], ++count_; }
  double Median() const;  ///< 0 when there are none.
  std::int64_t CountAbove(double size) const;
  std::int64_t count() const { return count_; }

 private:
  static int Bin(double size);
  std::map<int, std::int64_t> bins_;
  std::int64_t count_ = 0;
};

/// Watches whether one axis rests: the noise within short windows and the steps between their means
/// must be similar throughout. Also counts windows of constant readings, and the extreme readings.
class AxisWatch {
 public:
  /// `window`: samples per window, at least two.
  explicit AxisWatch(std::size_t window) : window_(window) {}

  void Add(std::span<const double> readings, std::span<const std::int64_t> end_ns);
  /// The caller calls this if the next readings do not directly follow the previous ones.
  void Break() { filled_ = 0, last_mean_.reset(); }

  struct Verdict {
    std::int64_t windows = 0;
    std::int64_t disturbed = 0;    ///< Windows with noise or a step far beyond the median.
    std::int64_t worst_ns = 0;     ///< End of the worst disturbed window.
    double sigma = 0.0;            ///< Typical σ within a window, raw unit.
    std::int64_t constant = 0;     ///< Windows in which the readings do not change.
    std::int64_t constant_ns = 0;  ///< End of the first constant window.
    double extreme = 0.0;          ///< The largest or smallest reading, whichever is more frequent.
    std::int64_t at_extreme = 0;   ///< Number of readings with the value `extreme`.
  };
  Verdict Judge() const;

 private:
  /// The variances or the steps of the windows, and the time of the largest one.
  struct Sizes {
    SizeHistogram all;
    double largest = 0.0;
    std::int64_t largest_ns = 0;
    void Add(double size, std::int64_t at_ns);
  };
  struct Extreme {
    double value = 0.0;
    std::int64_t count = 0;
    void Add(const Eigen::Ref<const Eigen::ArrayXd>& readings, double furthest, double sign) {
      if (count == 0 || sign * furthest > sign * value) value = furthest, count = 0;
      if (furthest == value) count += (readings == value).count();
    }
  };
  void FinishWindow(std::int64_t at_ns);

  std::size_t window_, filled_ = 0;
  double origin_ = 0.0, sum_ = 0.0, sum_of_squares_ = 0.0;
  std::optional<double> last_mean_;
  Sizes variances_, steps_;
  std::int64_t constant_ = 0, constant_ns_ = 0;
  Extreme top_, bottom_;
};

/// Detects whether a triad repeats each reading for several samples. If so, all axes change at the
/// same samples and repeat at the same samples.
class HoldWatch {
 public:
  void Add(const EvenReadings& readings);
  /// The caller calls this if the next readings do not directly follow the previous ones.
  void Break() { last_.reset(), is_held_ = false; }
  /// Mean number of samples that a held reading lasts; nullopt if readings are not held.
  std::optional<double> SamplesHeld() const;

 private:
  std::optional<Eigen::Array3d> last_;
  bool is_held_ = false;
  std::int64_t samples_ = 0, any_changes_ = 0, all_changes_ = 0, holds_ = 0;
};

}  // namespace truetriad
