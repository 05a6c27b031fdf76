// SPDX-License-Identifier: Apache-2.0
#include "io/burst_windows.h"

#include <limits>

#include "io/csv_reader.h"

namespace truetriad {
namespace {

constexpr std::int64_t kLongestInterval = 86'400'000'000'000;  // A day.

template <typename T, typename Range>
void AppendTo(std::vector<T>* to, const Range& range) {
  to->insert(to->end(), range.begin(), range.end());
}

template <typename T>
void MoveFirst(std::size_t count, std::vector<T>* from, std::vector<T>* to) {
  if (from->empty()) return;
  const auto end = from->begin() + static_cast<std::ptrdiff_t>(count);
  to->insert(to->end(), from->begin(), end);
  from->erase(from->begin(), end);
}

}  // namespace

void BurstWindows::Samples::Append(const SampleBlock& block,
                                   const std::vector<std::int64_t>& lines) {
  AppendTo(&time_ns, block.time_ns);
  AppendTo(&row, block.row);
  AppendTo(&line, lines);
  AppendTo(&x, block.x);
  AppendTo(&y, block.y);
  AppendTo(&z, block.z);
  AppendTo(&temperature_degc, block.temperature_degc);
  AppendTo(&ambient_degc, block.ambient_degc);
  AppendTo(&pose, block.pose);
}

void BurstWindows::Samples::MoveFirstTo(std::size_t count, Samples* other) {
  MoveFirst(count, &time_ns, &other->time_ns);
  MoveFirst(count, &row, &other->row);
  MoveFirst(count, &line, &other->line);
  MoveFirst(count, &x, &other->x);
  MoveFirst(count, &y, &other->y);
  MoveFirst(count, &z, &other->z);
  MoveFirst(count, &temperature_degc, &other->temperature_degc);
  MoveFirst(count, &ambient_degc, &other->ambient_degc);
  MoveFirst(count, &pose, &other->pose);
}

SampleBlock BurstWindows::Samples::AsBlock(Triad triad) const {
  return {triad, time_ns, x, y, z, temperature_degc, pose, row, ambient_degc};
}

Result<SampleBlock> BurstWindows::Spread(const SampleBlock& block,
                                         const std::vector<std::int64_t>& lines) {
  waiting_.Append(block, lines);
  TRUETRIAD_RETURN_IF_ERROR(SpreadWindows(false));
  return done_.AsBlock(block.triad);
}

Result<SampleBlock> BurstWindows::Finish(Triad triad) {
  TRUETRIAD_RETURN_IF_ERROR(SpreadWindows(true));
  return done_.AsBlock(triad);
}

Status BurstWindows::SpreadWindows(bool at_end) {
  done_ = {};
  std::size_t begin = 0;
  for (;;) {
    TRUETRIAD_ASSIGN_OR_RETURN(const std::optional<Window> window, WindowAt(begin, at_end));
    if (!window) break;
    if (last_) {
      TRUETRIAD_RETURN_IF_ERROR(MeasureInterval(*last_, *window));
    } else {
      TRUETRIAD_ASSIGN_OR_RETURN(const std::optional<Window> next, WindowAt(window->end, at_end));
      if (!next && !at_end) break;
      if (!next) {
        return Fail(ErrorCode::kNotEnoughData,
                    begin,
                    "begins the only window of window_samples, so that it is not known how far its "
                    "samples are apart");
      }
      TRUETRIAD_RETURN_IF_ERROR(MeasureInterval(*window, *next));
    }
    for (std::size_t i = begin; i < window->end; ++i) {
      const std::int64_t behind = size_ - 1 - waiting_.row[i] % size_;
      waiting_.time_ns[i] = window->time_ns - (behind * interval_ns_ + size_ / 2) / size_;
    }
    last_ = window;
    begin = window->end;
  }
  waiting_.MoveFirstTo(begin, &done_);
  return {};
}

Result<std::optional<BurstWindows::Window>> BurstWindows::WindowAt(std::size_t begin,
                                                                   bool at_end) const {
  const std::vector<std::int64_t>& rows = waiting_.row;
  if (begin == rows.size()) return std::optional<Window>();
  Window window = {begin, begin, rows[begin] / size_, CsvReader::kMissingTime};
  while (window.end < rows.size() && rows[window.end] / size_ == window.number) ++window.end;
  if (window.end == rows.size() && !at_end) return std::optional<Window>();
  for (std::size_t i = begin; i < window.end; ++i) {
    const std::int64_t stated = waiting_.time_ns[i];
    if (stated == CsvReader::kMissingTime || stated == window.time_ns) continue;
    if (window.time_ns != CsvReader::kMissingTime) {
      return Fail(ErrorCode::kInvalidValue,
                  i,
                  "has another time than rows before it that are of the same " +
                      std::to_string(size_) +
                      " of window_samples; the first row of the file begins a window");
    }
    window.time_ns = stated;
  }
  if (window.time_ns >= std::numeric_limits<std::int64_t>::min() + kLongestInterval)
    return std::optional(window);
  return Fail(ErrorCode::kInvalidValue, begin, "begins a window of window_samples without a time");
}

Status BurstWindows::MeasureInterval(const Window& earlier, const Window& later) {
  // What is longer than the interval before by as much is a gap.
  constexpr double kGap = 1.5;
  if (later.time_ns <= earlier.time_ns) {
    return Fail(ErrorCode::kTimeGoesBack,
                later.begin,
                "begins a window of window_samples whose time is not behind that of the one "
                "before; correct window_samples, or sort the log");
  }
  // The difference of any two times fits without a sign.
  const std::uint64_t between =
      (static_cast<std::uint64_t>(later.time_ns) - static_cast<std::uint64_t>(earlier.time_ns)) /
      static_cast<std::uint64_t>(later.number - earlier.number);
  const auto longest = static_cast<double>(interval_ns_ > 0 ? interval_ns_ : kLongestInterval);
  const bool is_gap = static_cast<double>(between) > (interval_ns_ > 0 ? kGap : 1.0) * longest ||
                      between > static_cast<std::uint64_t>(kLongestInterval);
  if (!is_gap) {
    interval_ns_ = static_cast<std::int64_t>(between);
  } else if (interval_ns_ == 0) {
    return Fail(ErrorCode::kInvalidValue,
                later.begin,
                "begins a window of window_samples more than a day behind the first one; check the "
                "unit of its time");
  }
  return {};
}

Error BurstWindows::Fail(ErrorCode code, std::size_t sample, const std::string& text) const {
  return Error(code, {file_, waiting_.line[sample]}, text);
}

}  // namespace truetriad
