// SPDX-License-Identifier: Apache-2.0
#include "noise/components.h"

#include <Eigen/LU>

namespace truetriad {

std::string NoiseComponentName(NoiseComponent component) {
  const std::optional<Triad> triad = TriadOf(component);
  if (triad) return std::string(TriadName(*triad));
  return component == NoiseComponent::kRate ? "rates" : "turns";
}

std::optional<NoiseComponent> ComponentOf(const PoseNode& node, const Observation& observation) {
  if (node.role == PoseRole::kRate) return NoiseComponent::kRate;
  if (node.role == PoseRole::kRest) return PoseNoise(observation.triad);
  return std::nullopt;
}

double MeanKnownVariance(const PoseGraph& graph, NoiseComponent component) {
  double sum = 0.0;
  int count = 0;
  if (component == NoiseComponent::kTurn) {
    for (const IncrementEdge& edge : graph.increments) {
      if (edge.rejected || edge.stated_turn >= 0) continue;
      sum += edge.increment.covariance.trace() / 3.0;
      ++count;
    }
  }
  PerTriad<Eigen::Matrix3d> correction;
  for (const Triad triad : kTriads) {
    if (graph.layout.Has(triad)) correction[triad] = graph.sensitivity(triad).inverse();
  }
  for (const PoseNode& node : graph.nodes) {
    for (const Observation& seen : node.observations) {
      if (ComponentOf(node, seen) != component || seen.rejected) continue;
      const Eigen::Matrix3d& C = correction[seen.triad];
      sum += (C * seen.rest_covariance * C.transpose() + seen.rate_covariance).trace() / 3.0;
      ++count;
    }
  }
  return count > 0 ? sum / count : 0.0;
}

void ApplyExcess(const ExcessVariance& excess, PoseGraph* graph) {
  PerTriad<Eigen::Matrix3d> unit;
  for (const Triad triad : kTriads) {
    if (!graph->layout.Has(triad)) continue;
    unit[triad] = graph->sensitivity(triad) * graph->sensitivity(triad).transpose();
  }
  for (PoseNode& node : graph->nodes) {
    for (Observation& observation : node.observations) {
      const std::optional<NoiseComponent> component = ComponentOf(node, observation);
      observation.variance = observation.rest_covariance +
                             (component ? excess[*component] : 0.0) * unit[observation.triad];
      if (node.role == PoseRole::kRest) continue;
      const Eigen::Matrix3d sensitivity = graph->sensitivity(observation.triad);
      observation.variance += sensitivity * observation.rate_covariance * sensitivity.transpose();
    }
  }
  for (IncrementEdge& edge : graph->increments) {
    edge.variance = edge.increment.covariance + edge.stated_covariance +
                    excess[NoiseComponent::kTurn] * Eigen::Matrix3d::Identity();
  }
}

std::vector<VariancePart> PartsOf(const PoseGraph& graph) {
  PerTriad<Eigen::Matrix3d> unit;
  for (const Triad triad : kTriads) {
    if (!graph.layout.Has(triad)) continue;
    unit[triad] = graph.sensitivity(triad) * graph.sensitivity(triad).transpose();
  }
  std::vector<VariancePart> parts;
  for (std::size_t k = 0; k < graph.nodes.size(); ++k) {
    const std::vector<Observation>& observations = graph.nodes[k].observations;
    for (std::size_t i = 0; i < observations.size(); ++i) {
      const Observation& seen = observations[i];
      const std::optional<NoiseComponent> component = ComponentOf(graph.nodes[k], seen);
      if (!component) continue;
      parts.push_back({k,
                       static_cast<Eigen::Index>(3 * i),
                       *component,
                       i,
                       unit[seen.triad],
                       seen.variance,
                       seen.weight,
                       seen.rejected});
    }
  }
  for (std::size_t i = 0; i < graph.increments.size(); ++i) {
    const IncrementEdge& edge = graph.increments[i];
    parts.push_back({graph.nodes.size() + i,
                     0,
                     NoiseComponent::kTurn,
                     i,
                     Eigen::Matrix3d::Identity(),
                     edge.variance,
                     edge.weight,
                     edge.rejected});
  }
  return parts;
}

}  // namespace truetriad
