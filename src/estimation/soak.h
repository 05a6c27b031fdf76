// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "estimation/graph.h"
#include "estimation/quality.h"
#include "truetriad/data/static_pose.h"
#include "truetriad/model/calibration.h"

namespace truetriad {

// Places of the poses that have a temperature, those of one setting of a chamber together, coldest
// first: each group spans a twentieth of the range at most.
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
  double ratio = 1.0;  // its χ² by the poses' noise over its degrees of freedom
  double dof = 0.0;    // three axes for each temperature that the bias' polynomial does not use up
  double p_value = 1.0;  // that noise makes so much; 1 where there are no degrees of freedom
  double rms_raw = 0.0;  // beyond what the noise makes
};
SettingScatter ScatterOf(const std::vector<TemperatureSetting>& settings,
                         Triad triad,
                         int bias_order);

}  // namespace truetriad
