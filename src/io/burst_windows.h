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
/// A chip's FIFO is read when it holds `size` samples; the time is that of the last one, on one row
/// of the window (the same in each) or on all. The samples are spaced evenly between the previous
/// time and theirs; those of the first window, and after a gap, as in the neighbouring window.
class BurstWindows {
 public:
  static constexpr std::int64_t kMost = 65536;  ///< FIFOs hold fewer; bounds the memory.

  /// `size`: 2 … kMost rows per window; the first row of the file begins one.
  BurstWindows(std::int64_t size, std::string file) : size_(size), file_(std::move(file)) {}

  /// Adds the time on a row without a reading, before the first Spread with a later row.
  void AddTime(std::int64_t row, std::int64_t time_ns, std::int64_t line);

  /// Adds samples whose time is CsvReader::kMissingTime where their row has none; `lines` are their
  /// lines in the file. Returns the complete windows, valid until the next call. Error: a window
  /// with two times or none, times that do not increase.
  Result<SampleBlock> Spread(const SampleBlock& block, const std::vector<std::int64_t>& lines);

  /// The remaining samples at the end of the file; a last window that is cut and has no time
  /// follows evenly. Error: as Spread; a single window.
  Result<SampleBlock> Finish(Triad triad);

 private:
  /// Samples [begin, end) of the waiting ones.
  struct Window {
    std::size_t begin = 0, end = 0;
    std::int64_t number = 0;  ///< Among the windows of the file, from 0.
    std::int64_t time_ns = 0;
    std::int64_t timed_row = 0;  ///< In the file, and its line.
    std::int64_t timed_line = 0;
    bool has_one_time = true;  ///< No other row states it.
    bool is_cut = false;       ///< It is the last one and incomplete.
  };

  /// A time that a row states, and its place.
  struct Stated {
    std::int64_t row, time_ns, line;
    bool is_alone;  ///< No other row without a reading states it.
  };

  Status SpreadWindows(bool at_end);
  /// The window that begins with a sample; unset if its end has not been read yet.
  Result<std::optional<Window>> WindowAt(std::size_t begin, bool at_end) const;
  /// Sets the time of a window that one of its rows states. Error: it has another one.
  Status TakeTime(const Stated& stated, Window* window) const;
  /// Error: the time is on another row of the window than in the one before.
  Status CheckTimedRow(const Window& window) const;
  /// The row, counted from 1, that the time of a window after the first belongs to: the last row of
  /// a complete window. In a cut window it may also be the last existing row, as loggers write the
  /// remainder: whichever is nearer to the interval.
  std::int64_t StampedRow(const Window& window) const;
  /// Called before the first window is spread. False: more rows must be read.
  Result<bool> MeasureFirstInterval(const Window& first, bool at_end);
  /// `rows` rows of `later` lie between the two times. Error: `later` is not after `earlier`.
  Status MeasureInterval(const Window& earlier, const Window& later, std::int64_t rows);
  Error Fail(ErrorCode code, std::size_t sample, const std::string& text) const;

  std::int64_t size_;
  std::string file_;
  HeldSamples waiting_;              ///< Those returned last, then those that wait.
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
