// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <vector>

#include "base/rounded_text.h"
#include "data/sweep_windows.h"
#include "math/distributions.h"
#include "model/mechanisms.h"
#include "truetriad/base/triad.h"

// Which cells of a sweep are left out: those far from their neighbours.

namespace truetriad {
namespace {

// A cell may be so many σ off, as white noise is once in 10^22, unless it is beside its neighbours
// as well.
constexpr double kFarOffSigmas = 10.0;
// Variance of readings inside a cell over what chi-square allows at the level below: sigma doubled.
constexpr double kDisturbedFactor = 4.0;
// By chance once in thirty thousand axes of 32768 cells.
constexpr double kDisturbedLevel = 1e-9;

// What a robust straight line through the neighbours of each value leaves of it (Theil 1950, Sen
// 1968). `time` increases.
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

// How far each value is outside of those beside it.
std::vector<double> BeyondNeighbours(const std::vector<double>& value) {
  std::vector<double> beyond;
  for (std::size_t i = 0; i < value.size(); ++i) {
    double low = value[i == 0 ? std::min<std::size_t>(1, value.size() - 1) : i - 1];
    double high = low;
    if (i > 0 && i + 1 < value.size()) {
      low = std::min(low, value[i + 1]);
      high = std::max(high, value[i + 1]);
    }
    beyond.push_back(std::max({0.0, value[i] - high, low - value[i]}));
  }
  return beyond;
}

double UsualStep(const std::vector<double>& value) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < value.size(); ++i) steps.push_back(std::abs(value[i] - value[i - 1]));
  return steps.empty() ? 0.0 : Median(std::move(steps));
}

// Places far off what is expected of them and beyond both neighbours: a turning point, which bends
// away from any line, goes beyond by a usual step at most.
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

// Readings of an axis in one attitude that are far from their neighbours, or scatter far more.
void SweepCutter::LeaveOutFarOffReadings(const TemperatureTrack& track,
                                         Triad triad,
                                         int attitude,
                                         int axis) {
  std::vector<std::size_t> index;
  std::vector<double> time, value;
  std::vector<double> variances;
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    const TriadWindow& window = cells_[i].triads[triad];
    if (cells_[i].attitude != attitude || window.count == 0) continue;
    index.push_back(i);
    time.push_back(track.time_s[i]);
    value.push_back(window.mean_raw[axis]);
    const auto dof = static_cast<double>(window.count - 1);
    if (dof < 1.0) continue;
    // Median of χ² over its degrees of freedom, Wilson and Hilferty 1931.
    const double median = std::pow(1.0 - 2.0 / (9.0 * dof), 3);
    variances.push_back(window.scatter_raw(axis, axis) / dof / median);
  }
  const std::string name = std::string(TriadName(triad)) + " " + AxisLetter(axis);
  const std::vector<bool> odd = FarOff(value, OffNeighbours(time, value), 0.0);
  for (std::size_t i = 0; i < odd.size(); ++i) {
    if (odd[i]) LeaveOut(index[i], name);
  }
  const double variance = variances.empty() ? 0.0 : Median(variances);
  if (!(variance > 0.0)) return;
  for (const std::size_t i : index) {
    const TriadWindow& window = cells_[i].triads[triad];
    if (window.count < 2) continue;
    const double chi2 = window.scatter_raw(axis, axis) / variance;
    const auto dof = static_cast<double>(window.count - 1);
    if (chi2 > kDisturbedFactor * ChiSquareQuantile(1.0 - kDisturbedLevel, dof)) {
      LeaveOut(i, name + " (disturbed)");
    }
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
  // Between two readings of a slow thermometer a repeated one is off by what it changes meanwhile.
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

// σ of one sample, from inside the cells, or where cells are single samples from their differences.
Eigen::Vector3d SweepCutter::SampleSigma(Triad triad) const {
  // From here on sigma from inside the cells is good to a sixth; below, differences of cells tell
  // it better.
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

}  // namespace truetriad
