// SPDX-License-Identifier: Apache-2.0
#include "motion/track.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "data/readings_at.h"
#include "data/repeats.h"
#include "data/time_stamps.h"
#include "model/mechanisms.h"
#include "truetriad/math/rotation.h"

namespace truetriad {
namespace {

// Usual interval of the times, s; zero if no two of them differ.
double UsualSpacingS(std::span<const std::int64_t> time_ns) {
  return time_ns.size() < 2 ? 0.0 : 1e-9 * UsualSpacing(time_ns);
}

// Sums over the readings gathered at one node, of their distances from the node in time and in
// angle.
struct TurnSums {
  double time = 0.0, squared = 0.0;
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();

  void Add(double since_s, const Eigen::Vector3d& angle_rad) {
    time += since_s;
    squared += since_s * since_s;
    moment += since_s * angle_rad;
  }
  // The constant rate that fits the turns by least squares; null if there is no turn.
  std::shared_ptr<const Turning> TurningOf(int count, const TriadModel<double>& gyroscope) const {
    if (!(moment.squaredNorm() > 0.0)) return nullptr;
    const Eigen::Vector3d rate_radps = moment / squared;
    return std::make_shared<const Turning>(
        Turning{time / count,
                squared / count,
                rate_radps,
                gyroscope.sensitivity * rate_radps + gyroscope.bias});
  }
};

// The body's rotations along a chain of nodes by the gyroscope's readings. A reading is the mean
// rate over an interval about its time: half of the time to the next reading has the rate of this
// reading, and the other half that of the next.
class ChainTurns {
 public:
  // `rate_radps`: the rate at each reading. All three must outlive this.
  ChainTurns(const std::vector<double>& time_s,
             const std::vector<Eigen::Vector3d>& rate_radps,
             const std::vector<Moment>& nodes)
      : time_s_(time_s),
        rate_radps_(rate_radps),
        nodes_(nodes),
        to_reading_(time_s.size(), Eigen::Quaterniond::Identity()),
        whole_(nodes.size(), Eigen::Quaterniond::Identity()) {
    for (std::size_t k = 0; k + 1 < nodes.size(); ++k) {
      for (std::size_t i = nodes[k].reading; i < nodes[k + 1].reading; ++i) {
        const double half_s = 0.5 * (time_s[i + 1] - time_s[i]);
        Eigen::Quaterniond& next = i + 1 == nodes[k + 1].reading ? whole_[k] : to_reading_[i + 1];
        next = to_reading_[i] * RotationExp(half_s * (rate_radps[i] + rate_radps[i + 1]));
      }
    }
  }

  // From node k to the next node.
  const Eigen::Quaterniond& Whole(std::size_t k) const { return whole_[k]; }
  // From node k to a time between the readings i and i + 1, neither of which is beyond the next
  // node.
  Eigen::Quaterniond At(std::size_t k, std::size_t i, double time_s) const {
    if (Nearest(i, time_s) == i) return To(to_reading_[i], i, time_s);
    return To(i + 1 == nodes_[k + 1].reading ? whole_[k] : to_reading_[i + 1], i + 1, time_s);
  }
  // The rate at a time between the readings i and i + 1.
  const Eigen::Vector3d& RateAt(std::size_t i, double time_s) const {
    return rate_radps_[Nearest(i, time_s)];
  }

 private:
  std::size_t Nearest(std::size_t i, double time_s) const {
    const bool is_next =
        i + 1 < time_s_.size() && time_s - time_s_[i] > 0.5 * (time_s_[i + 1] - time_s_[i]);
    return is_next ? i + 1 : i;
  }
  Eigen::Quaterniond To(const Eigen::Quaterniond& reading, std::size_t i, double time_s) const {
    return reading * RotationExp((time_s - time_s_[i]) * rate_radps_[i]);
  }

  const std::vector<double>& time_s_;
  const std::vector<Eigen::Vector3d>& rate_radps_;
  const std::vector<Moment>& nodes_;
  std::vector<Eigen::Quaterniond> to_reading_;  // from the last node before a reading
  std::vector<Eigen::Quaterniond> whole_;       // from each node to the next
};

// Removes each piece of the chain in which no reading of the leading sensor shows the attitude.
void RemoveUntied(Triad leading, std::vector<Moment>* nodes) {
  std::size_t kept = 0;
  for (std::size_t begin = 0; begin < nodes->size();) {
    std::size_t end = begin;
    bool is_tied = false;
    do {
      is_tied = is_tied || (*nodes)[end].seen(leading).count > 0;
    } while ((*nodes)[end++].is_linked);
    for (; begin < end; ++begin) {
      if (is_tied) (*nodes)[kept++] = (*nodes)[begin];
    }
  }
  nodes->resize(kept);
}

}  // namespace

Result<MotionTrack> MotionTrack::Of(const PoseSet& poses, const PerTriad<bool>& wanted) {
  MotionTrack track;
  const ReadingTrack& gyroscope = poses.tracks[Triad::kGyroscope];
  const auto missing = [&](Triad triad) {
    return Error(ErrorCode::kNoReadings,
                 {poses.source},
                 "the " + std::string(TriadName(triad)) +
                     " has no two readings at different times; expected a recording of the "
                     "whole motion");
  };
  if (gyroscope.time_ns.size() < 2) return missing(Triad::kGyroscope);
  const std::int64_t begin_ns = gyroscope.time_ns.front();
  const auto seconds = [begin_ns](std::int64_t time_ns) {
    return 1e-9 * static_cast<double>(time_ns - begin_ns);
  };
  for (std::size_t i = 0; i < gyroscope.time_ns.size(); ++i) {
    // If readings have equal times, only the first counts.
    if (i > 0 && gyroscope.time_ns[i] <= gyroscope.time_ns[i - 1]) continue;
    track.time_s_.push_back(seconds(gyroscope.time_ns[i]));
    track.rate_raw_.push_back(gyroscope.reading_raw[i]);
  }
  for (const Triad triad : {Triad::kAccelerometer, Triad::kMagnetometer}) {
    if (!wanted[triad]) continue;
    const ReadingTrack& readings = poses.tracks[triad];
    if (readings.time_ns.size() < 2) return missing(triad);
    Vectors& vectors = track.vectors_[triad];
    for (const std::int64_t time_ns : readings.time_ns) vectors.time_s.push_back(seconds(time_ns));
    vectors.reading_raw = readings.reading_raw;
    track.spacing_s_[triad] = UsualSpacingS(readings.time_ns);
    if (!(track.spacing_s_[triad] > 0.0)) return missing(triad);
  }
  if (track.time_s_.size() < 2) return missing(Triad::kGyroscope);
  track.spacing_s_[Triad::kGyroscope] = UsualSpacingS(gyroscope.time_ns);
  std::vector<Span> excluded;
  for (const TimeRange& range : poses.excluded) {
    excluded.push_back({seconds(range.start_ns), seconds(range.end_ns)});
  }
  track.FindUntoldSteps(excluded);
  for (const RecordingJoint& joint : poses.joints) track.BreakBefore(seconds(joint.time_ns));
  return track;
}

void MotionTrack::FindUntoldSteps(const std::vector<Span>& excluded) {
  const std::size_t steps = time_s_.size() - 1;
  is_untold_.assign(steps, false);
  const double bridged_s = std::max(kBridgedS, kGapSpacings * spacing_s_[Triad::kGyroscope]);
  for (std::size_t i = 0; i < steps; ++i) {
    const double step_s = time_s_[i + 1] - time_s_[i];
    is_untold_[i] = step_s > bridged_s && Acts(Mechanism::kMotionGaps);
    if (!is_untold_[i]) continue;
    const bool is_excluded =
        std::any_of(excluded.begin(), excluded.end(), [this, i](const Span& span) {
          return span.from_s < time_s_[i + 1] && time_s_[i] < span.to_s;
        });
    // If readings are excluded on request, the gap is no fault of the recording.
    if (is_excluded) continue;
    untold_s_ += step_s;
    if (i == 0 || !is_untold_[i - 1]) ++untold_;
  }
}

void MotionTrack::BreakBefore(double time_s) {
  // The joint's time may be rounded by half a nanosecond.
  const auto after = std::lower_bound(time_s_.begin(), time_s_.end(), time_s - 5e-10);
  if (after == time_s_.begin() || after == time_s_.end()) return;
  is_untold_[static_cast<std::size_t>(after - time_s_.begin()) - 1] = true;
}

void MotionTrack::SetForces(const TriadModel<double>& accelerometer) {
  const Vectors& readings = vectors_[Triad::kAccelerometer];
  const Eigen::Matrix3d correction = accelerometer.Correction();
  std::vector<double> stamped_s = time_s_;  // shifted below to the other sensor's clock
  for (double& at_s : stamped_s) at_s += ahead_s_[Triad::kAccelerometer];
  accelerometer_raw_ = ReadingsAt(stamped_s, readings.time_s, readings.reading_raw);
  force_mps2_ = accelerometer_raw_;
  for (Eigen::Vector3d& force : force_mps2_) force = correction * (force - accelerometer.bias);
}

GyroReadings MotionTrack::Between(const Moment& node, const Moment& next) const {
  const std::size_t count = next.reading - node.reading + 1;
  GyroReadings readings{{&time_s_[node.reading], count}, {&rate_raw_[node.reading], count}, {}};
  if (!force_mps2_.empty()) readings.force_mps2 = {&force_mps2_[node.reading], count};
  return readings;
}

std::vector<Moment> MotionTrack::NodesEvery(double spacing_s) const {
  const auto every =
      static_cast<std::size_t>(std::clamp(std::round(spacing_s / spacing_s_[Triad::kGyroscope]),
                                          1.0,
                                          static_cast<double>(time_s_.size())));
  std::vector<Moment> nodes;
  nodes.reserve(time_s_.size() / every + 2);
  std::size_t since = 0;  // steps from the last node
  for (std::size_t i = 0; i < time_s_.size(); ++i, ++since) {
    const bool is_last = i + 1 == time_s_.size();
    const bool after_break = i > 0 && is_untold_[i - 1];
    if (!nodes.empty() && since < every && !after_break && !is_last && !is_untold_[i]) continue;
    if (!nodes.empty()) nodes.back().is_linked = !after_break;
    nodes.emplace_back().reading = i;
    since = 0;
  }
  return nodes;
}

std::vector<Eigen::Vector3d> MotionTrack::RatesBy(const GyroModel* gyroscope) const {
  std::vector<Eigen::Vector3d> rate_radps(time_s_.size(), Eigen::Vector3d::Zero());
  if (gyroscope == nullptr) return rate_radps;
  const Eigen::Matrix3d correction = gyroscope->triad.Correction();
  for (std::size_t i = 0; i < rate_radps.size(); ++i) {
    Eigen::Vector3d raw = rate_raw_[i] - gyroscope->triad.bias;
    if (!force_mps2_.empty()) raw -= gyroscope->g_sensitivity * force_mps2_[i];
    rate_radps[i] = correction * raw;
  }
  return rate_radps;
}

std::vector<Moment> MotionTrack::Gather(double spacing_s, const GyroModel* gyroscope) const {
  std::vector<Moment> nodes = NodesEvery(spacing_s);
  const std::vector<Eigen::Vector3d> rate_radps = RatesBy(gyroscope);
  const ChainTurns turns(time_s_, rate_radps, nodes);
  for (const Triad triad : {Triad::kAccelerometer, Triad::kMagnetometer}) {
    const Vectors& readings = vectors_[triad];
    const double reach_s = 0.5 * spacing_s_[Triad::kGyroscope];
    std::vector<TurnSums> sums(nodes.size());
    std::size_t k = 0, i = 0;
    for (std::size_t j = 0; j < readings.time_s.size(); ++j) {
      const double time_s = readings.time_s[j] - ahead_s_[triad];
      if (time_s < time_s_.front() - reach_s || time_s > time_s_.back() + reach_s) continue;
      while (k + 1 < nodes.size() && TimeOf(nodes[k + 1]) <= time_s) ++k;
      i = std::max(i, nodes[k].reading);
      while (i + 1 < time_s_.size() && time_s_[i + 1] <= time_s) ++i;
      const double since_s = time_s - TimeOf(nodes[k]);
      const bool has_next = k + 1 < nodes.size();
      const double until_s = has_next ? TimeOf(nodes[k + 1]) - time_s : 0.0;
      Eigen::Quaterniond turned = Eigen::Quaterniond::Identity();  // from the node to the reading
      std::size_t at = k;
      if (nodes[k].is_linked) {
        turned = turns.At(k, i, time_s);
        if (since_s > until_s) {
          at = k + 1;
          turned = turns.Whole(k).conjugate() * turned;
        }
      } else if (std::abs(since_s) > reach_s) {
        // If a reading lies in a gap of the gyroscope, it belongs to no node.
        if (!has_next || until_s > reach_s) continue;
        at = k + 1;
      }
      GatheredReadings& seen = nodes[at].seen(triad);
      seen.mean_raw += readings.reading_raw[j];
      const Eigen::Matrix3d turn = turned.conjugate().toRotationMatrix();
      seen.turn += turn;
      seen.turn_per_s += Skew(turns.RateAt(i, time_s)) * turn;
      ++seen.count;
      sums[at].Add(time_s - TimeOf(nodes[at]), RotationLog(turned));
    }
    for (std::size_t n = 0; n < nodes.size(); ++n) {
      GatheredReadings& seen = nodes[n].seen(triad);
      if (seen.count == 0) continue;
      seen.mean_raw /= seen.count;
      seen.turn /= seen.count;
      seen.turn_per_s /= seen.count;
      if (gyroscope != nullptr) seen.turning = sums[n].TurningOf(seen.count, gyroscope->triad);
    }
  }
  RemoveUntied(
      vectors_[Triad::kAccelerometer].time_s.empty() ? Triad::kMagnetometer : Triad::kAccelerometer,
      &nodes);
  return nodes;
}

}  // namespace truetriad
