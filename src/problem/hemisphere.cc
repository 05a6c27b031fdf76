// SPDX-License-Identifier: Apache-2.0
#include "problem/hemisphere.h"

#include <cmath>
#include <numbers>

#include "problem/start_values.h"

namespace truetriad {

bool SettleHemisphereOfField(const CalibrateOptions& options, PoseGraph* graph) {
  const SharedLayout& layout = graph->layout;
  const TriadOptions& magnetometer = options.triads[Triad::kMagnetometer];
  const bool is_given = options.attitudes.kind == AttitudeKind::kGiven;
  if (!magnetometer.enabled || !layout.IsFree(layout.reference + kDip) ||
      options.reference.dip_rad.known() ||
      (is_given && !layout.IsFree(layout.reference + kHeading)) || magnetometer.prior ||
      magnetometer.fixed_sensitivity) {
    return false;
  }
  double& dip = graph->shared[layout.reference + kDip];
  const bool north = dip > 0.0;
  if (std::abs(std::sin(dip)) < kEquatorSine || north == options.reference.northern_hemisphere) {
    return false;
  }
  dip = -dip;
  graph->shared.segment<9>(layout.sensitivity[Triad::kMagnetometer]) *= -1.0;
  const ThermalBlock& thermal = layout.thermal[Triad::kMagnetometer];
  graph->shared.segment(thermal.matrix_at(0), 9 * thermal.terms.matrix_order) *= -1.0;
  if (!is_given) return true;
  double& heading = graph->shared[layout.reference + kHeading];
  heading += heading > 0.0 ? -std::numbers::pi : std::numbers::pi;
  return false;
}

}  // namespace truetriad
