// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "truetriad/base/result.h"
#include "truetriad/data/known_motion.h"

namespace truetriad {

/// What holds for every turn of a file that does not say otherwise.
struct TurnDefaults {
  double sigma_rad = 0.0;
  double axis_sigma_rad = 0.0;
};

/// Reads `turns.yaml`:
///
///   turns: [ { first, last | start_s, end_s | after_pose, axis, turns | degrees, sigma_deg?,
///              axis_sigma_deg?, id? }, … ]
///
/// `axis` is x, -y, … or a vector in the body frame; the sign of `turns` (or `degrees`) is that of
/// the right hand about it.
Result<std::vector<StatedTurn>> ReadStatedTurns(const std::string& path,
                                                const TurnDefaults& defaults);

/// What holds for every rate of a file that does not say otherwise.
struct RateDefaults {
  double sigma_radps = 0.0;     ///< Of the rate, each axis.
  double axis_sigma_rad = 0.0;  ///< Of its direction, about each axis across it.
  bool is_axis_known = true;    ///< Else only the size of each rate counts.
};

/// Reads `rates.yaml`:
///
///   rates: [ { first, last | start_s, end_s | pose, axis, degps, sigma_degps?, id? }, … ]
///
/// or, in place of `axis` and `degps`, `rate_degps: [x, y, z]` in the body frame. Where axes are
/// not known `axis` may be missing.
Result<std::vector<StatedRate>> ReadStatedRates(const std::string& path,
                                                const RateDefaults& defaults);

/// The texts that these read. Angles and rates of more digits than a double holds are rounded.
std::string StatedTurnsToYaml(const std::vector<StatedTurn>& turns);
std::string StatedRatesToYaml(const std::vector<StatedRate>& rates);

}  // namespace truetriad
