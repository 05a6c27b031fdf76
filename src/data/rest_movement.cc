// SPDX-License-Identifier: Apache-2.0
#include "data/rest_movement.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <string>

#include "base/messages.h"
#include "model/mechanisms.h"

namespace truetriad {
namespace {

// Of the range over all attitudes, 2 g of an accelerometer: 0.6 deg from the middle of a rest to
// its ends.
constexpr double kMovedShare = 0.005;
// 3 deg within the middle of a rest: a unit held in the hand, whose mean is worth little.
constexpr double kWanderShare = 0.03;
// So many times what white noise does to an eighth of the rest, which chance never reaches.
constexpr double kClearFactor = 8.0;
// As many as people read.
constexpr std::size_t kMostListed = 12;
// Rests that tell by how much readings differ from attitude to attitude.
constexpr std::size_t kFewestRests = 4;

double UpperMedian(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// How far a triad moves within one rest, per axis, raw unit.
struct Movement {
  bool known = false;
  Eigen::Array3d ends = Eigen::Array3d::Zero();    // the outer quarters from the middle half
  Eigen::Array3d wander = Eigen::Array3d::Zero();  // rms within the middle half
  Eigen::Array3d noise = Eigen::Array3d::Zero();   // what white noise does to an eighth
};

Movement MovementOf(const TriadPoseMoments& moments) {
  Movement movement;
  const std::vector<Eigen::Vector3d>& eighths = moments.eighths_raw;
  if (eighths.size() != kEighths || !(moments.window_dof > 0.0 || moments.windows > 0)) {
    return movement;
  }
  movement.known = true;
  const Eigen::Vector3d middle = MeanOfMiddleHalf(eighths);
  for (std::size_t part = 2; part < 6; ++part) {
    movement.wander += 0.25 * (eighths[part] - middle).array().square();
  }
  movement.wander = movement.wander.sqrt();
  for (const std::size_t part : {0, 1, 6, 7}) {
    movement.ends = movement.ends.max((eighths[part] - middle).array().abs());
  }
  movement.noise = NoiseOfEighth(moments);
  return movement;
}

// The largest spread of the rests' means over the axes: what turning the unit changes.
double RangeOf(Triad triad, const PoseSet& set) {
  Eigen::Array3d low = Eigen::Array3d::Zero(), high = Eigen::Array3d::Zero();
  bool first = true;
  for (const StaticPose& pose : set.poses) {
    if (!pose.triads[triad]) continue;
    const Eigen::Array3d mean = pose.triads[triad]->mean_raw.array();
    low = first ? mean : low.min(mean);
    high = first ? mean : high.max(mean);
    first = false;
  }
  return (high - low).maxCoeff();
}

struct MovingRests {
  std::vector<bool> moves;  // of each pose
  std::size_t moving = 0, known = 0;
  double largest_raw = 0.0;
};

MovingRests FindMoving(Triad triad,
                       const std::vector<PerTriad<TriadPoseMoments>>& moments,
                       const PoseSet& set) {
  MovingRests found;
  found.moves.assign(moments.size(), false);
  std::vector<Movement> movements;
  std::array<std::vector<double>, 3> wanders, noises;
  for (const PerTriad<TriadPoseMoments>& pose : moments) {
    movements.push_back(MovementOf(pose[triad]));
    if (!movements.back().known) continue;
    ++found.known;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto at = static_cast<Eigen::Index>(axis);
      wanders[axis].push_back(movements.back().wander[at]);
      noises[axis].push_back(movements.back().noise[at]);
    }
  }
  if (found.known < kFewestRests) return found;
  const double range = RangeOf(triad, set);
  // Noise below a step moves a reading to the next step by chance.
  const StreamSummary* const stream = set.Find(triad);
  const Eigen::Array3d step =
      stream != nullptr ? stream->resolution_raw.array() : Eigen::Array3d(0.0, 0.0, 0.0);
  Eigen::Array3d limit;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    limit[static_cast<Eigen::Index>(axis)] =
        std::max(kMovedShare * range,
                 kClearFactor * std::max(UpperMedian(wanders[axis]), UpperMedian(noises[axis])));
  }
  limit = limit.max(step);
  for (std::size_t i = 0; i < movements.size(); ++i) {
    if (!movements[i].known) continue;
    const Eigen::Array3d wander_limit =
        (kClearFactor * movements[i].noise).max(kWanderShare * range).max(step);
    found.moves[i] =
        (movements[i].ends > limit).any() || (movements[i].wander > wander_limit).any();
    if (!found.moves[i]) continue;
    ++found.moving;
    found.largest_raw = std::max(found.largest_raw, movements[i].ends.maxCoeff());
  }
  return found;
}

std::string NumbersOf(const std::vector<bool>& chosen, const PoseSet& set) {
  std::string numbers;
  std::size_t count = 0;
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    if (!chosen[i]) continue;
    if (++count > kMostListed) return numbers + ", …";
    numbers += (count > 1 ? ", " : "") + std::to_string(set.poses[i].number);
  }
  return numbers;
}

}  // namespace

bool RemoveMovingReadings(const std::vector<PerTriad<TriadPoseMoments>>& moments, PoseSet* set) {
  PerTriad<MovingRests> found;
  for (const Triad triad : {Triad::kAccelerometer, Triad::kMagnetometer}) {
    if (set->Find(triad) == nullptr) return false;
    found[triad] = FindMoving(triad, moments, *set);
    if (found[triad].known < kFewestRests) return false;
  }
  // What moves for both is no question of clocks.
  for (std::size_t i = 0; i < set->poses.size(); ++i) {
    auto accelerometer = found[Triad::kAccelerometer].moves[i];
    auto magnetometer = found[Triad::kMagnetometer].moves[i];
    if (!accelerometer || !magnetometer) continue;
    accelerometer = magnetometer = false;
    --found[Triad::kAccelerometer].moving;
    --found[Triad::kMagnetometer].moving;
  }
  bool removed = false;
  for (const Triad triad : {Triad::kAccelerometer, Triad::kMagnetometer}) {
    const MovingRests& rests = found[triad];
    if (rests.moving == 0) continue;
    // Where a sensor moves in most rests nothing tells which of the two is right.
    if (2 * rests.moving > rests.known) continue;
    if (!Acts(Mechanism::kMovingReadings)) continue;
    const Triad still =
        triad == Triad::kAccelerometer ? Triad::kMagnetometer : Triad::kAccelerometer;
    const std::string& unit = set->Find(triad)->unit.name;
    set->findings.push_back(
        Finding(FindingCode::kMovingReadings,
                std::string(TriadName(triad)) + ": readings change within " +
                    std::to_string(rests.moving) + " of " + std::to_string(rests.known) +
                    " rests, " + Format("by up to %.2g ", rests.largest_raw) + unit +
                    ", while the " + std::string(TriadName(still)) +
                    " is still; skipped for these poses (" + NumbersOf(rests.moves, *set) + ")")
            .About(triad)
            .With("moving", static_cast<double>(rests.moving))
            .With("rests", static_cast<double>(rests.known))
            .With("largest", rests.largest_raw, unit));
    for (std::size_t i = 0; i < set->poses.size(); ++i) {
      if (rests.moves[i]) set->poses[i].triads[triad].reset();
    }
    removed = true;
  }
  return removed;
}

}  // namespace truetriad
