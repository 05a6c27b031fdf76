// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "data/held_samples.h"
#include "truetriad/base/result.h"
#include "truetriad/data/sample_source.h"

namespace truetriad {

/// Computes a time for each sample of a log that was read in windows of `size` rows with one time
/// per window.
///
/// A chip's FIFO is read when it holds `size` samples. The time is that of the last sample; it is
/// stated on one row of the window, the same in each window, or on all rows. Samples are spaced
/// evenly from the time of the previous window to their own; in the first window, and after a gap,
/// as in the neighbouring window.
class BurstWindows {
 public:
  static constexpr std::int64_t kMost = 65536;  ///< Rows. FIFOs hold fewer; bounds the memory.

  /// `size`: 2 … kMost rows per window; the first row of the file begins a window.
  BurstWindows(std::int64_t size, std::string file) : size_(size), file_(std::move(file)) {}

  /// Adds the time on a row without a reading, before the first Spread with a later row.
  void AddTime(std::int64_t row, std::int64_t time_ns, std::int64_t line);

  /// Adds samples, with CsvReader::kMissingTime for a row without a time; `lines` are their lines
  /// in the file. Returns the complete windows, valid until the next call. Error: a window with two
  /// times or none, times that do not increase.
  Result<SampleBlock> Spread(const SampleBlock& block, const std::vector<std::int64_t>& lines);

  /// The remaining samples at the end of the file. A last window that is cut short and has no time
  /// follows after the usual interval. Error: as Spread; there is only one window.
  Result<SampleBlock> Finish(Triad triad);

 private:
  /// Samples [begin, end) of the waiting ones.
  struct Window {
    std::size_t begin = 0, end = 0;
    std::int64_t number = 0;  ///< Among the windows of the file, from 0.
    std::int64_t time_ns = 0;
    std::int64_t timed_row = 0;  ///< Row of the file that states the time; its line.
    std::int64_t timed_line = 0;
    bool has_one_time = true;  ///< Only one row states the time.
    bool is_cut = false;       ///< It is the last one and cut short.
  };

  /// A time that a row states, and its place.
  struct Stated {
    std::int64_t row, time_ns, line;
    bool is_alone;  ///< No other row without a reading states it.
  };

  Status SpreadWindows(bool at_end);
  /// The window that begins with a sample; unset if its end has not been read yet.
  Result<std::optional<Window>> WindowAt(std::size_t begin, bool at_end) const;
  /// Gives a window the time that one of its rows states. Error: it has another time already.
  Status TakeTime(const Stated& stated, Window* window) const;
  /// Error: the time is on another row of the window than in the one before.
  Status CheckTimedRow(const Window& window) const;
  /// The row, counted from 1, that the time of a window after the first belongs to: the last row of
  /// a complete window. In a window that is cut short it may also be the last existing row, as some
  /// loggers write it: the one that makes the interval more nearly the usual one.
  std::int64_t StampedRow(const Window& window) const;
  /// Sets the interval before the first window is spread. False: more rows must be read.
  Result<bool> MeasureFirstInterval(const Window& first, bool at_end);
  /// Measures the interval; `rows` rows lie between times. Error: `later` is not after `earlier`.
  Status MeasureInterval(const Window& earlier, const Window& later, std::int64_t rows);
  Error Fail(ErrorCode code, std::size_t sample, const std::string& text) const;

  std::int64_t size_;
  std::string file_;
  HeldSamples waiting_;              ///< The samples returned last, then those that wait.
  std::vector<std::int64_t> lines_;  ///< Of these samples.
  std::size_t done_ = 0;             ///< How many of them were returned last.
  std::deque<Stated> other_times_;   ///< On rows without a reading, of waiting windows.
  std::optional<Window> last_;       ///< The last window with computed times.
  std::optional<Window> timed_;      ///< The last window with its time on one row only.
  std::int64_t interval_ns_ = 0;     ///< Between two windows; 0: unknown.
  int gaps_alike_ = 0;               ///< Consecutive gaps of about the same length.
  double last_gap_ns_ = 0.0;
};

}  // namespace truetriad
