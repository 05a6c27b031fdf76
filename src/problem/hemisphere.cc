// SPDX-License-Identifier: Apache-2.0
#include "problem/hemisphere.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "problem/lay_out.h"
#include "problem/start_values.h"

namespace truetriad {
namespace {

// Replaces a dip beyond the vertical by its supplement. Returns whether this reversed the direction
// of north.
bool FoldDip(PoseGraph* graph) {
  double& dip = graph->shared[graph->layout.reference + kDip];
  dip = std::remainder(dip, 2.0 * std::numbers::pi);
  if (std::cos(dip) >= 0.0) return false;
  dip = std::copysign(std::numbers::pi, dip) - dip;
  return true;
}

// Reverses the signs of the magnetometer's matrix, of its directions and of a free dip.
void Reverse(PoseGraph* graph) {
  const SharedLayout& layout = graph->layout;
  const int dip_at = layout.reference + kDip;
  if (layout.IsFree(dip_at)) graph->shared[dip_at] *= -1.0;
  graph->shared.segment<9>(layout.sensitivity[Triad::kMagnetometer]) *= -1.0;
  const ThermalBlock& thermal = layout.thermal[Triad::kMagnetometer];
  graph->shared.segment(thermal.matrix_at(0), 9 * thermal.terms.matrix_order) *= -1.0;
  for (PoseNode& node : graph->nodes) {
    if (node.kind != PoseKind::kDirection) continue;
    if (node.observations.front().triad != Triad::kMagnetometer) continue;
    node.state = {-node.state[0], -node.state[1], -node.state[2], 0.0};
  }
}

// Rotates every attitude, or the field if attitudes are given, by half a turn about the vertical.
// Returns whether attitudes were rotated.
bool TurnHalfway(const CalibrateOptions& options, PoseGraph* graph) {
  if (options.attitudes.kind == AttitudeKind::kGiven) {
    double& heading = graph->shared[graph->layout.reference + kHeading];
    heading += heading > 0.0 ? -std::numbers::pi : std::numbers::pi;
    return false;
  }
  for (PoseNode& node : graph->nodes) {
    if (node.kind == PoseKind::kRotation) node.state = ValuesOf(TurnedHalfway(node.rotation()));
  }
  return true;
}

// Whether the magnetometer's sign is free: neither its matrix nor the heading is held.
bool IsSignFree(const CalibrateOptions& options, const SharedLayout& layout) {
  const TriadOptions& magnetometer = options.triads[Triad::kMagnetometer];
  return magnetometer.enabled && layout.reference >= 0 && !magnetometer.prior &&
         !magnetometer.fixed_sensitivity &&
         (options.attitudes.kind != AttitudeKind::kGiven ||
          layout.IsFree(layout.reference + kHeading));
}

}  // namespace

Eigen::Quaterniond TurnedHalfway(const Eigen::Quaterniond& attitude) {
  return Eigen::Quaterniond(0.0, 0.0, 0.0, 1.0) * attitude;
}

bool MayReverse(const CalibrateOptions& options, const SharedLayout& layout) {
  return IsSignFree(options, layout) && layout.IsFree(layout.reference + kDip) &&
         !options.reference.dip_rad.known();
}

bool MayReverseAgainstDip(const CalibrateOptions& options, const SharedLayout& layout) {
  return IsSignFree(options, layout) && options.reference.dip_rad.known() &&
         layout.Has(Triad::kAccelerometer);
}

double SideOfStatedDip(const Knowledge& stated, double dip_rad) {
  if (!(stated.sigma > 0.0)) return std::numeric_limits<double>::infinity();
  return 4.0 * dip_rad * *stated.value / (stated.sigma * stated.sigma);
}

bool IsSideOfEquatorTold(double dip_rad, double dip_sigma_rad) {
  constexpr double kFar = 4.0;  // σ; Student's t with 10 dof is larger in 1 of 800 cases
  return std::abs(std::sin(dip_rad)) > std::max(kEquatorSine, kFar * dip_sigma_rad);
}

bool IsOfOtherHand(const CalibrateOptions& options, const PoseGraph& graph) {
  double hand = LeadingAxisSign(options);
  for (const Triad triad : {Triad::kAccelerometer, Triad::kMagnetometer}) {
    if (!graph.layout.Has(triad)) continue;
    hand *= graph.sensitivity(triad).determinant();
    if (const auto& mounting = options.triads[triad].mounting) hand *= mounting->determinant();
  }
  return hand < 0.0;
}

void ReverseField(const CalibrateOptions& options, PoseGraph* graph) {
  Reverse(graph);
  TurnHalfway(options, graph);
}

bool SettleHemisphereOfField(const CalibrateOptions& options,
                             double dip_sigma_rad,
                             PoseGraph* graph) {
  const SharedLayout& layout = graph->layout;
  const bool is_given = options.attitudes.kind == AttitudeKind::kGiven;
  if (!options.triads[Triad::kMagnetometer].enabled || !layout.IsFree(layout.reference + kDip) ||
      (is_given && !layout.IsFree(layout.reference + kHeading))) {
    return false;
  }
  const bool was_beyond = FoldDip(graph);
  const double dip_rad = graph->shared[layout.reference + kDip];
  const bool was_reversed =
      MayReverse(options, layout) && (IsSideOfEquatorTold(dip_rad, dip_sigma_rad)
                                          ? (dip_rad > 0.0) != options.reference.northern_hemisphere
                                          : IsOfOtherHand(options, *graph));
  if (was_reversed) Reverse(graph);
  return was_beyond != was_reversed && TurnHalfway(options, graph);
}

}  // namespace truetriad
