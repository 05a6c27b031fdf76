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
/// A chip's FIFO is read when it holds `size` samples. The time of a window is that of its last
/// sample. Either one row of each window states this time, always the row at the same position, or
/// all rows do. The samples of a window are spaced evenly from the time of the previous window to
/// that of their own window. In the first window and after a gap, they are spaced as in the
/// neighbouring windows.
class BurstWindows {
 public:
  static constexpr std::int64_t kMost = 65536;  ///< Rows. It bounds the memory; FIFOs hold fewer.

  /// `size`: 2 … kMost rows per window; the first row of the file begins a window.
  BurstWindows(std::int64_t size, std::string file) : size_(size), file_(std::move(file)) {}

  /// Adds the time that a row without a reading states. Must be called before Spread is called with
  /// later rows.
  void AddTime(std::int64_t row, std::int64_t time_ns, std::int64_t line);

  /// Adds samples; the time of a row without one is CsvReader::kMissingTime. `lines` are the lines
  /// of the samples in the file. Returns the samples of complete windows, valid until the next
  /// call. Error: a window has two times or none, or times do not increase.
  Result<SampleBlock> Spread(const SampleBlock& block, const std::vector<std::int64_t>& lines);

  /// The remaining samples at the end of the file. If the last window is cut short and has no time,
  /// the usual interval is assumed. Error: as for Spread, or there is only one window.
  Result<SampleBlock> Finish(Triad triad);

 private:
  /// One window of the log: the waiting samples [begin, end).
  struct Window {
    std::size_t begin = 0, end = 0;
    std::int64_t number = 0;  ///< Number of the window in the file, from 0.
    std::int64_t time_ns = 0;
    std::int64_t timed_row = 0;  ///< Row of the file that states the time.
    std::int64_t timed_line = 0;
    bool has_one_time = true;  ///< Only one row states the time.
    bool is_cut = false;       ///< The window is the last one and cut short.
  };

  /// A time that a row states, with the row and the line of the file.
  struct Stated {
    std::int64_t row, time_ns, line;
    bool is_alone;  ///< No other row without a reading states the time.
  };

  Status SpreadWindows(bool at_end);
  /// The window that begins with sample `begin`; unset if its end has not been read yet.
  Result<std::optional<Window>> WindowAt(std::size_t begin, bool at_end) const;
  /// Gives a window the time that one of its rows states. Error: the window already has another
  /// time.
  Status TakeTime(const Stated& stated, Window* window) const;
  /// Checks which row of a window states the time. Error: it is another row than in the last window
  /// with only one timed row.
  Status CheckTimedRow(const Window& window) const;
  /// The row of a window, counted from 1, to which the window's time belongs; not for the first
  /// window. In a complete window this is the last row. If a window is cut short, some loggers
  /// state the time of the last existing row instead. Then the row is chosen with which the
  /// interval is closer to the usual one.
  std::int64_t StampedRow(const Window& window) const;
  /// Measures the interval for the first window. Returns false if more rows must be read first.
  Result<bool> MeasureFirstInterval(const Window& first, bool at_end);
  /// Measures the interval from `earlier` to `later`. The time of `later` belongs to its row
  /// `rows`, counted from 1. Error: `later` is not after `earlier`.
  Status MeasureInterval(const Window& earlier, const Window& later, std::int64_t rows);
  Error Fail(ErrorCode code, std::size_t sample, const std::string& text) const;

  std::int64_t size_;
  std::string file_;
  HeldSamples waiting_;              ///< The samples returned last, then those that wait.
  std::vector<std::int64_t> lines_;  ///< The lines of the samples in waiting_.
  std::size_t done_ = 0;             ///< Number of samples returned last.
  std::deque<Stated> other_times_;   ///< Times from rows without a reading, for waiting windows.
  std::optional<Window> last_;       ///< The last window with computed times.
  std::optional<Window> timed_;      ///< The last window with its time on one row only.
  std::int64_t interval_ns_ = 0;     ///< Interval between two windows; 0: unknown.
  int gaps_alike_ = 0;               ///< Consecutive gaps of about the same length.
  double last_gap_ns_ = 0.0;
};

}  // namespace truetriad
