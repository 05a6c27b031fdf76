// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "truetriad/base/result.h"
#include "truetriad/data/static_pose.h"

namespace truetriad {

/// The σ for those turns of a file that do not state their own.
struct TurnDefaults {
  double sigma_rad = 0.0;
  double axis_sigma_rad = 0.0;
};

/// Reads `turns.yaml`:
///
///   turns: [ { first, last | start_s, end_s | after_pose, axis, turns | degrees, sigma_deg?,
///              axis_sigma_deg?, id? }, … ]
///
/// `axis` is x, -y, … or a vector in the body frame; `turns` (or `degrees`) is positive by the
/// right-hand rule about `axis`.
Result<std::vector<StatedTurn>> ReadStatedTurns(const std::string& path,
                                                const TurnDefaults& defaults);

/// The σ for those rates of a file that do not state their own, and whether axes are known.
struct RateDefaults {
  double sigma_radps = 0.0;     ///< σ of the rate, on each axis.
  double axis_sigma_rad = 0.0;  ///< σ of its direction, about each perpendicular axis.
  bool is_axis_known = true;    ///< If false, only the size of each rate counts.
};

/// Reads `rates.yaml`:
///
///   rates: [ { first, last | start_s, end_s | pose, axis, degps, sigma_degps?, id? }, … ]
///
/// or, instead of `axis` and `degps`, `rate_degps: [x, y, z]` in the body frame. If axes are
/// unknown, `axis` may be missing.
Result<std::vector<StatedRate>> ReadStatedRates(const std::string& path,
                                                const RateDefaults& defaults);

/// Texts that the two functions above read, with all digits of a double.
std::string StatedTurnsToYaml(const std::vector<StatedTurn>& turns);
std::string StatedRatesToYaml(const std::vector<StatedRate>& rates);

}  // namespace truetriad
