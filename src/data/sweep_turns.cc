// SPDX-License-Identifier: Apache-2.0
#include "data/sweep_turns.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "base/rounded_text.h"
#include "math/distributions.h"
#include "model/mechanisms.h"
#include "truetriad/base/units.h"
#include "truetriad/model/finding.h"

namespace truetriad {
namespace {

// A change of specific force from one window to the next that no temperature makes.
constexpr double kTurnedShare = 0.03;

}  // namespace

Status CheckHeld(const PoseSet& set) {
  constexpr Triad kTriad = Triad::kAccelerometer;
  for (std::size_t k = 1; k < set.poses.size(); ++k) {
    const auto &before = set.poses[k - 1].triads[kTriad], &after = set.poses[k].triads[kTriad];
    if (!before || !after || set.sweep.attitude[k - 1] != set.sweep.attitude[k]) continue;
    const double change = (after->mean_raw - before->mean_raw).norm();
    if (change < kTurnedShare * std::min(before->mean_raw.norm(), after->mean_raw.norm())) continue;
    if (!Acts(Mechanism::kUnitTurned)) continue;
    return NotEnoughError(
        Finding(FindingCode::kUnitTurned,
                set.source + ": the accelerometer jumps between the rows " +
                    std::to_string(set.poses[k - 1].last_row) + " and " +
                    std::to_string(set.poses[k].first_row) + ", as if the unit was turned",
                "state when each attitude was held: `poses: { sweep: { attitudes: poses.yaml } }`")
            .About(kTriad)
            .With("row", static_cast<double>(set.poses[k].first_row)));
  }
  return {};
}

void NameTurns(PoseSet* set) {
  constexpr Triad kTriad = Triad::kAccelerometer;
  // Chosen: a step is one between the medians of five windows, an eighth of the fewest that there
  // are.
  constexpr std::size_t kReach = 5;
  // Of the usual change over as many windows, of the noise of their means, of gravity; and how much
  // of it may go along gravity.
  constexpr double kUsual = 8.0, kNoise = 8.0, kShare = 1e-3, kAlong = 0.3;
  std::vector<std::size_t> index;
  for (std::size_t k = 0; k < set->poses.size(); ++k) {
    if (set->poses[k].triads[kTriad]) index.push_back(k);
  }
  if (index.size() < 8 * kReach) return;
  const auto reading = [&](std::size_t i) -> const TriadPose& {
    return *set->poses[index[i]].triads[kTriad];
  };
  const auto middle = [&](std::size_t begin) {
    Eigen::Vector3d medians;
    for (int axis = 0; axis < 3; ++axis) {
      std::vector<double> values;
      for (std::size_t i = begin; i < begin + kReach; ++i) {
        values.push_back(reading(i).mean_raw[axis]);
      }
      medians[axis] = Median(std::move(values));
    }
    return medians;
  };
  // From the windows before each one to those after it.
  std::vector<Eigen::Vector3d> steps(index.size(), Eigen::Vector3d::Zero());
  std::vector<double> sizes;
  for (std::size_t i = kReach; i + kReach < index.size(); ++i) {
    if (set->sweep.attitude[index[i - kReach]] != set->sweep.attitude[index[i + kReach]]) continue;
    steps[i] = middle(i + 1) - middle(i - kReach);
    sizes.push_back(steps[i].norm());
  }
  if (sizes.empty()) return;
  const double usual = Median(std::move(sizes));
  for (std::size_t i = kReach; i + kReach < index.size(); ++i) {
    const double size = steps[i].norm();
    const Eigen::Vector3d down = reading(i).mean_raw.normalized();
    const double noise = std::sqrt(reading(i).mean_covariance_raw.trace());
    const double least =
        std::max({kUsual * usual, kNoise * noise, kShare * reading(i).mean_raw.norm()});
    if (size < least || std::abs(steps[i].dot(down)) > kAlong * size) continue;
    bool is_largest = true;
    for (std::size_t j = i - kReach; j <= i + kReach; ++j) {
      is_largest =
          is_largest && (steps[j].norm() < size || j == i || (j > i && steps[j].norm() == size));
    }
    if (!is_largest) continue;
    const double degrees = kDegPerRad * std::atan2(size, reading(i).mean_raw.norm());
    set->findings.push_back(
        Finding(FindingCode::kUnitTurned,
                "near row " + std::to_string(set->poses[index[i]].first_row) +
                    " the accelerometer steps as if the unit was turned by " + Fixed1(degrees) +
                    " degrees and stays there, which is not a thermal effect",
                "fix the unit in place and repeat, or state when each attitude was held: `poses: { "
                "sweep: { attitudes: poses.yaml } }`")
            .About(Triad::kAccelerometer)
            .With("row", static_cast<double>(set->poses[index[i]].first_row))
            .With("turned", degrees, "deg"));
  }
}

}  // namespace truetriad
