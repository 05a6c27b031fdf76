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

// Indices of the poses that have a temperature, grouped by settings of the chamber, coldest first:
// each group spans a twentieth of the range, or 1 degC.
std::vector<std::vector<std::size_t>> PosesByTemperature(const PoseSet& poses);

// The poses at `places`, which are ascending indices, and the moves between adjacent ones.
PoseSet PosesAmong(const PoseSet& poses, const std::vector<std::size_t>& places);

// The poses of each setting, with the turns that begin in them.
std::vector<HeldOutGroup> GroupsOfSettings(const PoseGraph& graph);

// The bias that the poses of each setting determine alone, for every triad with temperature terms.
// Settings whose poses do not determine a bias are left out.
std::vector<TemperatureSetting> FindTemperatureSettings(const PoseGraph& graph);

// The common error of the poses of one temperature beyond the temperature terms, of one triad.
struct SettingScatter {
  double ratio = 1.0;         // χ² by the poses' noise over the share of offsets that terms leave
  double dof = 0.0;           // degrees of freedom: about three for each unused temperature
  double p_value = 1.0;       // probability that noise causes it; 1 without degrees of freedom
  double variance_raw = 0.0;  // of the error on an axis, beyond the variance of noise
};
SettingScatter ScatterOf(const PoseGraph& graph,
                         const ReducedSystem& system,
                         const std::vector<TemperatureSetting>& settings,
                         Triad triad);

// The covariance of the free shared coordinates due to a bias that varies independently between
// temperatures, with this variance.
Eigen::MatrixXd DriftOf(const PoseGraph& graph,
                        const ReducedSystem& system,
                        Triad triad,
                        double variance_raw);

// Covariance of the free shared coordinates, temperature terms included, if the bias drifts from
// one temperature to the next: the solution is linear in the common errors of each temperature's
// poses.
struct DriftCovariance {
  Eigen::MatrixXd covariance;
  double dof = 0.0;  // of the drift; infinite if there is none
  PerTriad<double> sigma_raw{{0.0, 0.0, 0.0}};
};
DriftCovariance FindDriftCovariance(const PoseGraph& graph,
                                    const ReducedSystem& system,
                                    const std::vector<TemperatureSetting>& settings);

}  // namespace truetriad
