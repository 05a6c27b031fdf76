// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "base/rounded_text.h"
#include "data/sweep_windows.h"
#include "math/distributions.h"
#include "model/mechanisms.h"
#include "truetriad/base/triad.h"

// Finds the cells of a sweep that are outliers, and the places where the unit was turned.

namespace truetriad {
namespace {

// A cell is an outlier if its residual exceeds 10 σ, as white noise does once in 10^22, and if it
// is also outside the range of its two neighbours.
constexpr double kFarOffSigmas = 10.0;
// Chosen: no temperature changes specific force by 3 % from one window to the next.
constexpr double kTurnedShare = 0.03;

// Residual of each value from a robust straight line through its neighbours (Theil 1950, Sen 1968).
// `time` increases.
std::vector<double> OffNeighbours(const std::vector<double>& time,
                                  const std::vector<double>& value) {
  std::vector<double> off;
  off.reserve(value.size());
  std::vector<double> slopes, levels;
  const std::size_t count = std::min(2 * kNeighbours + 1, value.size());
  for (std::size_t i = 0; i < value.size(); ++i) {
    const std::size_t begin = std::min(i - std::min(i, kNeighbours), value.size() - count);
    slopes.clear(), levels.clear();
    for (std::size_t j = begin; j < begin + count; ++j) {
      for (std::size_t k = begin; k < j; ++k) {
        if (j == i || k == i || !(time[j] > time[k])) continue;
        slopes.push_back((value[j] - value[k]) / (time[j] - time[k]));
      }
    }
    if (slopes.empty()) {
      off.push_back(0.0);
      continue;
    }
    const auto middle = slopes.begin() + static_cast<std::ptrdiff_t>(slopes.size() / 2);
    std::nth_element(slopes.begin(), middle, slopes.end());
    for (std::size_t j = begin; j < begin + count; ++j) {
      if (j != i) levels.push_back(value[j] - *middle * (time[j] - time[i]));
    }
    off.push_back(value[i] - Median(levels));
  }
  return off;
}

// By how much each value is outside the range of the values before and after it.
std::vector<double> BeyondNeighbours(const std::vector<double>& value) {
  std::vector<double> beyond;
  for (std::size_t i = 0; i < value.size(); ++i) {
    const std::size_t before = i > 0 ? i - 1 : std::min<std::size_t>(1, value.size() - 1);
    const std::size_t after = i + 1 < value.size() ? i + 1 : before;
    const auto [low, high] = std::minmax(value[before], value[after]);
    beyond.push_back(std::max({0.0, value[i] - high, low - value[i]}));
  }
  return beyond;
}

double UsualStep(const std::vector<double>& value) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < value.size(); ++i) steps.push_back(std::abs(value[i] - value[i - 1]));
  return steps.empty() ? 0.0 : Median(std::move(steps));
}

// Marks values whose residual `off` is above the limit and which are also beyond both neighbours. A
// turning point is off any line, but it is beyond its neighbours by a median step at most.
std::vector<bool> FarOff(const std::vector<double>& value,
                         const std::vector<double>& off,
                         double least) {
  const double sigma = MadSigma(off);
  const double limit = std::max(kFarOffSigmas * sigma, least);
  const double step = UsualStep(value);
  const std::vector<double> beyond = BeyondNeighbours(value);
  std::vector<bool> far_off(value.size(), false);
  if (!(limit > 0.0)) return far_off;
  for (std::size_t i = 0; i < value.size(); ++i) {
    far_off[i] = std::abs(off[i]) > limit && beyond[i] > 0.5 * limit + 1.5 * step;
  }
  return far_off;
}

}  // namespace

void SweepCutter::LeaveOut(std::size_t i, const std::string& what) {
  if (!Acts(Mechanism::kSweepFarOff)) return;
  std::vector<std::string>& reasons = cells_[i].far_off;
  if (std::find(reasons.begin(), reasons.end(), what) == reasons.end()) reasons.push_back(what);
}

// Leaves out the outliers of one axis in one attitude.
void SweepCutter::LeaveOutFarOffReadings(const TemperatureTrack& track,
                                         Triad triad,
                                         int attitude,
                                         int axis) {
  std::vector<std::size_t> index;
  std::vector<double> time, value;
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    const TriadWindow& window = cells_[i].triads[triad];
    if (cells_[i].attitude != attitude || window.count == 0) continue;
    index.push_back(i);
    time.push_back(track.time_s[i]);
    value.push_back(window.mean_raw[axis]);
  }
  const std::string name = std::string(TriadName(triad)) + " " + AxisLetter(axis);
  const std::vector<bool> odd = FarOff(value, OffNeighbours(time, value), 0.0);
  for (std::size_t i = 0; i < odd.size(); ++i) {
    if (odd[i]) LeaveOut(index[i], name);
  }
}

void SweepCutter::LeaveOutFarOff(const TemperatureTrack& track,
                                 const std::vector<bool>& spikes,
                                 PoseSet* set) {
  std::vector<double> degc, residuals;
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    degc.push_back(cells_[i].degc());
    residuals.push_back(cells_[i].degc() - track.degc[i]);
  }
  // A slow thermometer repeats a reading, whose error then grows with time. So residuals do not
  // show outliers, and only spikes count.
  const bool is_held = thermometer_.hold_s() > 0.0;
  const std::vector<bool> odd_degc =
      is_held ? spikes : FarOff(degc, residuals, 1.5 * track.step_degc);
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    if (odd_degc[i] || spikes[i]) LeaveOut(i, "temperature");
  }
  for (const StreamInfo& stream : info_.streams) {
    for (std::size_t a = 0; a < attitude_names_.size(); ++a) {
      for (int axis = 0; axis < 3; ++axis) {
        LeaveOutFarOffReadings(track, stream.triad, static_cast<int>(a), axis);
      }
    }
  }
  std::size_t count = 0;
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    if (cells_[i].far_off.empty() || ++count > kMostPlacesNamed) continue;
    std::int64_t first = std::numeric_limits<std::int64_t>::max(), last = -1;
    for (const StreamInfo& stream : info_.streams) {
      const TriadWindow& window = cells_[i].triads[stream.triad];
      if (window.count == 0) continue;
      first = std::min(first, window.first_row), last = std::max(last, window.last_row);
    }
    const std::string rows = first == last
                                 ? "row " + std::to_string(first)
                                 : "rows " + std::to_string(first) + " to " + std::to_string(last);
    std::string what;
    for (const std::string& reason : cells_[i].far_off) what += (what.empty() ? "" : ", ") + reason;
    set->sweep.left_out.push_back(rows + " (at " + Fixed1(track.time_s[i]) + " s, " +
                                  Fixed1(track.degc[i]) + " degC): outliers: " + what);
  }
  if (count > kMostPlacesNamed) {
    set->sweep.left_out.push_back(std::to_string(count - kMostPlacesNamed) +
                                  " more places with outliers");
  }
}

// σ of one sample from the scatter in cells or, with too few samples, from differences of cells.
Eigen::Vector3d SweepCutter::SampleSigma(Triad triad) const {
  // With 20 degrees of freedom sigma from inside the cells is good to 1 / √40, a sixth; with fewer,
  // differences of cells are better.
  constexpr double kEnoughDofInCells = 20.0;
  Eigen::Vector3d scatter = Eigen::Vector3d::Zero();
  double dof = 0.0;
  std::array<std::vector<double>, 3> differences;
  const Cell* before = nullptr;
  for (const Cell& cell : cells_) {
    const TriadWindow& window = cell.triads[triad];
    if (!cell.far_off.empty() || window.count == 0) continue;
    scatter += window.scatter_raw.diagonal();
    dof += static_cast<double>(window.count - 1);
    if (before != nullptr && before->attitude == cell.attitude) {
      const TriadWindow& other = before->triads[triad];
      const double share = 1.0 / std::sqrt(1.0 / static_cast<double>(window.count) +
                                           1.0 / static_cast<double>(other.count));
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto i = static_cast<Eigen::Index>(axis);
        differences[axis].push_back(share * (window.mean_raw[i] - other.mean_raw[i]));
      }
    }
    before = &cell;
  }
  if (dof >= kEnoughDofInCells) return (scatter / dof).cwiseSqrt();
  return {MadSigma(differences[0]), MadSigma(differences[1]), MadSigma(differences[2])};
}

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
  // Chosen: a step is the difference of the medians of five windows on each side; 40 windows are
  // needed.
  constexpr std::size_t kReach = 5;
  // Chosen: a step is a turn if it is over 8 times the median step, over 8 times the noise of a
  // mean and over 1e-3 of gravity (0.06 deg), and if at most 0.3 of it is along gravity.
  constexpr double kUsual = 8.0, kShare = 1e-3, kAlong = 0.3;
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
  // Step from the windows before each window to those after it.
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
        std::max({kUsual * usual, kUsual * noise, kShare * reading(i).mean_raw.norm()});
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
                    " the accelerometer's reading steps as if the unit was turned by " +
                    Fixed1(degrees) + " degrees, and stays there; this is not a thermal effect",
                "fix the unit in place and repeat, or state when each attitude was held: `poses: { "
                "sweep: { attitudes: poses.yaml } }`")
            .About(Triad::kAccelerometer)
            .With("row", static_cast<double>(set->poses[index[i]].first_row))
            .With("turned", degrees, "deg"));
  }
}

}  // namespace truetriad
