// SPDX-License-Identifier: Apache-2.0
#include "solve/field_side.h"

#include <cmath>
#include <utility>

#include "model/mechanisms.h"
#include "problem/hemisphere.h"
#include "solve/chain_elimination.h"
#include "solve/shared_information.h"
#include "solve/solve_graph.h"

namespace truetriad {

double FarInChi2(double noise_dof) {
  // 2 log 1000 = 13.8.
  constexpr double kFar = 13.8;
  return std::isfinite(noise_dof) ? noise_dof * std::expm1(kFar / noise_dof) : kFar;
}

bool OtherSide::IsTold(double noise_dof) const { return !(std::abs(worse) < FarInChi2(noise_dof)); }

std::optional<OtherSide> OtherSideOfField(const CalibrateOptions& options,
                                          const PoseGraph& solved) {
  // If |sin dip| is larger, the dip of opposite sign is not tried: it is at least 2 asin 0.25 = 29
  // deg away. Readings that scatter by more than 6 deg are refused, so that even four poses, the
  // fewest possible, exclude that dip by χ² = 4 (29 / 6)^2, about 100.
  constexpr double kFarSine = 0.25;
  // A dip that is stated with a σ must exclude the opposite sign by this χ².
  constexpr double kFarChi2 = 100.0;
  if (!MayReverseAgainstDip(options, solved.layout)) return std::nullopt;
  const Knowledge& stated = options.reference.dip_rad;
  const double dip_rad = solved.reference()[kDip];
  const bool is_far_from_stated = SideOfStatedDip(stated, dip_rad) > kFarChi2;
  if (std::abs(std::sin(dip_rad)) > kFarSine && is_far_from_stated) return std::nullopt;
  OtherSide other{solved, 0.0};
  ReverseField(options, &other.graph);
  SolveGraph(&other.graph);
  other.worse = 2.0 * (Linearised(other.graph).cost() - Linearised(solved).cost());
  return other;
}

bool SettleField(const CalibrateOptions& options, double noise_dof, PoseGraph* graph) {
  if (auto other = OtherSideOfField(options, *graph)) {
    const bool is_told = other->IsTold(noise_dof);
    if (is_told ? other->worse > 0.0 : !IsOfOtherHand(options, *graph)) return false;
    if (!Acts(Mechanism::kFieldSide)) return false;
    *graph = std::move(other->graph);
    return true;
  }
  const SharedLayout& layout = graph->layout;
  const int dip_at = layout.reference + kDip;
  double dip_sigma_rad = 0.0;
  if (MayReverse(options, layout)) {
    const ChainElimination linearised = Linearised(*graph);
    const SharedInformation known(
        layout, graph->shared, linearised.information(), linearised.gradient());
    const Eigen::RowVectorXd dip = layout.basis.row(dip_at);
    dip_sigma_rad = std::sqrt(dip * known.covariance() * dip.transpose());
  }
  const double dip_rad = graph->shared[dip_at];
  SettleHemisphereOfField(options, dip_sigma_rad, graph);
  return graph->shared[dip_at] != dip_rad;
}

}  // namespace truetriad
