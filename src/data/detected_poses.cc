// SPDX-License-Identifier: Apache-2.0
#include "data/detected_poses.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/messages.h"

namespace truetriad {
namespace {

// A window holds four samples of the slowest triad in use, to give a variance. It lasts at most 0.4
// s, so that the five windows of an activity span 2 s. If two samples need longer, it lasts as long
// as they do, as a variance needs two.
constexpr double kSamplesOfWindow = 4.0, kLongestWindowNs = 4e8, kFewestWindowSamples = 2.0;

// Number of windows at the end of a search that are searched again with the windows after them.
// With 0.1 s each they last 6.4 s: two knocks (1.5 s each) and the span of the activity fit in.
constexpr std::size_t kTailWindows = 64;

// Chosen: 64 samples determine the rate of a stream.
constexpr std::int64_t kRateSamples = 64;

// The range that readings have at least when the unit is turned over, raw; 0: not known. An
// accelerometer has a range of 2 g then; half of this is expected.
double ExpectedRange(const StreamInfo& info) {
  if (info.triad != Triad::kAccelerometer) return 0.0;
  if (!info.unit.is_counts) return kStandardGravityMps2 / info.unit.truth_per_raw;
  return info.si_per_count ? kStandardGravityMps2 / std::abs(*info.si_per_count) : 0.0;
}

// The motion as text: " (readings range: gyroscope 3.2 rad/s)".
std::string MotionSeen(const PoseSet& set) {
  std::string seen;
  for (const Triad triad : {Triad::kGyroscope, Triad::kAccelerometer, Triad::kMagnetometer}) {
    const StreamSummary* stream = set.Find(triad);
    if (stream == nullptr || stream->samples == 0) continue;
    const double range = (stream->maximum_raw - stream->minimum_raw).maxCoeff();
    seen += (seen.empty() ? " (readings range: " : ", ") + std::string(TriadName(triad)) +
            Format(" %.3g ", range) + stream->unit.name;
  }
  return seen.empty() ? seen : seen + ")";
}

}  // namespace

DetectedPoses::DetectedPoses(const StaticDetectorOptions& options,
                             const RecordingInfo& info,
                             const PerTriad<StreamMonitor*>& monitors,
                             Triad leading)
    : options_(options), info_(info), monitors_(monitors), leading_(leading) {}

Status DetectedPoses::Validate() const {
  if (!info_.has_time) {
    return NoTime(info_,
                  "rests cannot be detected",
                  ", or state the poses (`poses: every_row`, `poses: { every: 100 }`, …)");
  }
  if (!(options_.min_duration_s > 0.0) || !(options_.max_knock_s >= 0.0)) {
    return Error(ErrorCode::kInvalidValue,
                 "static detection: min_duration_s is " + std::to_string(options_.min_duration_s) +
                     " and max_knock_s is " + std::to_string(options_.max_knock_s) +
                     "; expected a positive and a non-negative number");
  }
  return {};
}

Error DetectedPoses::NoPose(const PoseSet& set) const {
  const bool has_both =
      set.Find(Triad::kGyroscope) != nullptr &&
      (set.Find(Triad::kAccelerometer) != nullptr || set.Find(Triad::kMagnetometer) != nullptr);
  const std::string duration = Format("%.1f s", set.duration_s);
  // Inertial sensors reach about 10 kHz; the limit is twice this rate.
  constexpr double kMostHz = 2e4;
  std::string too_fast;
  for (const StreamSummary& stream : set.streams) {
    const double rate_hz = static_cast<double>(stream.samples) / set.duration_s;
    if (!(set.duration_s > 0.0 && rate_hz > kMostHz) || !too_fast.empty()) continue;
    too_fast = "check the unit of the times: " + std::to_string(stream.samples) +
               " samples of the " + std::string(TriadName(stream.triad)) + " in " + duration +
               " are " + std::to_string(std::lround(rate_hz / 1e3)) + " kHz; if it is right, ";
  }
  return NotEnoughError(
      Finding(
          FindingCode::kNoRest,
          set.source + ": no rest found in " + duration + MotionSeen(set) +
              Format("; expected poses with the unit still for at least %g s",
                     options_.min_duration_s),
          too_fast +
              "hold each pose longer, or state the poses (`poses: every_row` if each row is a "
              "pose); for a unit tumbled on purpose, use `poses: { motion: { spacing_s: 0.1 } }`" +
              std::string(has_both
                              ? ""
                              : ", which needs the gyroscope and an accelerometer or magnetometer"))
          .With("duration", set.duration_s, "s")
          .With("shortest_rest", options_.min_duration_s, "s"));
}

Status DetectedPoses::Add(const std::vector<SampleBlock>& blocks) {
  if (buffer_) {
    for (const SampleBlock& block : blocks) TRUETRIAD_RETURN_IF_ERROR(AddToBuffer(block));
    return {};
  }
  const bool rates_known =
      std::all_of(info_.streams.begin(), info_.streams.end(), [&](const StreamInfo& stream) {
        return monitors_[stream.triad]->samples() >= kRateSamples;
      });
  if (rates_known) {
    // The usual case: the first blocks determine all rates, and nothing is copied.
    TRUETRIAD_RETURN_IF_ERROR(Start());
    return Add(blocks);
  }
  for (const SampleBlock& block : blocks) {
    held_.push_back({block.triad, {}});
    held_.back().samples.Append(block);
    held_samples_ += block.x.size();
  }
  return held_samples_ > kMostHeldSamples ? Start() : Status();
}

Status DetectedPoses::Start() {
  std::vector<Triad> streams;
  std::int64_t origin_ns = std::numeric_limits<std::int64_t>::max();
  for (const StreamInfo& stream : info_.streams) {
    const StreamMonitor& monitor = *monitors_[stream.triad];
    if (monitor.samples() == 0) continue;
    streams.push_back(stream.triad);
    origin_ns = std::min(origin_ns, monitor.first_ns());
  }
  const auto known = [&](const StreamInfo& info) {
    return DetectorTriad{info.triad,
                         monitors_[info.triad]->resolution_raw(),
                         ExpectedRange(info),
                         info.unit.is_counts ? 0.0 : info.unit.truth_per_raw};
  };
  std::vector<DetectorTriad> triads, witnesses;
  double width_ns = static_cast<double>(kWindowNs);
  const double leading_spacing_ns = monitors_[leading_]->spacing_ns();
  for (const Triad triad : {leading_, Triad::kGyroscope}) {
    if (std::find(streams.begin(), streams.end(), triad) == streams.end()) continue;
    if (!triads.empty() && triads.front().triad == triad) continue;
    const double spacing_ns = monitors_[triad]->spacing_ns();
    // A gyroscope over four times slower than the leading triad would make the windows too long.
    if (spacing_ns > kSamplesOfWindow * leading_spacing_ns) continue;
    width_ns = std::max({width_ns,
                         std::min(kSamplesOfWindow * spacing_ns, kLongestWindowNs),
                         kFewestWindowSamples * spacing_ns});
    triads.push_back(known(*info_.Find(triad)));
  }
  // Moving objects nearby disturb a magnetometer, so it does not distinguish rest from motion.
  if (leading_ != Triad::kMagnetometer &&
      std::find(streams.begin(), streams.end(), Triad::kMagnetometer) != streams.end()) {
    witnesses.push_back(known(*info_.Find(Triad::kMagnetometer)));
  }
  // 1e16 ns is 116 days: the end of the last window must not overflow, however far apart rows are.
  constexpr double kLongestNs = 1e16;
  width_ns = std::min(width_ns, kLongestNs);
  buffer_.emplace(origin_ns, static_cast<std::int64_t>(width_ns), streams);
  detector_.emplace(options_, triads, witnesses, width_ns * 1e-9);
  for (const auto& [triad, samples] : held_) {
    TRUETRIAD_RETURN_IF_ERROR(AddToBuffer(samples.View(triad, 0, samples.size())));
  }
  held_.clear();
  return {};
}

Status DetectedPoses::AddToBuffer(const SampleBlock& block) {
  TRUETRIAD_RETURN_IF_ERROR(buffer_->Add(block));
  peak_windows_ = std::max(peak_windows_, buffer_->size());
  if (buffer_->CompleteCount() >= kMostWindows) FindRests(/*at_end=*/false);
  return {};
}

void DetectedPoses::FindRests(bool at_end) {
  const std::size_t count = at_end ? buffer_->size() : buffer_->CompleteCount();
  const std::vector<Rest> rests = detector_->Find(*buffer_, count);

  const std::size_t tail = at_end ? count : count - kTailWindows;
  std::size_t keep_from = tail;  // Windows before this one are no longer needed.
  bool stays_open = false;
  for (const Rest& rest : rests) {
    if (rest.end() <= consumed_) continue;
    const bool goes_on =
        consumed_ > 0 && (rest.begin() <= consumed_ ||
                          detector_->IsKnock(*buffer_, {0, consumed_}, rest.runs.front()));
    if (!goes_on) ClosePose();
    const std::size_t begin = goes_on ? consumed_ : 0;
    consumed_ = 0;
    if (rest.end() <= tail) {
      AddWindows(rest, begin, rest.end());
      ClosePose();
    } else if (rest.begin() > count / 2) {
      keep_from = rest.begin();  // The rest is judged as a whole with the next chunk.
      if (goes_on) keep_from = std::min(keep_from, begin);
    } else {
      AddWindows(rest, begin, tail);
      stays_open = true;
    }
  }
  if (at_end || !stays_open) {
    ClosePose();
    consumed_ = 0;
  }
  if (at_end) return;
  // If a rest stays open, its last windows are kept and compared with what follows.
  consumed_ = stays_open ? kTailWindows : 0;
  buffer_->DropFront(stays_open ? tail - kTailWindows : keep_from);
}

void DetectedPoses::AddWindows(const Rest& rest, std::size_t begin, std::size_t end) {
  for (const auto& run : rest.runs) {
    for (const Triad triad : buffer_->streams()) {
      const auto& windows = buffer_->windows(triad);
      const std::size_t stop = std::min(run.second, end);
      for (std::size_t i = std::max(run.first, begin); i < stop; ++i) {
        open_.Add(triad, windows[i]);
      }
      open_.Break(triad);
    }
  }
}

void DetectedPoses::ClosePose() {
  if (open_.empty()) return;
  CollectedPose& done = poses_.emplace_back();
  done.pose = open_.Finish(leading_, &done.moments);
  open_ = PoseAccumulator();
}

Result<std::vector<CollectedPose>> DetectedPoses::Finish(Findings* /*findings*/) {
  if (!buffer_) TRUETRIAD_RETURN_IF_ERROR(Start());
  FindRests(/*at_end=*/true);
  return std::move(poses_);
}

}  // namespace truetriad
