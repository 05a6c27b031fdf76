// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string>
#include <utility>

#include "base/messages.h"
#include "data/collector.h"
#include "data/readings_at.h"
#include "model/mechanisms.h"
#include "truetriad/base/triad.h"

namespace truetriad {
namespace {

// A joint is found if gravity turns by over 20 deg plus 1.5 times the angle that the gyroscope
// gives. Bias, misalignment and bandwidth explain less than 20 deg, and gains are above 1 / 1.5.
constexpr double kUnexplainedRad = 0.35, kGainOff = 1.5;
// Number of readings before and after a joint whose medians are compared; a spike does no harm.
constexpr std::size_t kReadings = 3;
// Chosen: at a joint, one step from a reading to the next makes over 60 % of the change. A turn
// takes several steps, even if a wrong gain or unit of the gyroscope leaves it unexplained.
constexpr double kAtOnce = 0.6;

struct Field {
  const std::vector<Eigen::Vector3d>& readings;  // At the times of the gyroscope.
  double strength_raw = 0.0;                     // An upper bound of gravity or field.
  std::size_t spacing = 1;                       // Gyroscope readings per reading of the field.
};

struct Readings {
  const std::vector<std::int64_t>& time_ns;
  const std::vector<Eigen::Vector3d>& gyroscope;
  Field accelerometer;
  std::optional<Field> magnetometer;
  double rad_per_raw = 1.0;
  Eigen::Vector3d rest_raw = Eigen::Vector3d::Zero();  // The gyroscope's reading at rest.

  std::size_t size() const { return time_ns.size(); }
};

// A joint between readings number `at` and at + 1.
struct FoundJoint {
  std::size_t at = 0;
  double turned_rad = 0.0;   // Lower bound of the turn, by the vector sensors.
  double counted_rad = 0.0;  // Upper bound of the turn, by the gyroscope.
};

double HalfRange(const StreamSummary& stream) {
  return 0.5 * (stream.maximum_raw - stream.minimum_raw).maxCoeff();
}

// An upper bound of gravity in raw units.
double GravityRaw(const StreamSummary& accelerometer) {
  const Unit& unit = accelerometer.unit;
  return unit.is_counts ? HalfRange(accelerometer) : kStandardGravityMps2 / unit.truth_per_raw;
}

// Number of gyroscope rows between new readings of a sensor, or between new readings of the
// gyroscope if that is more.
std::size_t SpacingOf(const StreamSummary& stream, const StreamSummary& gyroscope) {
  if (!(stream.rate_hz > 0.0)) return 1;
  const double rows =
      std::max(stream.repeats * gyroscope.rate_hz / stream.rate_hz, gyroscope.repeats);
  return std::max<std::size_t>(1, std::lround(std::ceil(rows - 0.1)));
}

// The readings in which joints are sought. Unset if there is no accelerometer, or if the gyroscope
// is in counts, which give no angle.
std::optional<Readings> ReadingsOf(const PoseSet& set,
                                   const std::vector<std::int64_t>& time_ns,
                                   const std::vector<Eigen::Vector3d>& gyroscope_raw,
                                   const std::vector<Eigen::Vector3d>& accelerometer_raw,
                                   const std::vector<Eigen::Vector3d>& magnetometer_raw) {
  const StreamSummary* gyroscope = set.Find(Triad::kGyroscope);
  const StreamSummary* accelerometer = set.Find(Triad::kAccelerometer);
  const StreamSummary* magnetometer = set.Find(Triad::kMagnetometer);
  if (gyroscope == nullptr || accelerometer == nullptr || gyroscope->unit.is_counts ||
      accelerometer_raw.size() != time_ns.size()) {
    return std::nullopt;
  }
  Readings readings{
      time_ns,
      gyroscope_raw,
      {accelerometer_raw, GravityRaw(*accelerometer), SpacingOf(*accelerometer, *gyroscope)},
      {},
      gyroscope->unit.truth_per_raw};
  if (magnetometer != nullptr && magnetometer_raw.size() == time_ns.size()) {
    readings.magnetometer.emplace(
        Field{magnetometer_raw, HalfRange(*magnetometer), SpacingOf(*magnetometer, *gyroscope)});
  }
  return readings;
}

// Median of three readings from `begin` on, per axis.
Eigen::Vector3d MedianFrom(const std::vector<Eigen::Vector3d>& readings, std::size_t begin) {
  const Eigen::Vector3d &a = readings[begin], &b = readings[begin + 1], &c = readings[begin + 2];
  return a.cwiseMin(b).cwiseMax(a.cwiseMax(b).cwiseMin(c));
}

// The least angle by which a vector of this length turns when it changes by `change`.
double TurnOf(double change, double length) {
  return 2.0 * std::asin(std::clamp(0.5 * change / length, 0.0, 1.0));
}

// Integral of the gyroscope's rate over readings [first, last], rad.
double WayOf(const Readings& readings, std::size_t first, std::size_t last) {
  double way = 0.0;
  for (std::size_t i = first; i < last; ++i) {
    const Eigen::Vector3d rate =
        0.5 * (readings.gyroscope[i] + readings.gyroscope[i + 1]) - readings.rest_raw;
    const double step_s = 1e-9 * static_cast<double>(readings.time_ns[i + 1] - readings.time_ns[i]);
    way += readings.rad_per_raw * rate.norm() * step_s;
  }
  return way;
}

bool IsExplained(double turned_rad, double way_rad) {
  return turned_rad <= kGainOff * way_rad + kUnexplainedRad;
}

// Change of the accelerometer from reading `at` to the next one that is no repeat.
double StepAt(const Field& accelerometer, std::size_t at) {
  const std::size_t next = std::min(at + accelerometer.spacing, accelerometer.readings.size() - 1);
  return (accelerometer.readings[next] - accelerometer.readings[at]).norm();
}

// At a joint, gravity and field turn at once, but the gyroscope shows hardly any turn. A jerk does
// not turn the field, and a magnetic disturbance does not turn gravity.
std::optional<FoundJoint> JointAt(const Readings& readings, std::size_t at) {
  const Field& gravity = readings.accelerometer;
  const Field& field = *readings.magnetometer;
  const std::size_t spacing = std::max(gravity.spacing, field.spacing);
  const std::size_t first = at + 1 - kReadings, after = at + spacing;
  const auto change = [&](const Field& sensor) {
    return (MedianFrom(sensor.readings, after) - MedianFrom(sensor.readings, first)).norm();
  };
  const double by_gravity = change(gravity);
  if (!(StepAt(gravity, at) > kAtOnce * by_gravity)) return std::nullopt;
  const double turned =
      std::min(TurnOf(by_gravity, gravity.strength_raw), TurnOf(change(field), field.strength_raw));
  if (!(turned > kUnexplainedRad)) return std::nullopt;
  // A repeated reading may have been taken a spacing earlier.
  const double way = WayOf(readings, first - std::min(first, spacing - 1), after + kReadings - 1);
  if (IsExplained(turned, way)) return std::nullopt;
  return FoundJoint{at, turned, way};
}

// All joints that gravity and field show. Of overlapping joints, only the largest step is kept.
std::vector<FoundJoint> JointsOf(const Readings& readings) {
  std::vector<FoundJoint> joints;
  if (!readings.magnetometer) return joints;
  const std::size_t spacing =
      std::max(readings.accelerometer.spacing, readings.magnetometer->spacing);
  const std::size_t reach = spacing + kReadings - 1;
  for (std::size_t at = kReadings - 1; at + reach < readings.size(); ++at) {
    const std::optional<FoundJoint> joint = JointAt(readings, at);
    if (!joint) continue;
    const bool is_same = !joints.empty() && at <= joints.back().at + reach;
    if (!is_same) {
      joints.push_back(*joint);
    } else if (StepAt(readings.accelerometer, at) >
               StepAt(readings.accelerometer, joints.back().at)) {
      joints.back() = *joint;
    }
  }
  return joints;
}

// Finds a joint between two rests: gravity turned in one step by more than the gyroscope explains.
std::optional<FoundJoint> JointBetweenRests(const Readings& readings,
                                            const Eigen::Vector3d& before_raw,
                                            const Eigen::Vector3d& after_raw) {
  const Field& gravity = readings.accelerometer;
  const double change = (after_raw - before_raw).norm();
  const double turned = TurnOf(change, gravity.strength_raw);
  if (!(turned > kUnexplainedRad)) return std::nullopt;
  const double way = WayOf(readings, 0, readings.size() - 1);
  if (IsExplained(turned, way)) return std::nullopt;
  // If a sensor has fewer readings between the rests, any turn shows as one step.
  if (readings.size() < kReadings * gravity.spacing) return std::nullopt;
  std::size_t at = 0;
  for (std::size_t i = 1; i + 1 < readings.size(); ++i) {
    if (StepAt(gravity, i) > StepAt(gravity, at)) at = i;
  }
  if (!(StepAt(gravity, at) > kAtOnce * change)) return std::nullopt;
  return FoundJoint{at, turned, way};
}

double SecondsAt(const PoseSet& set, std::int64_t time_ns) {
  return 1e-9 * static_cast<double>(time_ns - set.start_ns);
}

std::string WhatIsSeen(const FoundJoint& joint) {
  return Format("gravity turns by at least %.0f deg there, but ", kDegPerRad * joint.turned_rad) +
         Format("the gyroscope's rates integrate to at most %.0f deg",
                kDegPerRad * joint.counted_rad);
}

Finding FindingAt(const PoseSet& set, std::int64_t time_ns, std::int64_t row, std::string seen) {
  const double time_s = SecondsAt(set, time_ns);
  return Finding(FindingCode::kJoinedRecording,
                 Format("pieces of recordings are joined at %.2f s (data row ", time_s) +
                     std::to_string(row) + ")" + (seen.empty() ? "" : ": ") + std::move(seen))
      .With("time", time_s, "s")
      .With("row", static_cast<double>(row));
}

// The leading sensor's data row at a time between two rests, as if rows were evenly spaced.
std::int64_t RowAt(const StaticPose& before, const StaticPose& after, std::int64_t time_ns) {
  const double share =
      static_cast<double>(time_ns - before.end_ns) /
      static_cast<double>(std::max<std::int64_t>(after.start_ns - before.end_ns, 1));
  const auto rows = static_cast<double>(after.first_row - before.last_row);
  return before.last_row + std::llround(std::clamp(share, 0.0, 1.0) * rows);
}

bool IsBetween(const RecordingJoint& joint, const StaticPose& before, const StaticPose& after) {
  return joint.time_ns > before.end_ns && joint.time_ns <= after.start_ns;
}

bool IsWithinMove(const RecordingJoint& joint, const PoseSet& set) {
  return std::any_of(set.moves.begin(), set.moves.end(), [&](const RecordedMove& move) {
    return IsBetween(joint, set.poses[move.from], set.poses[move.from + 1]);
  });
}

std::optional<Finding> FaultOf(const RecordedMove& move, const PoseSet& set) {
  const StaticPose& before = set.poses[move.from];
  const StaticPose& after = set.poses[move.from + 1];
  for (const RecordingJoint& joint : set.joints) {
    if (!IsBetween(joint, before, after)) continue;
    return FindingAt(set, joint.time_ns, joint.row, joint.seen);
  }
  if (move.fault || !before.triads[Triad::kAccelerometer] || !after.triads[Triad::kAccelerometer]) {
    return std::nullopt;
  }
  std::optional<Readings> readings = ReadingsOf(
      set, move.time_ns, move.gyroscope_raw, move.accelerometer_raw, move.magnetometer_raw);
  if (!readings || readings->size() < 2) return std::nullopt;
  const auto &first = before.triads[Triad::kGyroscope], &second = after.triads[Triad::kGyroscope];
  if (first && second) readings->rest_raw = 0.5 * (first->mean_raw + second->mean_raw);
  std::optional<FoundJoint> joint =
      JointBetweenRests(*readings,
                        before.triads[Triad::kAccelerometer]->mean_raw,
                        after.triads[Triad::kAccelerometer]->mean_raw);
  if (!joint) {
    const std::vector<FoundJoint> inside = JointsOf(*readings);
    if (inside.empty()) return std::nullopt;
    joint = inside.front();
  }
  if (!Acts(Mechanism::kJointsSeen)) return std::nullopt;
  const std::int64_t time_ns = move.time_ns[joint->at + 1];
  return FindingAt(set, time_ns, RowAt(before, after, time_ns), WhatIsSeen(*joint));
}

// Adds findings for joints that have none yet.
void TellJoints(PoseSet* set) {
  std::size_t told = 0;
  for (RecordingJoint& joint : set->joints) {
    if (std::exchange(joint.is_told, true) || ++told > kMostPlacesNamed) continue;
    set->findings.push_back(FindingAt(*set, joint.time_ns, joint.row, joint.seen));
  }
  if (told <= kMostPlacesNamed) return;
  const auto more = static_cast<long long>(told - kMostPlacesNamed);
  set->findings.push_back(
      Finding(FindingCode::kJoinedRecording,
              "pieces of recordings are joined at " + Counted(more, "more place"))
          .With("places", static_cast<double>(more)));
}

}  // namespace

void BreakMovesAtJoints(PoseSet* set) {
  for (RecordedMove& move : set->moves) {
    if (auto fault = FaultOf(move, *set)) move.fault = std::move(fault);
  }
  for (RecordingJoint& joint : set->joints) {
    // If a joint lies within a move, the fault of the move reports it.
    joint.is_told = joint.is_told || IsWithinMove(joint, *set);
  }
  TellJoints(set);
}

void FindJointsInMotion(PoseSet* set) {
  const ReadingTrack& gyroscope = set->tracks[Triad::kGyroscope];
  const auto beside_gyroscope = [&](Triad triad) {
    const ReadingTrack& track = set->tracks[triad];
    return ReadingsAt(gyroscope.time_ns, track.time_ns, track.reading_raw);
  };
  const std::vector<Eigen::Vector3d> accelerometer = beside_gyroscope(Triad::kAccelerometer);
  const std::vector<Eigen::Vector3d> magnetometer = beside_gyroscope(Triad::kMagnetometer);
  const std::optional<Readings> readings =
      ReadingsOf(*set, gyroscope.time_ns, gyroscope.reading_raw, accelerometer, magnetometer);
  if (readings) {
    for (const FoundJoint& joint : JointsOf(*readings)) {
      if (!Acts(Mechanism::kJointsSeen)) break;
      set->joints.push_back({gyroscope.time_ns[joint.at + 1],
                             gyroscope.row[joint.at + 1],
                             WhatIsSeen(joint),
                             /*is_told=*/false});
    }
  }
  std::stable_sort(set->joints.begin(), set->joints.end(), [](const auto& a, const auto& b) {
    return a.time_ns < b.time_ns;
  });
  TellJoints(set);
}

}  // namespace truetriad
