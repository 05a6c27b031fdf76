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

// Places of the poses that have a temperature, those of one setting of a chamber together, coldest
// first: each group spans a twentieth of the range, or 1 degC.
std::vector<std::vector<std::size_t>> PosesByTemperature(const PoseSet& poses);

// The poses at these places, which are in order, with the moves between them.
PoseSet PosesAmong(const PoseSet& poses, const std::vector<std::size_t>& places);

// The poses of each setting, with the turns that begin there.
std::vector<HeldOutGroup> GroupsOfSettings(const PoseGraph& graph);

// What the poses of each setting say by themselves, of every triad with temperature terms.
// Settings whose poses do not determine a bias are left out.
std::vector<TemperatureSetting> FindTemperatureSettings(const PoseGraph& graph);

// What the poses of one temperature have in common beyond the temperature terms, of one triad.
struct SettingScatter {
  double ratio = 1.0;    // its χ² by the poses' noise over what offsets would leave of theirs
  double dof = 0.0;      // that this is known with: about three axes for each temperature that
                         // the bias' polynomial does not use up
  double p_value = 1.0;  // that noise makes so much; 1 where there are no degrees of freedom
  double variance_raw = 0.0;  // of an axis, beyond what the noise makes
};
SettingScatter ScatterOf(const PoseGraph& graph,
                         const ReducedSystem& system,
                         const std::vector<TemperatureSetting>& settings,
                         Triad triad);

// What a bias that is drawn anew at each temperature, of this variance, adds to the covariance of
// the free shared coordinates.
Eigen::MatrixXd DriftOf(const PoseGraph& graph,
                        const ReducedSystem& system,
                        Triad triad,
                        double variance_raw);

// What temperature terms and all else are less certain by where the bias drifts from one
// temperature to the next: the solution is linear in what the poses of a temperature have in
// common. Of the free shared coordinates.
struct DriftCovariance {
  Eigen::MatrixXd covariance;
  double dof = 0.0;  // that the drift is known with; infinite where there is none
  PerTriad<double> sigma_raw{{0.0, 0.0, 0.0}};
};
DriftCovariance FindDriftCovariance(const PoseGraph& graph,
                                    const ReducedSystem& system,
                                    const std::vector<TemperatureSetting>& settings);

}  // namespace truetriad
