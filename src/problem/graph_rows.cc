// SPDX-License-Identifier: Apache-2.0
#include "problem/graph_rows.h"

#include <glog/logging.h>

#include "math/dense/cholesky.h"
#include "problem/rows/accelerometer_row.h"
#include "problem/rows/attitude_row.h"
#include "problem/rows/face_row.h"
#include "problem/rows/gyroscope_row.h"
#include "problem/rows/known_rate_row.h"
#include "problem/rows/known_speed_row.h"
#include "problem/rows/magnetometer_row.h"
#include "problem/rows/prior_row.h"
#include "problem/rows/turn_row.h"

namespace truetriad {
namespace {

std::unique_ptr<Row> RowOf(const PoseNode& node,
                           const Observation& seen,
                           const SharedLayout& layout) {
  const ThermalFactors factors = layout.FactorsOf(
      seen.triad, node.temperature_degc, node.temperature_rate_degcps, node.session);
  if (seen.triad == Triad::kGyroscope) {
    if (node.role == PoseRole::kRest) {
      return std::make_unique<GyroscopeRow>(layout, node.kind, factors, seen.mean_raw);
    }
    if (!node.is_axis_known) {
      return std::make_unique<KnownSpeedRow>(
          layout, factors, node.known_rate_radps.norm(), node.known_force_mps2, seen.mean_raw);
    }
    return std::make_unique<KnownRateRow>(
        layout, factors, node.known_rate_radps, node.known_force_mps2, seen.mean_raw);
  }
  const FieldRow::Reading reading{seen.mean_raw, seen.mean_turn, factors, seen.turning};
  if (seen.triad == Triad::kAccelerometer) {
    return std::make_unique<AccelerometerRow>(layout, node.kind, reading);
  }
  return std::make_unique<MagnetometerRow>(layout, node.kind, reading);
}

void AddTriadBlocks(const SharedLayout& layout, Triad triad, std::vector<SharedBlock>* blocks) {
  if (!layout.Has(triad)) return;
  const std::vector<SharedBlock> own = TriadBlocks(layout, triad, ThermalFactors()).blocks();
  blocks->insert(blocks->end(), own.begin(), own.end());
  for (int i = 0; i < layout.sessions[triad].block_count(); ++i) {
    blocks->push_back({layout.sessions[triad].block_at(i), 3});
  }
  if (triad == Triad::kGyroscope && layout.g_sensitivity >= 0) {
    blocks->push_back({layout.g_sensitivity, 9});
  }
}

// σ of a held heading. Nothing else determines this heading, so that any σ gives the same result.
// It is near the σ of turns, since the elimination loses digits if σ differ much.
constexpr double kHeldHeadingRad = 1e-3;

}  // namespace

std::vector<std::unique_ptr<Row>> RowsOf(const PoseNode& node, const SharedLayout& layout) {
  std::vector<std::unique_ptr<Row>> rows;
  rows.reserve(node.observations.size() + 3);
  for (const Observation& seen : node.observations) rows.push_back(RowOf(node, seen, layout));
  if (node.has_attitude_prior) {
    rows.push_back(std::make_unique<AttitudeRow>(node.prior_world_from_body));
  }
  if (node.holds_heading) {
    rows.push_back(std::make_unique<HeldHeadingRow>(node.held_world_from_body));
  }
  if (node.face >= 0) {
    const int tilt = layout.face_tilt[static_cast<std::size_t>(node.face)];
    rows.push_back(std::make_unique<FaceRow>(node.face, SharedBlock{tilt, 2}, node.kind));
  }
  return rows;
}

std::unique_ptr<Row> RowOf(const IncrementEdge& edge, const SharedLayout& layout) {
  const ThermalFactors factors = layout.FactorsOf(
      Triad::kGyroscope, edge.temperature_degc, edge.temperature_rate_degcps, edge.session);
  const bool counts_earth_rate = edge.stated_turn < 0 && layout.CountsEarthRate();
  return std::make_unique<TurnRow>(layout, factors, counts_earth_rate, &edge.at, &edge.increment);
}

std::unique_ptr<Row> RowOf(const ScalarPrior& prior, const SharedLayout& layout) {
  for (const SharedBlock& block : SharedBlocks(layout)) {
    const int index = prior.index - block.offset;
    if (index < 0 || index >= block.size) continue;
    return std::make_unique<PriorRow>(block, index, prior.mean);
  }
  LOG(FATAL) << "a prior of parameter " << prior.index << ", which no block holds";
}

RowRoot RootOf(const Eigen::Matrix3d& variance, double weight) {
  // If variance = L L^T, the matrix sqrt(weight) L^-1 whitens the residual.
  return InverseCholeskyRoot(variance / weight);
}

std::vector<RowRoot> RootsOf(const PoseNode& node) {
  std::vector<RowRoot> roots;
  roots.reserve(node.observations.size() + 3);
  for (const Observation& seen : node.observations) {
    roots.push_back(RootOf(seen.variance, seen.weight));
  }
  if (node.has_attitude_prior) {
    roots.emplace_back(node.prior_sigma_rad.cwiseInverse().asDiagonal());
  }
  if (node.holds_heading) roots.push_back(RowRoot::Constant(1, 1, 1.0 / kHeldHeadingRad));
  if (node.face >= 0) roots.emplace_back(Eigen::Matrix2d::Identity() / node.seat_sigma_rad);
  return roots;
}

std::vector<SharedBlock> SharedBlocks(const SharedLayout& layout) {
  std::vector<SharedBlock> blocks;
  for (const Triad triad : kTriads) AddTriadBlocks(layout, triad, &blocks);
  blocks.push_back({layout.reference, kReferenceSize});
  for (const int tilt : layout.face_tilt) {
    if (tilt >= 0) blocks.push_back({tilt, 2});
  }
  return blocks;
}

}  // namespace truetriad
