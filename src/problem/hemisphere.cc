// SPDX-License-Identifier: Apache-2.0
#include "problem/hemisphere.h"

#include <cmath>
#include <numbers>

#include "problem/start_values.h"

namespace truetriad {
namespace {

// A dip beyond the vertical is the supplement with north turned half a turn about it.
bool FoldDip(PoseGraph* graph) {
  double& dip = graph->shared[graph->layout.reference + kDip];
  dip = std::remainder(dip, 2.0 * std::numbers::pi);
  if (std::cos(dip) >= 0.0) return false;
  dip = std::copysign(std::numbers::pi, dip) - dip;
  return true;
}

// The other side of the equator, with a sensitivity that is its negative.
bool Reverse(const CalibrateOptions& options, PoseGraph* graph) {
  const SharedLayout& layout = graph->layout;
  const TriadOptions& magnetometer = options.triads[Triad::kMagnetometer];
  double& dip = graph->shared[layout.reference + kDip];
  if (options.reference.dip_rad.known() || magnetometer.prior || magnetometer.fixed_sensitivity ||
      std::abs(std::sin(dip)) < kEquatorSine ||
      (dip > 0.0) == options.reference.northern_hemisphere) {
    return false;
  }
  dip = -dip;
  graph->shared.segment<9>(layout.sensitivity[Triad::kMagnetometer]) *= -1.0;
  const ThermalBlock& thermal = layout.thermal[Triad::kMagnetometer];
  graph->shared.segment(thermal.matrix_at(0), 9 * thermal.terms.matrix_order) *= -1.0;
  for (PoseNode& node : graph->nodes) {
    if (node.kind != PoseKind::kDirection) continue;
    if (node.observations.front().triad != Triad::kMagnetometer) continue;
    node.state = {-node.state[0], -node.state[1], -node.state[2], 0.0};
  }
  return true;
}

}  // namespace

Eigen::Quaterniond TurnedHalfway(const Eigen::Quaterniond& attitude) {
  return Eigen::Quaterniond(0.0, 0.0, 0.0, 1.0) * attitude;
}

bool SettleHemisphereOfField(const CalibrateOptions& options, PoseGraph* graph) {
  const SharedLayout& layout = graph->layout;
  const bool is_given = options.attitudes.kind == AttitudeKind::kGiven;
  if (!options.triads[Triad::kMagnetometer].enabled || !layout.IsFree(layout.reference + kDip) ||
      (is_given && !layout.IsFree(layout.reference + kHeading))) {
    return false;
  }
  const bool was_beyond = FoldDip(graph);
  const bool was_reversed = Reverse(options, graph);
  if (was_beyond == was_reversed) return false;
  if (is_given) {
    double& heading = graph->shared[layout.reference + kHeading];
    heading += heading > 0.0 ? -std::numbers::pi : std::numbers::pi;
    return false;
  }
  for (PoseNode& node : graph->nodes) {
    if (node.kind == PoseKind::kRotation) node.state = ValuesOf(TurnedHalfway(node.rotation()));
  }
  return true;
}

}  // namespace truetriad
