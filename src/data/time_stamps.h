// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "truetriad/data/static_pose.h"

namespace truetriad {

/// The stamps of one stream, which never decrease.
struct Stamps {
  std::span<const std::int64_t> time_ns;
  /// Row of each sample in the file; needed only if `window` is over 1. The sensor's FIFO was then
  /// read in windows of so many rows. The last sample of a window has a stamp; the times of the
  /// others are interpolated up to it.
  std::span<const std::int64_t> row{};
  std::int64_t window = 1;

  std::size_t size() const { return time_ns.size(); }
  std::int64_t operator[](std::size_t k) const { return time_ns[k]; }
  std::int64_t front() const { return time_ns.front(); }
  bool are_windows() const { return window > 1; }
  /// Number of a sample; samples that are known to be lost are counted, too.
  std::int64_t Number(std::size_t k) const {
    return are_windows() ? row[k] : static_cast<std::int64_t>(k);
  }
  /// Whether the sample is the last of its window. In an incomplete last window, no sample counts
  /// as the last, as the stamp may be that of a missing sample.
  bool EndsWindow(std::size_t k) const {
    if (k + 1 == size()) return (row[k] + 1) % window == 0;
    return row[k + 1] / window != row[k] / window;
  }
  /// Whether the sample's time is a stamp, not interpolated up to the last sample of its window.
  bool IsStamped(std::size_t k) const { return !are_windows() || EndsWindow(k); }
};

/// The usual interval of two or more stamps: the median step or, if several samples come at once,
/// the median interval over many steps, so that neither bursts nor gaps matter.
double UsualSpacing(std::span<const std::int64_t> stamps_ns);

/// Where the samples of one stream lie in time if its sensor takes them at even intervals:
///
///   stamp_k = origin + period x_k + drift(x_k) + late_k
///
/// x counts samples, including lost ones. drift is the slow drift of one clock against another;
/// late is jitter. A long gap ends a piece; the next piece has its own origin and count.
struct EvenTimes {
  StampKind kind = StampKind::kRegular;
  double period_ns = 0.0;
  double jitter_ns = 0.0;             ///< RMS of stamp − time, of samples with a stamp.
  double lost = 0.0;                  ///< Number of lost samples.
  bool are_many_lost = false;         ///< If true, stamps may be another clock's ticks.
  std::vector<std::int64_t> time_ns;  ///< One per stamp, in order; empty: too few stamps.

  /// True if stamps scatter about even times enough to matter, and their errors do not accumulate.
  bool AreEvident() const {
    return kind == StampKind::kJittered || kind == StampKind::kInBursts ||
           kind == StampKind::kOnTicks;
  }
};

/// Fits even times to stamps. `none_lost`: treats no sample as lost, even if regular stamps suggest
/// that many are. For example, if a clock with ticks of 15.6 ms stamps the samples of a 20 ms
/// sensor, the stamps skip a tick now and then.
EvenTimes FitEvenTimes(const Stamps& stamps, bool none_lost = false);

/// RMS jitter that matters, as a share of the sampling interval. At 100 Hz it changes the angle of
/// a turn, 90 deg in a second, by 1e-4 rad: the jitter times 0.52 rad/s, the root of the sum of
/// squared changes of rate. The noise of a low-cost gyroscope changes the angle by about as much.
inline constexpr double kJitterThatMatters = 0.02;

/// Checks the stamps of one stream as they are read: compares each 256 stamps with a straight line.
class StampWatch {
 public:
  /// Whether the next stamps are even enough to be used as they are.
  bool AreEven(std::span<const std::int64_t> stamps_ns);
  /// RMS of stamp − line, s.
  double jitter_s() const;

 private:
  /// Sums of one line over the offsets stamp − first stamp − period × number.
  struct Line {
    std::size_t count = 0;
    std::int64_t first_ns = 0;
    double off = 0.0, offs = 0.0, product = 0.0;  // Sums of offset, offset² and offset × number.
  };
  /// Adds stamps that continue the line.
  void Extend(std::span<const std::int64_t> stamps_ns);
  void CloseLine();

  double period_ns_ = 0.0;
  std::int64_t last_ns_ = 0;
  Line line_;
  double squares_ns2_ = 0.0, freedom_ = 0.0;  // Over all lines.
};

/// Shows whether readings were taken at their stamps. If they were, a reading lies on the straight
/// line between its two neighbours, at its time,
///
///   y_k − (y_k−1 + y_k+1) / 2 = β (a − 1/2) (y_k+1 − y_k−1),   a = (t_k − t_k−1) / (t_k+1 − t_k−1)
///
/// with β = 1 for true stamps and 0 for readings taken at even times.
struct StampShare {
  double beta = 0.0, sigma = 0.0;  ///< If σ is 0, β is unknown.

  bool StampsAreTrue() const { return sigma > 0.0 && beta - 0.5 > 2.0 * sigma; }
  bool ReadingsAreEven() const { return sigma > 0.0 && 0.5 - beta > 2.0 * sigma; }
};
StampShare ShareOfStamps(std::span<const std::int64_t> stamps_ns,
                         std::span<const double> x,
                         std::span<const double> y,
                         std::span<const double> z,
                         double period_ns);

}  // namespace truetriad
