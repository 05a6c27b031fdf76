// SPDX-License-Identifier: Apache-2.0
#include "io/burst_windows.h"

#include <algorithm>
#include <cmath>

#include "io/csv_reader.h"

namespace truetriad {
namespace {

constexpr std::int64_t kLongestInterval = 86'400'000'000'000;  // A day; beyond, the unit is wrong.

}  // namespace

void BurstWindows::AddTime(std::int64_t row, std::int64_t time_ns, std::int64_t line) {
  const bool is_known = !other_times_.empty() && other_times_.back().time_ns == time_ns &&
                        other_times_.back().row / size_ == row / size_;
  if (is_known) {
    other_times_.back().is_alone = false;
  } else {
    other_times_.push_back({row, time_ns, line, true});
  }
}

Result<SampleBlock> BurstWindows::Spread(const SampleBlock& block,
                                         const std::vector<std::int64_t>& lines) {
  waiting_.Append(block);
  lines_.insert(lines_.end(), lines.begin(), lines.end());
  TRUETRIAD_RETURN_IF_ERROR(SpreadWindows(false));
  return waiting_.View(block.triad, 0, done_);
}

Result<SampleBlock> BurstWindows::Finish(Triad triad) {
  TRUETRIAD_RETURN_IF_ERROR(SpreadWindows(true));
  return waiting_.View(triad, 0, done_);
}

Status BurstWindows::SpreadWindows(bool at_end) {
  waiting_.EraseFront(done_);
  lines_.erase(lines_.begin(), lines_.begin() + static_cast<std::ptrdiff_t>(done_));
  done_ = 0;
  std::size_t begin = 0;
  for (;;) {
    TRUETRIAD_ASSIGN_OR_RETURN(const std::optional<Window> window, WindowAt(begin, at_end));
    if (!window) break;
    std::int64_t rows = size_;
    if (!last_) {
      TRUETRIAD_ASSIGN_OR_RETURN(const bool is_known, MeasureFirstInterval(*window, at_end));
      if (!is_known) break;
    } else {
      rows = StampedRow(*window);
      TRUETRIAD_RETURN_IF_ERROR(MeasureInterval(*last_, *window, rows));
    }
    TRUETRIAD_RETURN_IF_ERROR(CheckTimedRow(*window));
    if (window->has_one_time) timed_ = window;
    for (std::size_t i = begin; i < window->end; ++i) {
      const std::int64_t behind = rows - 1 - waiting_.row[i] % size_;
      waiting_.time_ns[i] = window->time_ns - (behind * interval_ns_ + size_ / 2) / size_;
    }
    last_ = window;
    begin = window->end;
    while (!other_times_.empty() && other_times_.front().row / size_ <= window->number) {
      other_times_.pop_front();
    }
  }
  done_ = begin;
  return {};
}

std::int64_t BurstWindows::StampedRow(const Window& window) const {
  if (!window.is_cut) return size_;
  const std::int64_t rows = waiting_.row[window.end - 1] % size_ + 1;
  const auto after_ns = static_cast<double>(window.time_ns - last_->time_ns);
  const auto interval_ns = static_cast<double>(interval_ns_);
  const double share = static_cast<double>(rows) / static_cast<double>(size_);
  return after_ns < 0.5 * (1.0 + share) * interval_ns ? rows : size_;
}

Result<bool> BurstWindows::MeasureFirstInterval(const Window& first, bool at_end) {
  // Takes the shortest of three intervals: a lost window makes an interval longer, and nothing
  // makes one shorter.
  constexpr int kIntervals = 3;
  std::int64_t shortest_ns = 0;
  Window earlier = first;
  for (int i = 0; i < kIntervals; ++i) {
    TRUETRIAD_ASSIGN_OR_RETURN(const std::optional<Window> later, WindowAt(earlier.end, at_end));
    if (!later && !at_end) return false;
    if (!later && i == 0) {
      return Fail(ErrorCode::kNotEnoughData,
                  first.begin,
                  "begins the only window of " + std::to_string(size_) +
                      " rows (`window_samples`); at least two windows are needed to measure the "
                      "interval between samples");
    }
    if (!later || (i > 0 && later->is_cut)) break;
    interval_ns_ = 0;
    TRUETRIAD_RETURN_IF_ERROR(MeasureInterval(earlier, *later, size_));
    shortest_ns = i == 0 ? interval_ns_ : std::min(shortest_ns, interval_ns_);
    earlier = *later;
  }
  interval_ns_ = shortest_ns;
  return true;
}

Result<std::optional<BurstWindows::Window>> BurstWindows::WindowAt(std::size_t begin,
                                                                   bool at_end) const {
  const std::vector<std::int64_t>& rows = waiting_.row;
  if (begin == rows.size()) return std::optional<Window>();
  Window window;
  window.begin = window.end = begin;
  window.number = rows[begin] / size_;
  window.time_ns = CsvReader::kMissingTime;
  while (window.end < rows.size() && rows[window.end] / size_ == window.number) ++window.end;
  const bool is_last = window.end == rows.size();
  if (is_last && !at_end) return std::optional<Window>();
  window.is_cut = is_last && (rows.back() + 1) % size_ != 0;
  for (std::size_t i = begin; i < window.end; ++i) {
    TRUETRIAD_RETURN_IF_ERROR(TakeTime({rows[i], waiting_.time_ns[i], lines_[i], true}, &window));
  }
  for (const Stated& stated : other_times_) {
    const std::int64_t number = stated.row / size_;
    if (number > window.number) break;
    if (number == window.number) TRUETRIAD_RETURN_IF_ERROR(TakeTime(stated, &window));
  }
  if (window.time_ns != CsvReader::kMissingTime) return std::optional(window);
  // If the file is cut off, the row with the time of the last window may be missing. The usual
  // interval is then assumed.
  if (window.is_cut && last_ && window.number == last_->number + 1) {
    window.time_ns = last_->time_ns + interval_ns_;
    window.has_one_time = false;
    return std::optional(window);
  }
  if (window.is_cut && !last_ && begin > 0)
    return std::optional<Window>();  // Only one window is complete.
  return Fail(ErrorCode::kInvalidValue,
              begin,
              "begins a window of " + std::to_string(size_) +
                  " rows (`window_samples`) without a time; each window should state a time: rows "
                  "are missing, or window_samples is wrong");
}

Status BurstWindows::TakeTime(const Stated& stated, Window* window) const {
  const std::int64_t time_ns = stated.time_ns;
  if (time_ns == CsvReader::kMissingTime) return {};
  window->has_one_time = window->time_ns == CsvReader::kMissingTime && stated.is_alone;
  if (time_ns == window->time_ns) return {};
  // Samples may lie up to one interval before the first time or after the last time.
  constexpr std::int64_t kFarthest = CsvReader::kFarthestTime - kLongestInterval;
  if (time_ns < -kFarthest || time_ns > kFarthest) {
    return Error(ErrorCode::kValueOutOfRange,
                 {file_, stated.line},
                 "has a time that is out of range; check its unit, or the rate");
  }
  if (window->time_ns != CsvReader::kMissingTime) {
    return Error(
        ErrorCode::kInvalidValue,
        {file_, stated.line},
        "states a time that differs from that of other rows of its window of " +
            std::to_string(size_) +
            " rows (`window_samples`); the first window begins with the first row of the file");
  }
  window->time_ns = time_ns;
  window->timed_row = stated.row;
  window->timed_line = stated.line;
  return {};
}

Status BurstWindows::CheckTimedRow(const Window& window) const {
  if (!timed_ || !window.has_one_time || window.is_cut) return {};
  const std::int64_t row = window.timed_row % size_, before = timed_->timed_row % size_;
  if (row == before) return {};
  return Error(
      ErrorCode::kInvalidValue,
      {file_, window.timed_line},
      "states the time of its window on row " + std::to_string(row + 1) + " of " +
          std::to_string(size_) + " (`window_samples`), but line " +
          std::to_string(timed_->timed_line) + " states it on row " + std::to_string(before + 1) +
          "; there are too few or too many rows between these lines, or window_samples is wrong");
}

Status BurstWindows::MeasureInterval(const Window& earlier,
                                     const Window& later,
                                     std::int64_t rows) {
  // If an interval exceeds the usual one by more than this factor, it is a gap; a lost window
  // doubles the interval.
  constexpr double kGap = 1.5;
  constexpr int kMostGapsAlike = 2;  // A third equal gap in a row is the usual interval.
  if (later.time_ns <= earlier.time_ns) {
    return Fail(ErrorCode::kTimeGoesBack,
                later.begin,
                "begins a window of " + std::to_string(size_) +
                    " rows (`window_samples`) whose time is not after that of the previous window; "
                    "correct window_samples, or sort the log");
  }
  // The difference of any two int64 times fits a uint64.
  const std::uint64_t between =
      (static_cast<std::uint64_t>(later.time_ns) - static_cast<std::uint64_t>(earlier.time_ns)) /
      static_cast<std::uint64_t>(later.number - earlier.number);
  const auto length =
      static_cast<double>(between) * static_cast<double>(size_) / static_cast<double>(rows);
  const bool is_long = interval_ns_ > 0 && length > kGap * static_cast<double>(interval_ns_);
  const bool is_alike = length < kGap * last_gap_ns_ && length > last_gap_ns_ / kGap;
  gaps_alike_ = !is_long ? 0 : is_alike ? gaps_alike_ + 1 : 1;
  last_gap_ns_ = is_long ? length : 0.0;
  const bool is_interval = gaps_alike_ == 0 || gaps_alike_ > kMostGapsAlike;
  if (is_interval && length <= static_cast<double>(kLongestInterval)) {
    interval_ns_ = std::llround(length);
  } else if (interval_ns_ == 0) {
    return Fail(ErrorCode::kInvalidValue,
                later.begin,
                "begins a window of " + std::to_string(size_) +
                    " rows (`window_samples`) more than a day after the first one; check the "
                    "unit of its time");
  }
  return {};
}

Error BurstWindows::Fail(ErrorCode code, std::size_t sample, const std::string& text) const {
  return Error(code, {file_, lines_[sample]}, text);
}

}  // namespace truetriad
