// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

namespace truetriad {

/// How a thermometer reports, told from its readings as they stream by.
class ThermometerWatch {
 public:
  void Note(std::span<const std::int64_t> time_ns, std::span<const double> degc);

  /// What all changes between readings are multiples of: the smallest of them, and of the
  /// differences between two that follow each other, degC; 0: none yet.
  double step_degc() const { return step_degc_; }
  /// How long each reading is repeated, where it is read at regular times and goes by several steps
  /// from one to the next; 0: it is not.
  double hold_s() const;

 private:
  /// Times between changes, four bins an octave from a microsecond on.
  static constexpr int kChangeBins = 160;

  double step_degc_ = 0.0;
  double last_degc_ = std::numeric_limits<double>::quiet_NaN();
  std::int64_t last_change_ns_ = 0;
  double last_change_degc_ = 0.0;
  bool has_changed_ = false;
  std::array<std::int64_t, kChangeBins> gaps_{};
  std::array<double, kChangeBins> gap_sum_s_{};
  std::array<std::int64_t, kChangeBins> gap_rows_{};
  std::int64_t rows_ = 0;  ///< Since the last change.
  std::int64_t changes_ = 0;
  double change_sum_degc_ = 0.0;
};

/// Readings of a thermometer that is read every `hold_s` and repeated in between, each at the time
/// it was taken: where the means of cells of time change. `time_s` increases in equal steps, or
/// nearly.
struct TakenReadings {
  std::vector<double> time_s, degc;
};
TakenReadings ReadingsAsTaken(const std::vector<double>& time_s,
                              const std::vector<double>& degc,
                              double hold_s);

/// Neighbours on each side that say where a cell of a sweep should be: two spikes beside each other
/// do not move the median of five.
inline constexpr std::size_t kNeighbours = 5;

/// Cells whose temperature is as far from their neighbours as no chamber goes: a disturbed bus.
std::vector<bool> TemperatureSpikes(const std::vector<double>& degc, double step_degc);

/// Cells [first, second) that repeat the one before, after which the temperature is further than
/// any chamber goes from a cell to the next: the thermometer was stuck.
std::vector<std::pair<std::size_t, std::size_t>> StuckTemperatures(
    const std::vector<double>& time_s, const std::vector<double>& degc);

/// `degc` with straight lines in place of what is marked.
std::vector<double> Bridged(const std::vector<double>& time_s,
                            const std::vector<double>& degc,
                            const std::vector<bool>& marked);

}  // namespace truetriad
