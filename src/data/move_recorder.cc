// SPDX-License-Identifier: Apache-2.0
#include "data/move_recorder.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <sstream>
#include <string>

#include "base/rounded_text.h"
#include "data/gyroscope_faults.h"
#include "data/readings_at.h"
#include "model/mechanisms.h"

namespace truetriad {
namespace {

constexpr auto kLongestMoveNs = static_cast<std::int64_t>(1e9 * MoveRecorder::kLongestMoveS);
// Of the widest range of an axis: an extreme so near to where a move begins is no limit.
constexpr double kAtRestShare = 0.25;

std::string Seconds(double value) { return RoundedText(value, value < 1000.0 ? 3 : 6) + " s"; }

// Whether one reading comes again and again, all three axes at once: one axis alone repeats by
// chance where its steps are as coarse as its noise. A quiet sensor repeats what it reads at rest
// where the move has not begun, or is over: within `rest_radius` of the first reading only a run
// over half of the move counts.
bool IsStuck(const std::vector<Eigen::Vector3d>& readings,
             const StreamSummary& gyroscope,
             double rest_radius) {
  const std::vector<EqualReadings> runs =
      StuckRuns(readings, gyroscope.resolution_raw, gyroscope.repeats);
  return std::any_of(runs.begin(), runs.end(), [&](const EqualReadings& run) {
    const Eigen::Vector3d since = readings[run.begin] - readings.front();
    const bool is_at_rest = since.cwiseAbs().maxCoeff() < rest_radius;
    return !is_at_rest || run.end - run.begin >= readings.size() / 2;
  });
}

// Why the readings do not tell the turn; unset when they do.
// `all`: the readings of all moves.
std::optional<Finding> Fault(const RecordedMove& move,
                             const StreamSummary& gyroscope,
                             const std::vector<Eigen::Vector3d>& all) {
  if (move.time_ns.size() < 2) {
    return Finding(FindingCode::kTurnGap, "the gyroscope has no readings during it");
  }
  std::int64_t longest_gap_ns = 0;
  for (std::size_t i = 1; i < move.time_ns.size(); ++i) {
    longest_gap_ns = std::max(longest_gap_ns, move.time_ns[i] - move.time_ns[i - 1]);
  }
  const double gap_s = 1e-9 * static_cast<double>(longest_gap_ns);
  if (gap_s > std::max(kBridgedS, kGapSpacings / gyroscope.rate_hz) && Acts(Mechanism::kTurnGap)) {
    return Finding(FindingCode::kTurnGap, "the gyroscope has a gap of " + Seconds(gap_s))
        .With("gap", gap_s, "s");
  }
  const double rest_radius =
      kAtRestShare * (gyroscope.maximum_raw - gyroscope.minimum_raw).maxCoeff();
  for (int axis = 0; axis < 3; ++axis) {
    const std::string name = std::string("gyroscope ") + AxisLetter(axis);
    const double before = move.gyroscope_raw.front()[axis];
    for (const double limit : {gyroscope.minimum_raw[axis], gyroscope.maximum_raw[axis]}) {
      // Of an axis that hardly turned, or only one way, an extreme is a reading at rest.
      if (std::abs(limit - before) < rest_radius) continue;
      const double step = gyroscope.resolution_raw[axis];
      // The end of a range is come to again and again, the largest of many rates once.
      if (RunsAtLimit(limit, step, axis, move.gyroscope_raw).empty() ||
          RunsAtLimit(limit, step, axis, all).size() < 2 || !Acts(Mechanism::kTurnSaturated)) {
        continue;
      }
      std::ostringstream text;
      text << name << " is saturated: it reads its limit of " << limit << ' ' << gyroscope.unit.name
           << " several times in a row";
      return Finding(FindingCode::kTurnSaturated, text.str())
          .About(Triad::kGyroscope, axis)
          .With("limit", limit, gyroscope.unit.name);
    }
  }
  if (IsStuck(move.gyroscope_raw, gyroscope, rest_radius) && Acts(Mechanism::kTurnStuck)) {
    return Finding(FindingCode::kTurnStuck, "the gyroscope is stuck: it repeats one reading");
  }
  return std::nullopt;
}

}  // namespace

// Room for some minutes at once; pages that are never written cost nothing.
MoveRecorder::Stream::Stream() {
  constexpr std::size_t kFirstCapacity = 1 << 17;  // 22 minutes at 100 Hz.
  time_ns.reserve(kFirstCapacity);
  reading_raw.reserve(kFirstCapacity);
}

MoveRecorder::MoveRecorder(Triad leading, const std::vector<MotionPlace>& spans)
    : leading_(leading) {
  for (const MotionPlace& at : spans) {
    spans_.push_back({at.rows, at.times.start_ns, at.times.end_ns, at.times.empty()});
  }
}

void MoveRecorder::Add(const SampleBlock& block) {
  if (block.triad == leading_) {
    if (!block.row.empty()) {
      if (last_row_ < 0) first_ns_ = block.time_ns.front();
      last_row_ = block.row.back();
      last_ns_ = block.time_ns.back();
    }
    for (Span& span : spans_) {
      if (!span.is_by_row) continue;
      const auto first = std::lower_bound(block.row.begin(), block.row.end(), span.rows.first);
      const auto last = std::upper_bound(first, block.row.end(), span.rows.last);
      if (first == last) continue;
      const auto at = [&](auto row) {
        return block.time_ns[static_cast<std::size_t>(row - block.row.begin())];
      };
      if (span.end_ns < span.start_ns) span.start_ns = at(first);
      span.end_ns = at(last - 1);
    }
  }
  if (!to_drop_.empty()) {
    Compact(&gyroscope_);
    Compact(&accelerometer_);
    Compact(&magnetometer_);
    to_drop_.clear();
  }
  Stream& stream = block.triad == Triad::kGyroscope       ? gyroscope_
                   : block.triad == Triad::kAccelerometer ? accelerometer_
                                                          : magnetometer_;
  stream.time_ns.insert(stream.time_ns.end(), block.time_ns.begin(), block.time_ns.end());
  for (std::size_t i = 0; i < block.x.size(); ++i) {
    stream.reading_raw.emplace_back(block.x[i], block.y[i], block.z[i]);
  }
  peak_readings_ = std::max(peak_readings_, gyroscope_.time_ns.size());
}

void MoveRecorder::DropRest(const StaticPose& pose) {
  to_drop_.push_back({pose.start_ns, pose.end_ns});
  last_end_ns_ = pose.end_ns;
}

void MoveRecorder::DropLongMove(std::int64_t judged_before_ns) {
  // Before the first pose nothing is a turn between two.
  const std::int64_t after_ns =
      last_end_ns_ ? *last_end_ns_ + kLongestMoveNs : std::numeric_limits<std::int64_t>::min();
  if (after_ns < judged_before_ns) to_drop_.push_back({after_ns, judged_before_ns});
}

std::vector<MoveRecorder::Stretch> MoveRecorder::OutsideSpans() const {
  std::vector<Stretch> outside;
  for (auto [after_ns, before_ns] : to_drop_) {
    while (after_ns < before_ns) {
      // Up to the first span that is still to come, then behind it.
      std::int64_t until_ns = before_ns, next_ns = before_ns;
      for (const Span& span : spans_) {
        if (span.end_ns <= after_ns || span.start_ns >= until_ns) continue;
        until_ns = std::max(span.start_ns, after_ns);
        next_ns = span.end_ns;
      }
      if (until_ns > after_ns) outside.push_back({after_ns, until_ns});
      after_ns = next_ns;
    }
  }
  std::sort(outside.begin(), outside.end(), [](const Stretch& a, const Stretch& b) {
    return a.after_ns < b.after_ns;
  });
  return outside;
}

void MoveRecorder::Compact(Stream* stream) const {
  const std::vector<std::int64_t>& time = stream->time_ns;
  std::size_t kept = 0, looked_at = 0;
  const auto keep_until = [&](std::size_t end) {
    if (end <= looked_at) return;
    if (kept != looked_at) {
      const auto shift = [&](auto& values) {
        const auto from = values.begin() + static_cast<std::ptrdiff_t>(looked_at);
        const auto to = values.begin() + static_cast<std::ptrdiff_t>(end);
        std::move(from, to, values.begin() + static_cast<std::ptrdiff_t>(kept));
      };
      shift(stream->time_ns);
      shift(stream->reading_raw);
    }
    kept += end - looked_at;
    looked_at = end;
  };
  const std::size_t count = time.size();
  for (const Stretch& stretch : OutsideSpans()) {
    const auto from = time.begin() + static_cast<std::ptrdiff_t>(looked_at);
    const auto first = std::lower_bound(from, time.end(), stretch.after_ns) - time.begin() + 1;
    const auto last = std::upper_bound(from, time.end(), stretch.before_ns) - time.begin() - 1;
    if (first >= last) continue;
    keep_until(static_cast<std::size_t>(first));
    looked_at = std::max(looked_at, static_cast<std::size_t>(last));
  }
  keep_until(count);
  stream->time_ns.resize(kept);
  stream->reading_raw.resize(kept);
}

RecordedMove MoveRecorder::Cut(std::size_t first,
                               std::size_t last,
                               const StreamSummary& gyroscope) const {
  RecordedMove move;
  const auto span = [first, last](const auto& values) {
    return std::vector(values.begin() + static_cast<std::ptrdiff_t>(first),
                       values.begin() + static_cast<std::ptrdiff_t>(std::max(first, last)));
  };
  move.time_ns = span(gyroscope_.time_ns);
  move.gyroscope_raw = span(gyroscope_.reading_raw);
  move.accelerometer_raw =
      ReadingsAt(move.time_ns, accelerometer_.time_ns, accelerometer_.reading_raw);
  move.magnetometer_raw =
      ReadingsAt(move.time_ns, magnetometer_.time_ns, magnetometer_.reading_raw);
  move.fault = Fault(move, gyroscope, gyroscope_.reading_raw);
  return move;
}

std::vector<RecordedMove> MoveRecorder::Moves(const PoseSet& set) const {
  std::vector<RecordedMove> moves;
  const StreamSummary* gyroscope = set.Find(Triad::kGyroscope);
  const std::vector<std::int64_t>& times = gyroscope_.time_ns;
  if (gyroscope == nullptr || times.empty()) return moves;
  for (std::size_t i = 0; i + 1 < set.poses.size(); ++i) {
    const std::int64_t duration_ns = set.poses[i + 1].start_ns - set.poses[i].end_ns;
    if (duration_ns > kLongestMoveNs) {
      RecordedMove& move = moves.emplace_back();
      move.from = i;
      const double duration_s = 1e-9 * static_cast<double>(duration_ns);
      move.fault = Finding(FindingCode::kTurnTooLong,
                           "it takes " + Seconds(duration_s) + ", more than the longest turn of " +
                               Seconds(kLongestMoveS))
                       .With("duration", duration_s, "s");
      continue;
    }
    // The last reading of the one rest and the first of the other close the turn.
    auto first = std::upper_bound(times.begin(), times.end(), set.poses[i].end_ns);
    if (first != times.begin()) --first;
    auto last = std::lower_bound(first, times.end(), set.poses[i + 1].start_ns);
    if (last != times.end()) ++last;
    moves.push_back(Cut(static_cast<std::size_t>(first - times.begin()),
                        static_cast<std::size_t>(last - times.begin()),
                        *gyroscope));
    moves.back().from = i;
  }
  return moves;
}

std::vector<RecordedMove> MoveRecorder::Spans(const PoseSet& set) const {
  std::vector<RecordedMove> moves;
  const StreamSummary* gyroscope = set.Find(Triad::kGyroscope);
  if (gyroscope == nullptr) return moves;
  const std::vector<std::int64_t>& times = gyroscope_.time_ns;
  for (const Span& span : spans_) {
    const auto first = std::lower_bound(times.begin(), times.end(), span.start_ns);
    const auto last = std::upper_bound(first, times.end(), span.end_ns);
    moves.push_back(Cut(static_cast<std::size_t>(first - times.begin()),
                        static_cast<std::size_t>(last - times.begin()),
                        *gyroscope));
  }
  return moves;
}

}  // namespace truetriad
