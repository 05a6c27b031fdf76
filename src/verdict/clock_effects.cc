// SPDX-License-Identifier: Apache-2.0
#include "verdict/clock_effects.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "verdict/observability.h"

namespace truetriad {
namespace {

// Values of a move as they are `later_s` on; at its ends the unit rests.
std::vector<Eigen::Vector3d> ShiftedBy(double later_s,
                                       const std::vector<double>& time_s,
                                       const std::vector<Eigen::Vector3d>& values) {
  std::vector<Eigen::Vector3d> shifted;
  shifted.reserve(values.size());
  for (const double at : time_s) {
    const double wanted_s = std::clamp(at + later_s, time_s.front(), time_s.back());
    const auto after = std::lower_bound(time_s.begin(), time_s.end(), wanted_s);
    const auto right = static_cast<std::size_t>(after - time_s.begin());
    const std::size_t left = right > 0 ? right - 1 : 0;
    const double span_s = time_s[right] - time_s[left];
    const double share = span_s > 0.0 ? (wanted_s - time_s[left]) / span_s : 0.0;
    shifted.emplace_back((1.0 - share) * values[left] + share * values[right]);
  }
  return shifted;
}

Eigen::Vector3d ResidualOf(const IncrementEdge& edge, const PoseGraph& graph) {
  Eigen::Vector3d residual;
  edge.Evaluate(graph.layout,
                graph.shared.data(),
                graph.nodes[edge.from].state.data(),
                graph.nodes[edge.from + 1].state.data(),
                &residual,
                nullptr,
                nullptr,
                nullptr);
  return residual;
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
    corrected.Integrate(graph.layout, graph.shared.data());
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
    effects.sigmas[k] = LargestInSigmas(graph, system.covariance(), moved);
  }
  return effects;
}

}  // namespace truetriad
