// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "allan/allan_rest.h"

namespace truetriad {

/// Watches whether one axis goes on: windows in which the readings change far less from one to the
/// next than elsewhere are those of a frozen sensor, or of samples that were lost and repeated.
class FreezeWatch {
 public:
  /// Adds readings that follow the last ones; `start` is the place of the first in the log.
  void Add(std::span<const double> readings, std::int64_t start_ns, double spacing_ns);
  /// The next readings do not follow.
  void Break() { filled_ = 0, last_.reset(); }

  static constexpr std::int64_t kWindow = 256;  ///< Samples.
  struct Verdict {
    std::int64_t windows = 0;
    std::int64_t frozen = 0;
    double typical = 0.0;  ///< Change of the other windows from reading to reading, RMS, raw unit.
    std::int64_t first_zero_ns = -1;  ///< End of the first window without any change; -1: none.
  };
  Verdict Judge() const;

 private:
  std::optional<double> last_;
  std::int64_t filled_ = 0;
  double sum_of_squares_ = 0.0;
  std::int64_t zeros_ = 0, first_zero_ns_ = -1;
  SizeHistogram changes_;  ///< Mean squares of windows that change at all.
};

/// Watches whether the readings of a triad are each held for several samples: then all axes change
/// together, and repeat together.
class HoldWatch {
 public:
  /// Adds readings that follow the last ones.
  void Add(const std::array<std::span<const double>, 3>& readings);
  void Break() { last_.reset(), is_held_ = false; }

  /// Mean number of samples that a held reading lasts; nullopt: readings are not held.
  std::optional<double> SamplesHeld() const;

 private:
  std::optional<std::array<double, 3>> last_;
  bool is_held_ = false;
  std::int64_t samples_ = 0, any_changes_ = 0, all_changes_ = 0, holds_ = 0;
};

/// Counts how often an axis reads its own extremes.
class LimitWatch {
 public:
  void Add(std::span<const double> readings);

  std::int64_t most() const { return std::max(at_top_, at_bottom_); }
  double limit() const { return at_top_ >= at_bottom_ ? top_ : bottom_; }

 private:
  double top_ = 0.0, bottom_ = 0.0;
  std::int64_t at_top_ = 0, at_bottom_ = 0;
};

}  // namespace truetriad
