// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "problem/graph.h"
#include "solve/reduced_system.h"
#include "truetriad/data/static_pose.h"
#include "truetriad/model/calibration.h"
#include "verdict/quality.h"

namespace truetriad {

// Indices of the poses that have a temperature, grouped by settings of the chamber, coldest first.
// A group spans at most a twentieth of the temperature range, or 1 degC if that is more.
std::vector<std::vector<std::size_t>> PosesByTemperature(const PoseSet& poses);

// The poses with the indices `places`, ascending, and the moves between those that are adjacent in
// `poses`.
PoseSet PosesAmong(const PoseSet& poses, const std::vector<std::size_t>& places);

// The poses of each setting, with the turns that begin in them.
std::vector<HeldOutGroup> GroupsOfSettings(const PoseGraph& graph);

// For every triad with temperature terms: the bias of each setting, as its poses alone determine
// it. Settings whose poses do not determine a bias are left out.
std::vector<TemperatureSetting> FindTemperatureSettings(const PoseGraph& graph);

// Scatter from one temperature to the next, for one triad: the errors that each temperature's poses
// have in common and that the temperature terms do not explain.
struct SettingScatter {
  double ratio = 1.0;    // χ² by the poses' noise, over its expected value for offsets of 1 σ
  double dof = 0.0;      // about three for each temperature beyond those the terms need
  double p_value = 1.0;  // probability that noise causes it; 1 without degrees of freedom
  double variance_raw = 0.0;  // of the error on an axis, beyond the variance of noise
};
SettingScatter ScatterOf(const PoseGraph& graph,
                         const ReducedSystem& system,
                         const std::vector<TemperatureSetting>& settings,
                         Triad triad);

// What a bias that differs from temperature to temperature, independently and with this variance,
// adds to the covariance of the free shared coordinates.
Eigen::MatrixXd DriftOf(const PoseGraph& graph,
                        const ReducedSystem& system,
                        Triad triad,
                        double variance_raw);

// What a bias that drifts from one temperature to the next adds to the covariance of the free
// shared coordinates, temperature terms included. The solution is linear in the error that the
// poses of a temperature have in common.
struct DriftCovariance {
  Eigen::MatrixXd covariance;
  double dof = 0.0;  // of the drift; infinite if there is none
  PerTriad<double> sigma_raw{{0.0, 0.0, 0.0}};
};
DriftCovariance FindDriftCovariance(const PoseGraph& graph,
                                    const ReducedSystem& system,
                                    const std::vector<TemperatureSetting>& settings);

}  // namespace truetriad
