// SPDX-License-Identifier: Apache-2.0
#include "data/stream_checks.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>
#include <span>
#include <utility>

#include "base/messages.h"
#include "base/rounded_text.h"
#include "data/collector.h"
#include "data/held_samples.h"
#include "data/time_stamps.h"
#include "math/distributions.h"
#include "model/mechanisms.h"
#include "truetriad/base/triad.h"

namespace truetriad {
namespace {

// Chosen: number of samples that determine the usual interval despite irregular first packets.
constexpr std::size_t kSpacingSamples = 1024;
// Chosen: if fewer readings are equal, this can be chance.
constexpr std::int64_t kFewestStuckSamples = 20;
// If σ is one step, at most 38 % of readings are rounded to the same value. Twenty in a row are
// rounded so once in 10^8.
constexpr double kStuckNoiseSteps = 1.0;
std::string Seconds(std::int64_t from_ns, std::int64_t to_ns) {
  return Format("%.2f s", 1e-9 * static_cast<double>(to_ns - from_ns));
}

std::string Number(double value) { return RoundedText(value, 9); }

std::string Name(Triad triad) { return std::string(TriadName(triad)); }

}  // namespace

Status StreamMonitor::CheckFinite(const SampleBlock& block) const {
  for (std::size_t i = 0; i < block.x.size(); ++i) {
    if (std::isfinite(block.x[i]) && std::isfinite(block.y[i]) && std::isfinite(block.z[i])) {
      continue;
    }
    return Error(ErrorCode::kUnreadableNumber,
                 {info_.file},
                 "data row " + std::to_string(block.row[i]) + " of the " + Name(info_.triad) +
                     " has a reading that is not finite; expected a number, or an empty field "
                     "if there is no reading");
  }
  return {};
}

Status StreamMonitor::Add(const SampleBlock& block) {
  const std::size_t size = block.x.size();
  if (size == 0) return {};
  const std::array<std::span<const double>, 3> axes = {block.x, block.y, block.z};
  bool finite = true;
  for (int axis = 0; axis < 3; ++axis) {
    double low = minimum_raw_[axis], high = maximum_raw_[axis], sum = 0.0;
    for (const double value : axes[static_cast<std::size_t>(axis)]) {
      low = std::min(low, value), high = std::max(high, value);
      sum += 0.0 * value;  // NaN once anything is not finite.
    }
    minimum_raw_[axis] = low, maximum_raw_[axis] = high;
    finite = finite && sum == 0.0;
    if (samples_ < kStepReadings) {
      const std::span<const double> values = axes[static_cast<std::size_t>(axis)];
      const double largest = std::max(std::abs(low), std::abs(high));
      resolution_raw_[axis] = SmallestStep(values, values.front(), largest, resolution_raw_[axis]);
    }
  }
  if (!finite) return CheckFinite(block);
  if (samples_ < kStepReadings) WatchEquals(block);
  for (std::size_t i = 0; i < size; ++i) {
    lengths_.Add({block.x[i], block.y[i], block.z[i]});
  }
  for (const double temperature : block.temperature_degc) {
    // A temperature that is not known yet is NaN; both comparisons are then false.
    if (temperature < lowest_degc_) lowest_degc_ = temperature;
    if (temperature > highest_degc_) highest_degc_ = temperature;
  }

  std::int64_t last_ns = samples_ == 0 ? block.time_ns[0] : last_ns_;
  if (samples_ == 0) first_ns_ = block.time_ns[0];
  for (std::size_t i = samples_ == 0 ? 1 : 0; i < size; ++i) {
    const std::int64_t spacing_ns = block.time_ns[i] - last_ns;
    if (spacing_ns < 0) {
      return Error(ErrorCode::kTimeGoesBack,
                   {info_.file},
                   "the time of the " + Name(info_.triad) + " goes back by " +
                       Seconds(block.time_ns[i], last_ns) + " at data row " +
                       std::to_string(block.row[i]) +
                       "; expected times that never decrease: sort the rows, or split the file "
                       "where the clock was set");
    }
    last_ns = block.time_ns[i];
    duplicate_times_ += static_cast<int>(spacing_ns == 0);
    if (usual_ns_ > 0.0) {
      if (IsGap(spacing_ns)) CountGap(last_ns - spacing_ns, spacing_ns);
      continue;
    }
    if (first_times_ns_.empty()) first_times_ns_.push_back(first_ns_);
    first_times_ns_.push_back(last_ns);
    if (first_times_ns_.size() > kSpacingSamples) CountFirst();
  }
  last_ns_ = last_ns;
  samples_ += static_cast<std::int64_t>(size);
  return {};
}

// Times here were shifted by time_offset_s; excluded ranges were not. The gap that an excluded
// range leaves overlaps with the range nevertheless, unless the offset is longer than the gap.
bool StreamMonitor::IsExcludedBetween(std::int64_t from_ns, std::int64_t to_ns) const {
  return std::any_of(excluded_.begin(), excluded_.end(), [&](const ExcludedRange& range) {
    return range.times.start_ns <= to_ns && from_ns <= range.times.end_ns;
  });
}

void StreamMonitor::CountFirst() {
  usual_ns_ = spacing_ns();
  if (!(usual_ns_ > 0.0)) return;
  for (std::size_t i = 1; i < first_times_ns_.size(); ++i) {
    const std::int64_t spacing_ns = first_times_ns_[i] - first_times_ns_[i - 1];
    if (IsGap(spacing_ns)) CountGap(first_times_ns_[i - 1], spacing_ns);
  }
}

void StreamMonitor::CountGap(std::int64_t from_ns, std::int64_t spacing_ns) {
  ++interruptions_;
  interruptions_ns_ += spacing_ns;
  if (IsExcludedBetween(from_ns, from_ns + spacing_ns)) return;
  ++gaps_;
  if (spacing_ns <= longest_gap_ns_) return;
  longest_gap_ns_ = spacing_ns;
  longest_gap_from_ns_ = from_ns;
}

double StreamMonitor::spacing_ns() const {
  if (usual_ns_ > 0.0) return usual_ns_;
  return first_times_ns_.size() < 2 ? 0.0 : UsualSpacing(first_times_ns_);
}

Eigen::Vector3d StreamMonitor::resolution_raw() const {
  return (resolution_raw_.array() < 1e300).select(resolution_raw_, 0.0);
}

// Finds, per axis, the reading with a majority of all repeats, if there is one (Boyer and Moore
// 1981). Counts runs of equal readings that begin and end with a jump. A coarse sensor at rest has
// runs, too, but they end by one step.
void StreamMonitor::WatchEquals(const SampleBlock& block) {
  for (std::size_t i = 0; i < block.x.size(); ++i) {
    const Eigen::Vector3d reading(block.x[i], block.y[i], block.z[i]);
    const Eigen::Vector3d before = std::exchange(runs_.last, reading).value_or(reading);
    const Eigen::Array3d change = (reading - before).cwiseAbs();
    for (int axis = 0; axis < 3 && info_.triad == Triad::kGyroscope; ++axis) {
      Repeated& most = repeated_[static_cast<std::size_t>(axis)];
      if (change[axis] == 0.0) {
        if (most.votes == 0) most = {.value = reading[axis]};
        most.votes += reading[axis] == most.value ? 1 : -1;
      } else if (before[axis] == most.value) {
        ++most.left;
        most.least_change = std::min(most.least_change, change[axis]);
      }
    }
    if (change.maxCoeff() == 0.0) {
      ++runs_.length;
      continue;
    }
    const bool is_far = (change > kFarSteps * resolution_raw_.array()).any();
    if (is_far && runs_.is_far_before) {
      const auto length = static_cast<std::size_t>(runs_.length);
      if (length >= runs_.count.size()) runs_.count.resize(length + 1);
      ++runs_.count[length];
    }
    runs_.length = 1;
    runs_.is_far_before = is_far;
  }
}

// Median number of rows in the runs; 1 if there are too few runs.
double StreamMonitor::UsualRepeats() const {
  constexpr std::int64_t kFewestRuns = 8;  // Chosen: their median is good to one or two rows.
  const std::int64_t all = std::accumulate(runs_.count.begin(), runs_.count.end(), std::int64_t{0});
  if (all < kFewestRuns) return 1.0;
  std::size_t length = 0;
  for (std::int64_t up_to = 0; 2 * up_to < all; ++length) up_to += runs_.count[length];
  return static_cast<double>(length - 1);
}

Eigen::Vector3d StreamMonitor::rest_step_raw() const {
  // Chosen: readings leave the value of a dead band eight times or more. They leave that of a stuck
  // sensor once, and that of a faulty bus a few times.
  constexpr std::int64_t kFewestTimes = 8;
  const Eigen::Vector3d step = resolution_raw();
  if (info_.triad != Triad::kGyroscope) return step;
  double band = 0.0;  // Dead band, the same for all axes.
  for (int axis = 0; axis < 3; ++axis) {
    const Repeated& most = repeated_[static_cast<std::size_t>(axis)];
    const double largest = std::max(std::abs(minimum_raw_[axis]), std::abs(maximum_raw_[axis]));
    // A repeated largest reading is saturation; the reading of a dead band is small.
    if (most.left < kFewestTimes || std::abs(most.value) >= largest) continue;
    if (most.least_change > kFarSteps * step[axis]) band = std::max(band, most.least_change);
  }
  return step.cwiseMax(2.0 * band);
}

Result<StreamSummary> StreamMonitor::Summary(const StreamCounts& counts) const {
  StreamSummary summary;
  summary.triad = info_.triad;
  summary.unit = info_.unit;
  summary.samples = samples_;
  summary.dropped_empty = counts.dropped_empty;
  if (samples_ == 0) return summary;
  summary.minimum_raw = minimum_raw_;
  summary.maximum_raw = maximum_raw_;
  summary.resolution_raw = resolution_raw();
  summary.rest_step_raw = rest_step_raw();
  summary.repeats = UsualRepeats();
  const LengthSpread::Half half = lengths_.ShortestHalf();
  summary.length_raw = half.length;
  summary.length_scatter = half.scatter;
  summary.length_extent = half.extent;
  if (samples_ >= kFewestStuckSamples && minimum_raw_ == maximum_raw_) {
    return Error(ErrorCode::kStuckSensor,
                 {info_.file},
                 "all " + std::to_string(samples_) + " readings of the " + Name(info_.triad) +
                     " are (" + Number(minimum_raw_.x()) + ", " + Number(minimum_raw_.y()) + ", " +
                     Number(minimum_raw_.z()) + ") " + info_.unit.name +
                     ": the sensor is stuck; check its wiring, its power-up and the columns")
        .About("streams." + Name(info_.triad));
  }
  if (!has_time_) return summary;
  summary.duplicate_times = duplicate_times_;
  StreamMonitor all = *this;
  if (usual_ns_ == 0.0) all.CountFirst();  // A short stream has not counted gaps yet.
  const std::int64_t without_gaps_ns = last_ns_ - first_ns_ - all.interruptions_ns_;
  if (without_gaps_ns > 0) {
    summary.rate_hz = 1e9 * static_cast<double>(samples_ - 1 - all.interruptions_) /
                      static_cast<double>(without_gaps_ns);
  }
  summary.gaps = all.gaps_;
  summary.longest_gap_s = static_cast<double>(all.longest_gap_ns_) * 1e-9;
  summary.longest_gap_at_s = 1e-9 * static_cast<double>(all.longest_gap_from_ns_ - first_ns_);
  return summary;
}

Findings StreamMonitor::Check(const StreamSummary& summary) const {
  Findings findings;
  const Triad triad = info_.triad;
  const std::string name = Name(triad);
  if (samples_ == 0) {
    findings.push_back(
        Finding(FindingCode::kNoReadings, name + ": " + info_.file + " has no readings")
            .About(triad));
    return findings;
  }
  if (summary.gaps > 0) {
    findings.push_back(Finding(FindingCode::kTimeGaps,
                               name + ": " + Counted(summary.gaps, "gap") + " in time, longest " +
                                   Number(summary.longest_gap_s) + " s at " +
                                   RoundedText(summary.longest_gap_at_s, 6) + " s")
                           .About(triad)
                           .With("gaps", static_cast<double>(summary.gaps))
                           .With("longest", summary.longest_gap_s, "s")
                           .With("longest_at", summary.longest_gap_at_s, "s"));
  }
  if (summary.duplicate_times > 0) {
    findings.push_back(Finding(FindingCode::kEqualTimes,
                               name + ": " + Counted(summary.duplicate_times, "sample") +
                                   " with the same time as the previous one")
                           .About(triad)
                           .With("samples", static_cast<double>(summary.duplicate_times)));
  }
  for (int axis = 0; axis < 3; ++axis) {
    if (samples_ >= kFewestStuckSamples && minimum_raw_[axis] == maximum_raw_[axis]) {
      findings.push_back(Finding(FindingCode::kConstantAxis,
                                 name + ": the " + AxisLetter(axis) + " axis reads " +
                                     Number(minimum_raw_[axis]) + " " + info_.unit.name +
                                     " throughout")
                             .About(triad, axis)
                             .With("reading", minimum_raw_[axis], info_.unit.name));
    }
  }
  return findings;
}

namespace {

bool IsFlat(const TriadPoseMoments& pose, int axis) {
  return pose.minimum_raw[axis] == pose.maximum_raw[axis];
}

// Median noise of the poses in which the axis changes; 0 if there are none. Noise pooled over all
// poses would be too low, since clipped poses have none. If the axis is constant in most windows of
// a pose, the noise there is zero, and motion makes the changes in the other windows.
double TypicalNoise(const std::vector<PerTriad<TriadPoseMoments>>& moments, Triad triad, int axis) {
  std::vector<double> variances;
  for (const PerTriad<TriadPoseMoments>& pose : moments) {
    const TriadPoseMoments& reading = pose[triad];
    if (reading.window_dof > 0.0 && !IsFlat(reading, axis)) {
      const bool is_noise = 2.0 * reading.constant[axis] < static_cast<double>(reading.windows);
      variances.push_back(is_noise ? reading.window_scatter_raw(axis, axis) / reading.window_dof
                                   : 0.0);
    }
  }
  return variances.empty() ? 0.0 : std::sqrt(Median(std::move(variances)));
}

// The poses in which an axis with noise is at the lower or at the upper limit of its stream's
// range, or constant between the two.
std::array<FlatPoses, 3> FlatPosesOf(const std::vector<PerTriad<TriadPoseMoments>>& moments,
                                     const StreamSummary& stream,
                                     int axis,
                                     double noise_steps) {
  const std::string name = Name(stream.triad) + " " + AxisLetter(axis) + " axis ";
  std::array<FlatPoses, 3> found;
  const auto add = [&](std::size_t kind, std::size_t pose, const std::string& how, double reading) {
    if (found[kind].poses.empty()) {
      found[kind].triad = stream.triad;
      found[kind].words = name + how + Number(reading) + " " + stream.unit.name;
      found[kind].is_clipped = kind < 2;
    }
    found[kind].poses.push_back(pose);
  };
  const std::array<double, 2> limits = {stream.minimum_raw[axis], stream.maximum_raw[axis]};
  for (std::size_t i = 0; i < moments.size(); ++i) {
    const TriadPoseMoments& pose = moments[i][stream.triad];
    if (pose.count < kFewestStuckSamples) continue;
    const std::array<double, 2> extremes = {pose.minimum_raw[axis], pose.maximum_raw[axis]};
    const std::array<double, 2> at_extreme = {pose.at_minimum[axis], pose.at_maximum[axis]};
    const bool is_flat = IsFlat(pose, axis);
    bool is_clipped = false;
    for (const std::size_t end : {0, 1}) {
      // If noise exceeds two steps, few windows reach the extreme of the stream without clipping.
      const bool heaped = noise_steps > 2.0 && pose.windows >= 5 &&
                          at_extreme[end] > 0.5 * static_cast<double>(pose.windows);
      if (extremes[end] != limits[end] || !(is_flat || heaped)) continue;
      is_clipped = true;
      add(end, i, "at its limit of ", limits[end]);
    }
    if (is_flat && !is_clipped) add(2, i, "stuck at ", extremes[0]);
  }
  return found;
}

// "words in 2 poses: 3, 4", with poses counted from 1.
std::string Listed(const FlatPoses& flat) {
  const std::size_t hits = flat.poses.size();
  return flat.words + " in " + (hits == 1 ? "pose " : std::to_string(hits) + " poses: ") +
         Named(hits, [&flat](std::size_t k) { return std::to_string(flat.poses[k] + 1); });
}

}  // namespace

std::vector<FlatPoses> FindFlatPoses(const PerTriad<Eigen::Vector3d>& resolution_raw,
                                     const std::vector<PerTriad<TriadPoseMoments>>& moments,
                                     const std::vector<StreamSummary>& streams) {
  std::vector<FlatPoses> all;
  for (const StreamSummary& stream : streams) {
    for (int axis = 0; axis < 3; ++axis) {
      const double noise = TypicalNoise(moments, stream.triad, axis);
      const double step = resolution_raw[stream.triad][axis];
      // With noise below a step a constant axis is normal.
      if (!(noise > kStuckNoiseSteps * step)) continue;
      for (FlatPoses& found : FlatPosesOf(moments, stream, axis, noise / step)) {
        const auto mechanism = found.is_clipped ? Mechanism::kClippedPoses : Mechanism::kStuckPoses;
        if (!found.poses.empty() && Acts(mechanism)) all.push_back(std::move(found));
      }
    }
  }
  return all;
}

Result<bool> RemoveFlatReadings(const PerTriad<Eigen::Vector3d>& resolution_raw,
                                std::vector<PerTriad<TriadPoseMoments>>* moments,
                                PoseSet* set) {
  struct Kind {
    std::string words;
    std::set<std::size_t> poses;
  };
  Kind clipped, stuck;
  const std::vector<FlatPoses> all = FindFlatPoses(resolution_raw, *moments, set->streams);
  for (const FlatPoses& found : all) {
    Kind& kind = found.is_clipped ? clipped : stuck;
    kind.words += (kind.words.empty() ? "" : "; ") + Listed(found);
    kind.poses.insert(found.poses.begin(), found.poses.end());
  }
  std::set<std::size_t> lost = clipped.poses;
  lost.insert(stuck.poses.begin(), stuck.poses.end());
  if (2 * lost.size() > moments->size()) {
    const std::string share =
        std::to_string(lost.size()) + " of " + std::to_string(moments->size()) + " poses are ";
    return Error(ErrorCode::kStuckSensor,
                 {set->source},
                 share +
                     (clipped.poses.empty()
                          ? "unusable (" + stuck.words + "); check the sensor and its bus"
                          : "clipped (" + clipped.words + "); set a larger full-scale range") +
                     " and record again");
  }
  const auto state = [set](FindingCode code, const std::string& what, const Kind& kind) {
    if (kind.poses.empty()) return;
    set->findings.push_back(
        Finding(code, what + kind.words + "; the sensor's readings there are skipped")
            .With("poses", static_cast<double>(kind.poses.size())));
  };
  state(FindingCode::kClippedPoses, "clipped: ", clipped);
  state(FindingCode::kStuckReadings, "", stuck);
  for (const FlatPoses& found : all) {
    for (const std::size_t i : found.poses) {
      set->poses[i].triads[found.triad].reset();
      (*moments)[i][found.triad] = {};
    }
  }
  return !all.empty();
}

}  // namespace truetriad
