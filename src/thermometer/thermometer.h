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

/// Finds the step and the repetition of a thermometer's readings as they stream by.
class ThermometerWatch {
 public:
  void Note(std::span<const std::int64_t> time_ns, std::span<const double> degc);

  /// Step of the readings, degC: the smallest change between two readings, or the smallest
  /// difference between two consecutive changes if this is smaller; 0: no change yet.
  double step_degc() const { return step_degc_; }
  /// How long each reading is repeated, s, if the thermometer is read at regular times and changes
  /// by two steps or more on average; 0: readings are not repeated.
  double hold_s() const;

 private:
  /// Bins of the times between changes: four an octave, from 1 us to 2^40 us, which is 12.7 days.
  static constexpr int kChangeBins = 160;

  double step_degc_ = 0.0;
  double last_degc_ = std::numeric_limits<double>::quiet_NaN();
  std::int64_t last_change_ns_ = 0;
  double last_change_degc_ = 0.0;
  bool has_changed_ = false;
  std::array<std::int64_t, kChangeBins> gaps_{};
  std::array<double, kChangeBins> gap_sum_s_{};
  std::array<std::int64_t, kChangeBins> gap_rows_{};
  std::int64_t rows_ = 0;  ///< Rows since the last change.
  std::int64_t changes_ = 0;
  double change_sum_degc_ = 0.0;
};

/// Readings with the times at which they were taken. The thermometer is read every `hold_s` and
/// repeats each reading until the next one, so the means of cells (`degc`) change at these times.
/// `time_s` of the cells increases in nearly equal steps.
struct TakenReadings {
  std::vector<double> time_s, degc;
};
TakenReadings ReadingsAsTaken(const std::vector<double>& time_s,
                              const std::vector<double>& degc,
                              double hold_s);

/// Number of neighbours on each side whose median gives the expected value of a sweep's cell. Two
/// adjacent spikes among five neighbours hardly change the median.
inline constexpr std::size_t kNeighbours = 5;

/// Marks cells whose temperature differs from that of their neighbours by more than a chamber can
/// cause.
std::vector<bool> TemperatureSpikes(const std::vector<double>& degc, double step_degc);

/// Ranges [first, second) of cells in which the thermometer was stuck: they repeat the cell before
/// the range, and then the temperature jumps by more than a chamber can cause from cell to cell.
std::vector<std::pair<std::size_t, std::size_t>> StuckTemperatures(
    const std::vector<double>& time_s, const std::vector<double>& degc);

/// `degc` with the marked values replaced by linear interpolation.
std::vector<double> Bridged(const std::vector<double>& time_s,
                            const std::vector<double>& degc,
                            const std::vector<bool>& marked);

}  // namespace truetriad
