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

// The poses with the indices `places`, ascending, and the moves between chosen poses that are
// adjacent in `poses`.
PoseSet PosesAmong(const PoseSet& poses, const std::vector<std::size_t>& places);

// The poses of each setting, with the turns that begin in them.
std::vector<HeldOutGroup> GroupsOfSettings(const PoseGraph& graph);

// For every triad with temperature terms: the bias of each setting, as determined by the poses of
// this setting alone. Settings whose poses do not determine a bias are left out.
std::vector<TemperatureSetting> FindTemperatureSettings(const PoseGraph& graph);

// Scatter from one temperature to the next, for one triad: the errors that each temperature's poses
// have in common and that the temperature terms do not explain.
struct SettingScatter {
  double ratio = 1.0;    // χ² of the settings' errors, over its expectation for offsets of 1 σ
  double dof = 0.0;      // about three per temperature, without those that the terms need
  double p_value = 1.0;  // probability that noise causes this scatter; 1 without dof
  double variance_raw = 0.0;  // variance of the error per axis, beyond that of noise
};
SettingScatter ScatterOf(const PoseGraph& graph,
                         const ReducedSystem& system,
                         const std::vector<TemperatureSetting>& settings,
                         Triad triad);

// The covariance of the free shared coordinates due to a bias that differs from temperature to
// temperature, independently and with the variance `variance_raw`.
Eigen::MatrixXd DriftOf(const PoseGraph& graph,
                        const ReducedSystem& system,
                        Triad triad,
                        double variance_raw);

// The covariance of the free shared coordinates, temperature terms included, due to a bias that
// drifts from one temperature to the next. The solution is linear in the error that the poses of a
// temperature have in common.
struct DriftCovariance {
  Eigen::MatrixXd covariance;
  double dof = 0.0;  // degrees of freedom of the drift; infinite if there is none
  PerTriad<double> sigma_raw{{0.0, 0.0, 0.0}};
};
DriftCovariance FindDriftCovariance(const PoseGraph& graph,
                                    const ReducedSystem& system,
                                    const std::vector<TemperatureSetting>& settings);

}  // namespace truetriad
