// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "data/collector.h"
#include "data/repeats.h"
#include "math/distributions.h"
#include "model/mechanisms.h"

namespace truetriad {
namespace {

// Three readings on each side: the median of six stays good with two spikes among them.
constexpr std::size_t kEachSide = 3;
// A reading 8 σ from its neighbours is an outlier: white noise exceeds that once in 10^15, a hand
// that tumbles a unit less than once in 10^4 readings (tests/trust, clean).
constexpr double kFarSigmas = 8.0;
// Chosen: number of readings with one pooled scatter; 0.64 s at 100 Hz, in which a hand moves
// steadily.
constexpr std::size_t kTogether = 64;
// Chosen: adjacent spikes shift the median beside them, so the search is repeated without them.
constexpr int kMostPasses = 3;
// A skewness of over 5 σ is no chance: white noise exceeds it once in 10^6 recordings.
constexpr double kSkewSigmas = 5.0;
// If a share p of readings has an error s, the mean shifts by p s and the third moment by m = p
// s^3; so the mean shifts by (p^2 m)^(1/3), most at the largest p. Chosen: a tenth of the readings.
constexpr double kMostShare = 0.1;

std::array<double, 2 * kEachSide> Beside(const std::vector<double>& values, std::size_t i) {
  std::array<double, 2 * kEachSide> beside;
  for (std::size_t k = 0; k < kEachSide; ++k) {
    beside[2 * k] = values[i - 1 - k];
    beside[2 * k + 1] = values[i + 1 + k];
  }
  return beside;
}

double MedianBeside(const std::vector<double>& values, std::size_t i) {
  std::array<double, 2 * kEachSide> beside = Beside(values, i);
  std::sort(beside.begin(), beside.end());
  return 0.5 * (beside[kEachSide - 1] + beside[kEachSide]);
}

// Finds the outliers of one axis.
class AxisScreen {
 public:
  // `is_compared`: for each reading, whether no joint lies between it and the readings beside it.
  AxisScreen(const ReadingTrack& track,
             int axis,
             double resolution_raw,
             const std::vector<bool>& is_compared)
      : resolution_raw_(resolution_raw), off_(track.reading_raw.size(), 0.0) {
    for (const Eigen::Vector3d& reading : track.reading_raw) values_.push_back(reading[axis]);
    Compare(is_compared);
  }

  // Whether reading i is a spike: far from its neighbours, and farther than they are from theirs.
  // In a fast move between rests, the neighbours are as far off.
  bool IsSpike(std::size_t i) const {
    if (!IsFar(i)) return false;
    std::array<double, 2 * kEachSide> beside = Beside(off_, i);
    for (double& off : beside) off = std::abs(off);
    std::sort(beside.begin(), beside.end());
    // Two of the six may be spikes, too. White noise makes the third largest 0.9 σ on average, and
    // hardly ever 2 σ.
    return std::abs(off_[i]) > 0.5 * kFarSigmas * beside[2 * kEachSide - 3];
  }
  // Bound of the shift of the mean by one-sided outliers that are not far enough to be found.
  double OneSided() const {
    double count = 0.0, cubes = 0.0, squares = 0.0;
    for (std::size_t i = kEachSide; i + kEachSide < off_.size(); ++i) {
      const double sigma = sigma_[i / kTogether];
      if (!(sigma > 0.0) || IsFar(i)) continue;
      const double cube = std::pow(off_[i] / sigma, 3);
      count += 1.0;
      cubes += cube;
      squares += cube * cube;
    }
    if (!(std::abs(cubes) > kSkewSigmas * std::sqrt(squares))) return 0.0;
    const double typical = Median(sigma_);
    return std::copysign(typical * std::cbrt(kMostShare * kMostShare * std::abs(cubes) / count),
                         cubes);
  }

 private:
  bool IsFar(std::size_t i) const { return std::abs(off_[i]) > kFarSigmas * sigma_[i / kTogether]; }

  void Compare(const std::vector<bool>& is_compared) {
    for (std::size_t i = kEachSide; i + kEachSide < values_.size(); ++i) {
      if (is_compared[i]) off_[i] = values_[i] - MedianBeside(values_, i);
    }
    std::vector<double> own;
    for (std::size_t begin = 0; begin < off_.size(); begin += kTogether) {
      const auto first = off_.begin() + static_cast<std::ptrdiff_t>(begin);
      const auto count = std::min(kTogether, off_.size() - begin);
      own.push_back(
          std::max(MadSigma({first, first + static_cast<std::ptrdiff_t>(count)}), resolution_raw_));
    }
    sigma_ = own;
    for (std::size_t b = 0; b < own.size(); ++b) {
      if (b > 0) sigma_[b] = std::max(sigma_[b], own[b - 1]);
      if (b + 1 < own.size()) sigma_[b] = std::max(sigma_[b], own[b + 1]);
    }
  }

  double resolution_raw_;
  std::vector<double> values_;
  std::vector<double> off_;    // Differences from the median of the neighbours.
  std::vector<double> sigma_;  // For each group, the largest σ of off_ in it and beside it.
};

void Bridge(std::size_t begin, std::size_t end, ReadingTrack* track) {
  const std::size_t left = begin - 1;
  const double span = static_cast<double>(track->time_ns[end] - track->time_ns[left]);
  const Eigen::Vector3d from = track->reading_raw[left], to = track->reading_raw[end];
  for (std::size_t i = begin; i < end; ++i) {
    const double since = static_cast<double>(track->time_ns[i] - track->time_ns[left]);
    track->reading_raw[i] = from + (span > 0.0 ? since / span : 0.5) * (to - from);
  }
}

// False for readings with neighbours on the other side of a joint.
std::vector<bool> AwayFromJoints(const std::vector<RecordingJoint>& joints,
                                 const ReadingTrack& track) {
  std::vector<bool> is_away(track.time_ns.size(), true);
  for (const RecordingJoint& joint : joints) {
    const auto after = static_cast<std::size_t>(
        std::lower_bound(track.time_ns.begin(), track.time_ns.end(), joint.time_ns) -
        track.time_ns.begin());
    for (std::size_t i = after - std::min(after, kEachSide);
         i < std::min(after + kEachSide, is_away.size());
         ++i) {
      is_away[i] = false;
    }
  }
  return is_away;
}

// Result of the search for outliers of a moving unit.
struct SpikeScreen {
  std::int64_t replaced = 0;
  // Bound of the shift of the mean by one-sided outliers too small to be found one by one; zero if
  // the skewness may be chance.
  Eigen::Vector3d one_sided_raw = Eigen::Vector3d::Zero();
};

// Replaces each spike by linear interpolation; integration bridges a missing gyroscope reading in
// the same way. The difference of a reading from the median of three readings on each side is
// compared with the scatter of such differences around it, so that a hard move does not look like
// spikes. `resolution_raw`: the sensor's smallest step. Readings on different sides of a joint are
// no neighbours.
SpikeScreen ReplaceSpikes(const Eigen::Vector3d& resolution_raw,
                          const std::vector<RecordingJoint>& joints,
                          ReadingTrack* track) {
  SpikeScreen screen;
  const std::size_t count = track->reading_raw.size();
  const std::vector<bool> is_compared = AwayFromJoints(joints, *track);
  std::vector<bool> is_replaced(count, false);
  for (int pass = 0; pass < kMostPasses; ++pass) {
    const std::array<AxisScreen, 3> axes = {AxisScreen(*track, 0, resolution_raw[0], is_compared),
                                            AxisScreen(*track, 1, resolution_raw[1], is_compared),
                                            AxisScreen(*track, 2, resolution_raw[2], is_compared)};
    for (int axis = 0; axis < 3; ++axis) {
      screen.one_sided_raw[axis] = axes[static_cast<std::size_t>(axis)].OneSided();
    }
    const auto is_spike = [&](std::size_t i) {
      return i + kEachSide < count && std::any_of(axes.begin(), axes.end(), [i](const auto& axis) {
               return axis.IsSpike(i);
             });
    };
    bool is_new = false;
    for (std::size_t i = kEachSide; i < count; ++i) {
      if (!is_spike(i) || !Acts(Mechanism::kMotionSpikes)) continue;
      const std::size_t begin = i;
      for (; is_spike(i); ++i) {
        is_new = is_new || !is_replaced[i];
        is_replaced[i] = true;
      }
      Bridge(begin, i, track);
    }
    if (!is_new) break;
  }
  screen.replaced = std::count(is_replaced.begin(), is_replaced.end(), true);
  return screen;
}

// Keeps all readings of a unit that never rests.
class MotionCollector : public Collector {
 public:
  explicit MotionCollector(const RecordingInfo& info) : info_(info) {}

  Status Validate() const override {
    if (!info_.has_time) {
      return NoTime(info_, "motion cannot be tracked");
    }
    const bool sees_vector =
        info_.Find(Triad::kAccelerometer) != nullptr || info_.Find(Triad::kMagnetometer) != nullptr;
    if (info_.Find(Triad::kGyroscope) == nullptr || !sees_vector) {
      return Error(ErrorCode::kMissingSensor,
                   {info_.path},
                   "motion needs the gyroscope and an accelerometer or magnetometer to "
                   "track the attitude; add the missing columns");
    }
    return {};
  }

  Status Add(const std::vector<SampleBlock>& blocks) override {
    for (const SampleBlock& block : blocks) {
      ReadingTrack& track = tracks_[block.triad];
      Append(block, &track);
      if (block.triad != Triad::kGyroscope) continue;
      track.row.insert(track.row.end(), block.row.begin(), block.row.end());
    }
    return {};
  }

  Status Finish(PoseSet* set) override {
    set->tracks = std::move(tracks_);
    const auto tell = [set](const StreamSummary& stream,
                            FindingCode code,
                            std::int64_t count,
                            const std::string& unit,
                            const std::string& what) {
      if (count == 0) return;
      set->findings.push_back(Finding(code,
                                      std::string(TriadName(stream.triad)) + ": " +
                                          std::to_string(count) + " of " +
                                          std::to_string(stream.samples) + " readings " + what)
                                  .About(stream.triad)
                                  .With(unit, static_cast<double>(count)));
    };
    for (const StreamSummary& stream : set->streams) {
      const auto held = LeaveOutHeld(stream, &set->tracks[stream.triad]);
      tell(stream,
           FindingCode::kRepeatedRows,
           static_cast<std::int64_t>(held),
           "rows",
           "repeat the reading before and are left out: the log is faster than the sensor");
    }
    FindJointsInMotion(set);
    for (StreamSummary& stream : set->streams) {
      const SpikeScreen screen =
          ReplaceSpikes(stream.resolution_raw, set->joints, &set->tracks[stream.triad]);
      stream.one_sided_raw = screen.one_sided_raw;
      tell(stream,
           FindingCode::kReadingsLeftOut,
           screen.replaced,
           "readings",
           "are replaced by interpolation, since they are far from their neighbours (spikes)");
    }
    return {};
  }

 private:
  RecordingInfo info_;
  PerTriad<ReadingTrack> tracks_;
};

}  // namespace

std::unique_ptr<Collector> MakeMotionCollector(const RecordingInfo& info) {
  return std::make_unique<MotionCollector>(info);
}

}  // namespace truetriad
