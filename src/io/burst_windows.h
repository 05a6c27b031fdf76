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

/// Gives the samples of a log that was read in windows of `size` rows, each window with one time,
/// a time each.
///
/// A chip's FIFO is read when it holds `size` samples, and the time is that of the last one, on a
/// row of the window, the same in each, or on all. The samples lie evenly between the time before
/// and theirs; those of the first window, and behind a gap, as closely as in the window beside.
class BurstWindows {
 public:
  static constexpr std::int64_t kMost = 65536;  ///< Waiting samples are held in memory.

  /// `size`: 2 … kMost rows of a window; the first row of the file begins one.
  BurstWindows(std::int64_t size, std::string file) : size_(size), file_(std::move(file)) {}

  /// Takes the time on a row without a reading, before the first Spread that has a later row.
  void AddTime(std::int64_t row, std::int64_t time_ns, std::int64_t line);

  /// Takes samples whose time is CsvReader::kMissingTime where their row has none; `lines`: where
  /// each stands. Gives back what is complete, which stays valid until the next call.
  /// Error: a window with two times or none, times that do not grow.
  Result<SampleBlock> Spread(const SampleBlock& block, const std::vector<std::int64_t>& lines);

  /// What is left at the end of the file; a last window that is cut and has no time follows evenly.
  /// Error: as Spread; a single window.
  Result<SampleBlock> Finish(Triad triad);

 private:
  /// Samples [begin, end) of those that wait.
  struct Window {
    std::size_t begin = 0, end = 0;
    std::int64_t number = 0;  ///< Of the windows of the file, from 0.
    std::int64_t time_ns = 0;
    std::int64_t timed_row = 0;  ///< Of the file, and its line.
    std::int64_t timed_line = 0;
    bool has_one_time = true;  ///< On no other row.
    bool is_cut = false;       ///< The last of the file, which has not all its samples.
  };

  /// A time that a row states, and where it stands.
  struct Stated {
    std::int64_t row, time_ns, line;
    bool is_alone;  ///< No other row without a reading states it.
  };

  Status SpreadWindows(bool at_end);
  /// The window that begins with a sample; unset where more of it may come.
  Result<std::optional<Window>> WindowAt(std::size_t begin, bool at_end) const;
  /// Gives a window a time that one of its rows states. Error: it has another.
  Status TakeTime(const Stated& stated, Window* window) const;
  /// Error: the time stands on another row of the window than in the one before.
  Status CheckTimedRow(const Window& window) const;
  /// The row of a window behind the first that its time is of, counted from 1: the last it should
  /// have. Of one that is cut it may be the last it has, as where a logger writes what is left:
  /// whichever is nearer the interval.
  std::int64_t StampedRow(const Window& window) const;
  /// Before the first window is spread. False: more must be read.
  Result<bool> MeasureFirstInterval(const Window& first, bool at_end);
  /// `rows` of the later are between the two times. Error: it is not behind the earlier.
  Status MeasureInterval(const Window& earlier, const Window& later, std::int64_t rows);
  Error Fail(ErrorCode code, std::size_t sample, const std::string& text) const;

  std::int64_t size_;
  std::string file_;
  HeldSamples waiting_;              ///< Those that were given back last, then those that wait.
  std::vector<std::int64_t> lines_;  ///< Of those.
  std::size_t done_ = 0;             ///< Of those: given back last.
  std::deque<Stated> other_times_;   ///< On rows without a reading, of windows that wait.
  std::optional<Window> last_;       ///< That has its times; its samples are gone.
  std::optional<Window> timed_;      ///< The last that has its time on one row alone.
  std::int64_t interval_ns_ = 0;     ///< Between two windows; 0: not known yet.
  int gaps_alike_ = 0;               ///< Of about the same length, one after another until now.
  double last_gap_ns_ = 0.0;
};

}  // namespace truetriad
