// SPDX-License-Identifier: Apache-2.0
#include "verdict/clock_effects.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "data/readings_at.h"
#include "solve/shared_information.h"

namespace truetriad {
namespace {

// Values of a move as they are `later_s` on; at its ends the unit rests.
std::vector<Eigen::Vector3d> ShiftedBy(double later_s,
                                       const std::vector<double>& time_s,
                                       const std::vector<Eigen::Vector3d>& values) {
  std::vector<double> wanted_s = time_s;
  for (double& at_s : wanted_s) at_s += later_s;
  return ReadingsAt(wanted_s, time_s, values);
}

Eigen::Vector3d ResidualOf(const IncrementEdge& edge, const PoseGraph& graph) {
  return edge.Residual(graph.layout,
                       graph.shared.data(),
                       graph.nodes[edge.from].state.data(),
                       graph.nodes[edge.from + 1].state.data());
}

// What all rows change by when the clock is corrected by `later_s`.
Eigen::VectorXd ChangeOfRows(Triad triad,
                             double later_s,
                             const PoseGraph& graph,
                             const ReducedSystem& system) {
  Eigen::VectorXd change = Eigen::VectorXd::Zero(system.residual().size());
  for (std::size_t k = 0; k < graph.nodes.size(); ++k) {
    const std::vector<Observation>& seen = graph.nodes[k].observations;
    for (std::size_t i = 0; i < seen.size(); ++i) {
      if (seen[i].triad != triad) continue;
      // A row is what the model says less what was read.
      change.segment<3>(system.factors()[k].row + 3 * static_cast<Eigen::Index>(i)) =
          -later_s * seen[i].by_clock_raw_per_s;
    }
  }
  if (triad != Triad::kAccelerometer) return change;
  for (std::size_t i = 0; i < graph.increments.size(); ++i) {
    const IncrementEdge& edge = graph.increments[i];
    if (edge.accelerometer_raw.empty()) continue;
    IncrementEdge corrected = edge;
    corrected.accelerometer_raw = ShiftedBy(later_s, edge.move.time_s, edge.accelerometer_raw);
    // Where they are integrated is where the graph stands: no derivative counts.
    corrected.increment.rotation = corrected.RotationAt(graph.layout, graph.shared.data());
    change.segment<3>(system.factors()[graph.nodes.size() + i].row) =
        ResidualOf(corrected, graph) - ResidualOf(edge, graph);
  }
  return change;
}

}  // namespace

ClockEffects EffectsOf(const std::vector<ClockOffset>& offsets,
                       const PoseGraph& graph,
                       const ReducedSystem& system) {
  ClockEffects effects;
  effects.covariance = Eigen::MatrixXd::Zero(system.size(), system.size());
  effects.sigmas.assign(offsets.size(), 0.0);
  if (system.rank() < system.size()) return effects;
  for (std::size_t k = 0; k < offsets.size(); ++k) {
    const ClockOffset& offset = offsets[k];
    // As long as what it may be, of which the effect is nearly a straight line.
    const double most_s = std::hypot(offset.later_s, offset.sigma_s);
    const Eigen::VectorXd rows = ChangeOfRows(offset.triad, most_s, graph, system);
    const Eigen::VectorXd moved = system.covariance() * (system.B().transpose() * rows);
    effects.covariance += moved * moved.transpose();
    effects.sigmas[k] = LargestInSigmas(graph.layout, system.covariance(), moved);
  }
  return effects;
}

}  // namespace truetriad
