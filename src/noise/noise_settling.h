// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "noise/variance_components.h"
#include "problem/graph.h"
#include "solve/reduced_system.h"
#include "truetriad/data/static_pose.h"
#include "truetriad/model/finding.h"
#include "truetriad/problem/options.h"

namespace truetriad {

// The noise that weights the observations, and its sources.
struct NoiseState {
  PerTriad<NoiseSource> source{};
  std::vector<NoiseComponent> estimated;  // components whose excess is estimated
  ExcessVariance excess{};
  ExcessEstimate estimate;
  bool unknown = false;  // residuals were to give the noise, but cannot

  // Whether the whole noise of the component is estimated from the residuals.
  bool IsFromResiduals(NoiseComponent component) const {
    if (component == NoiseComponent::kRate) component = NoiseComponent::kGyroscope;
    const std::optional<Triad> triad = TriadOf(component);
    return triad && source[*triad] == NoiseSource::kResidual;
  }
};

// Chooses the source of each triad's rest noise, and whether its excess is estimated.
NoiseState ChooseNoise(const PoseSet& poses, const CalibrateOptions& options, Findings* findings);

// Sets the noise with which the first solution starts, and the graph's variances. Triads without
// rest noise get noise in proportion to their signal, so that their weights are balanced.
void StartNoise(NoiseState* noise, PoseGraph* graph);

// Reduces the weight of readings whose length, according to the start values, is far from that of
// the field. A few such readings would displace the first solution. UpdateWeights tests them again.
void WeighReadingsAtStart(const RobustOptions& robust, PoseGraph* graph);

// Iterations, cost and convergence over all optimisations of a run.
struct SolveLog {
  bool converged = false;  // of the last optimisation
  int iterations = 0;
  double initial_cost = -1.0;  // of the first optimisation
  double final_cost = -1.0;

  void Solve(double tolerance, PoseGraph* graph);
};

// The limit of |z|, for a standard normal z: the robust step rejects observations above it if it
// makes `tests` tests.
double RejectedFrom(std::size_t tests);

// The number of rows and priors minus the number of unknowns, without rejected observations.
double ResidualDof(const PoseGraph& graph, const ReducedSystem& system);

// The estimated variance that is furthest from its optimum. `system`: the linear system of `graph`
// at its present state.
OffOptimum FurthestOff(const NoiseState& noise,
                       const PoseGraph& graph,
                       const ReducedSystem& system);

// Alternates the robust step, the estimate of the excess and the solution until nothing changes.
// Returns the number of rounds.
int SettleNoise(const RobustOptions& robust,
                NoiseState* noise,
                PoseGraph* graph,
                SolveLog* log,
                Findings* findings);

}  // namespace truetriad
