// SPDX-License-Identifier: Apache-2.0
#include "data/move_recorder.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <sstream>
#include <string>

#include "base/rounded_text.h"
#include "data/held_samples.h"
#include "data/readings_at.h"
#include "data/repeats.h"
#include "model/mechanisms.h"

namespace truetriad {
namespace {

// kLongestMoveS in nanoseconds, the unit of the times.
constexpr auto kLongestMoveNs = static_cast<std::int64_t>(1e9 * MoveRecorder::kLongestMoveS);
// Chosen: a share of the widest axis's range. An extreme that is nearer than this to a move's first
// reading is no limit of the sensor.
constexpr double kAtRestShare = 0.25;

std::string Seconds(double value) { return RoundedText(value, value < 1000.0 ? 3 : 6) + " s"; }

// Why the readings do not determine the turn; unset if they do. `all`: the readings of all moves.
std::optional<Finding> Fault(const RecordedMove& move,
                             const StreamSummary& gyroscope,
                             const std::vector<Eigen::Vector3d>& all) {
  if (move.time_ns.size() < 2) {
    return Finding(FindingCode::kTurnGap, "the gyroscope has no readings during the turn");
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
      // If an axis turned little, or only one way, an extreme is a reading at rest.
      if (std::abs(limit - before) < rest_radius) continue;
      const double step = gyroscope.resolution_raw[axis];
      // Saturation gives several runs at the limit, a largest rate without saturation only one.
      if (RunsAtLimit(limit, step, axis, move.gyroscope_raw, gyroscope.repeats).empty() ||
          RunsAtLimit(limit, step, axis, all, gyroscope.repeats).size() < 2 ||
          !Acts(Mechanism::kTurnSaturated)) {
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
  return std::nullopt;
}

}  // namespace

MoveRecorder::MoveRecorder(Triad leading, const std::vector<MotionPlace>& spans)
    : leading_(leading) {
  for (ReadingTrack& track : tracks_) {
    // Memory for 22 minutes at 100 Hz; pages that are never written cost nothing.
    track.time_ns.reserve(kMostHeldSamples / 2);
    track.reading_raw.reserve(kMostHeldSamples / 2);
  }
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
    for (ReadingTrack& track : tracks_) Compact(&track);
    to_drop_.clear();
  }
  Append(block, &tracks_[block.triad]);
  peak_readings_ = std::max(peak_readings_, tracks_[Triad::kGyroscope].time_ns.size());
}

void MoveRecorder::DropRest(const StaticPose& pose) {
  to_drop_.push_back({pose.start_ns, pose.end_ns});
  last_end_ns_ = pose.end_ns;
}

void MoveRecorder::DropLongMove(std::int64_t judged_before_ns) {
  // Before the first pose nothing is kept, as no turn between two poses lies there.
  const std::int64_t after_ns =
      last_end_ns_ ? *last_end_ns_ + kLongestMoveNs : std::numeric_limits<std::int64_t>::min();
  if (after_ns < judged_before_ns) to_drop_.push_back({after_ns, judged_before_ns});
}

void MoveRecorder::Compact(ReadingTrack* track) const {
  std::vector<std::int64_t>& time = track->time_ns;
  std::int64_t first_ns = to_drop_.front().after_ns, last_ns = to_drop_.front().before_ns;
  for (const auto& [after_ns, before_ns] : to_drop_) {
    first_ns = std::min(first_ns, after_ns), last_ns = std::max(last_ns, before_ns);
  }
  // Whether a reading with neighbours at these times is dropped.
  const auto is_dropped = [this](std::int64_t before_ns, std::int64_t after_ns) {
    return std::any_of(to_drop_.begin(),
                       to_drop_.end(),
                       [=](const Stretch& stretch) {
                         return stretch.after_ns <= before_ns && after_ns <= stretch.before_ns;
                       }) &&
           std::none_of(spans_.begin(), spans_.end(), [=](const Span& span) {
             return span.start_ns < after_ns && before_ns < span.end_ns;
           });
  };
  const auto begin = std::lower_bound(time.begin(), time.end(), first_ns) - time.begin();
  const auto end = std::upper_bound(time.begin(), time.end(), last_ns) - time.begin();
  auto kept = static_cast<std::size_t>(begin);
  for (std::size_t i = kept; i < static_cast<std::size_t>(end); ++i) {
    if (i > 0 && i + 1 < time.size() && is_dropped(time[i - 1], time[i + 1])) continue;
    time[kept] = time[i];
    track->reading_raw[kept++] = track->reading_raw[i];
  }
  const auto erase = [&](auto& values) {
    values.erase(values.begin() + static_cast<std::ptrdiff_t>(kept), values.begin() + end);
  };
  erase(time);
  erase(track->reading_raw);
}

RecordedMove MoveRecorder::Cut(Time first, Time last, const StreamSummary& gyroscope) const {
  const ReadingTrack& turning = tracks_[Triad::kGyroscope];
  RecordedMove move;
  last = std::max(first, last);
  move.time_ns.assign(first, last);
  const auto begin = turning.reading_raw.begin() + (first - turning.time_ns.begin());
  move.gyroscope_raw.assign(begin, begin + (last - first));
  const auto beside = [&](Triad triad) {
    return ReadingsAt(move.time_ns, tracks_[triad].time_ns, tracks_[triad].reading_raw);
  };
  move.accelerometer_raw = beside(Triad::kAccelerometer);
  move.magnetometer_raw = beside(Triad::kMagnetometer);
  move.fault = Fault(move, gyroscope, turning.reading_raw);
  return move;
}

std::vector<RecordedMove> MoveRecorder::Moves(const PoseSet& set) const {
  std::vector<RecordedMove> moves;
  const StreamSummary* gyroscope = set.Find(Triad::kGyroscope);
  const std::vector<std::int64_t>& times = tracks_[Triad::kGyroscope].time_ns;
  if (gyroscope == nullptr || times.empty()) return moves;
  for (std::size_t i = 0; i + 1 < set.poses.size(); ++i) {
    const std::int64_t duration_ns = set.poses[i + 1].start_ns - set.poses[i].end_ns;
    if (duration_ns > kLongestMoveNs && Acts(Mechanism::kTurnTooLong)) {
      RecordedMove& move = moves.emplace_back();
      move.from = i;
      const double duration_s = 1e-9 * static_cast<double>(duration_ns);
      move.fault = Finding(FindingCode::kTurnTooLong,
                           "it takes " + Seconds(duration_s) +
                               ", but turns are integrated over at most " + Seconds(kLongestMoveS))
                       .With("duration", duration_s, "s");
      continue;
    }
    // The last reading of one rest and the first of the next are the ends of the turn.
    auto first = std::upper_bound(times.begin(), times.end(), set.poses[i].end_ns);
    if (first != times.begin()) --first;
    auto last = std::lower_bound(first, times.end(), set.poses[i + 1].start_ns);
    if (last != times.end()) ++last;
    moves.push_back(Cut(first, last, *gyroscope));
    moves.back().from = i;
  }
  return moves;
}

std::vector<RecordedMove> MoveRecorder::Spans(const PoseSet& set) const {
  std::vector<RecordedMove> moves;
  const StreamSummary* gyroscope = set.Find(Triad::kGyroscope);
  if (gyroscope == nullptr) return moves;
  const std::vector<std::int64_t>& times = tracks_[Triad::kGyroscope].time_ns;
  for (const Span& span : spans_) {
    const auto first = std::lower_bound(times.begin(), times.end(), span.start_ns);
    const auto last = std::upper_bound(first, times.end(), span.end_ns);
    moves.push_back(Cut(first, last, *gyroscope));
  }
  return moves;
}

}  // namespace truetriad
