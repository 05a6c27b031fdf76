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
  /// Of each its row in the file, where the sensor's FIFO was read in windows of so many rows: the
  /// last sample of a window is stamped, and the others evenly up to it. Unused where window is 1.
  std::span<const std::int64_t> row{};
  std::int64_t window = 1;

  std::size_t size() const { return time_ns.size(); }
  std::int64_t operator[](std::size_t k) const { return time_ns[k]; }
  std::int64_t front() const { return time_ns.front(); }
  bool are_windows() const { return window > 1; }
  /// Of a sample, by which others that are known to be lost are counted.
  std::int64_t Number(std::size_t k) const {
    return are_windows() ? row[k] : static_cast<std::int64_t>(k);
  }
  /// No later sample of its window is there. A last window that is cut has no end: its time may be
  /// that of a sample that is missing, or not.
  bool EndsWindow(std::size_t k) const {
    if (k + 1 == size()) return (row[k] + 1) % window == 0;
    return row[k + 1] / window != row[k] / window;
  }
  /// Its time is not made from that of the last sample of its window.
  bool IsStamped(std::size_t k) const { return !are_windows() || EndsWindow(k); }
};

/// The usual interval of two stamps or more: the median, or where several come at a time that of
/// many steps, so that neither bursts nor gaps count.
double UsualSpacing(std::span<const std::int64_t> stamps_ns);

/// Where the samples of one stream lie in time if its sensor takes them at even intervals:
///
///   stamp_k = origin + period x_k + wander(x_k) + late_k
///
/// x counts samples, those that were lost too; the wander is that of two clocks and slow; what is
/// left of a stamp is jitter. Longer gaps end a piece, in which origin and count begin anew.
struct EvenTimes {
  StampKind kind = StampKind::kRegular;
  double period_ns = 0.0;
  double jitter_ns = 0.0;      ///< RMS of stamp − time; of windows, of their last samples.
  double lost = 0.0;           ///< Samples.
  bool are_many_lost = false;  ///< Samples, so that their stamps may be another clock's ticks.
  std::vector<std::int64_t> time_ns;  ///< One a stamp, in order; empty: too few to tell.

  /// Stamps scatter about even times, enough to matter, and stay with them however long.
  bool AreEvident() const {
    return kind == StampKind::kJittered || kind == StampKind::kInBursts ||
           kind == StampKind::kOnTicks;
  }
};

/// `none_lost`: of stamps that look as if many samples were lost from regular times, supposing that
/// none is: a clock of 15.6 ms that jumps over a tick now and then, as a sensor of 20 ms makes it.
EvenTimes FitEvenTimes(const Stamps& stamps, bool none_lost = false);

/// Of RMS jitter, the share of the sampling interval that matters: at 100 Hz a turn by 90 deg in a
/// second is off by 1e-4 rad of it (jitter times the root of the sum of squared changes of rate,
/// 0.52 rad/s), about what the noise of a consumer gyroscope makes.
inline constexpr double kJitterThatMatters = 0.02;

/// Looks at the stamps of one stream as they pass by, along lines through 256 of them.
class StampWatch {
 public:
  /// Whether the next stamps are even enough to be used as they are.
  bool AreEven(std::span<const std::int64_t> stamps_ns);
  /// RMS about the lines.
  double jitter_s() const;

 private:
  /// Sums over what its stamps are off, stamp − first − period × number.
  struct Line {
    std::size_t count = 0;
    std::int64_t first_ns = 0;
    double off = 0.0, offs = 0.0, product = 0.0;  // Of product: off × number.
  };
  /// Stamps that follow on the line.
  void Extend(std::span<const std::int64_t> stamps_ns);
  void CloseLine();

  double period_ns_ = 0.0;
  std::int64_t last_ns_ = 0;
  Line line_;
  double squares_ns2_ = 0.0, freedom_ = 0.0;  // Over all lines.
};

/// Whether readings were taken when they were stamped, as far as they show it. A reading between
/// two others is where a straight line is at its time,
///
///   y_k − (y_k−1 + y_k+1) / 2 = β (a − 1/2) (y_k+1 − y_k−1),   a = (t_k − t_k−1) / (t_k+1 − t_k−1)
///
/// with β = 1 for stamps that are true, 0 for readings taken evenly.
struct StampShare {
  double beta = 0.0, sigma = 0.0;  ///< σ 0: nothing shows it.

  bool StampsAreTrue() const { return sigma > 0.0 && beta - 0.5 > 2.0 * sigma; }
  bool ReadingsAreEven() const { return sigma > 0.0 && 0.5 - beta > 2.0 * sigma; }
};
StampShare ShareOfStamps(std::span<const std::int64_t> stamps_ns,
                         std::span<const double> x,
                         std::span<const double> y,
                         std::span<const double> z,
                         double period_ns);

}  // namespace truetriad
