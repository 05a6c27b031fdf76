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

// What is known of the noise that weights the observations, and how.
struct NoiseState {
  PerTriad<NoiseSource> source{};
  std::vector<NoiseComponent> estimated;  // whose excess is estimated
  ExcessVariance excess{};
  ExcessEstimate estimate;
  bool unknown = false;  // residuals were to show it, and there are none

  // All the noise of this component there is comes from the residuals.
  bool IsFromResiduals(NoiseComponent component) const {
    if (component == NoiseComponent::kRate) component = NoiseComponent::kGyroscope;
    const std::optional<Triad> triad = TriadOf(component);
    return triad && source[*triad] == NoiseSource::kResidual;
  }
};

// Where each triad's rest noise comes from, and whether its excess is estimated.
NoiseState ChooseNoise(const PoseSet& poses, const CalibrateOptions& options, Findings* findings);

// Before anything is known of the excess: what keeps triads without rest noise balanced against
// each other. Sets the graph's variances.
void StartNoise(NoiseState* noise, PoseGraph* graph);

// Gives little weight to readings whose length is far from that of the field at the start: a few
// would pull the first solution far away. UpdateWeights judges them anew.
void WeighReadingsAtStart(const RobustOptions& robust, PoseGraph* graph);

// The optimisations of a run, added up.
struct SolveLog {
  bool converged = false;  // the last one
  int iterations = 0;
  double initial_cost = -1.0;  // of the first one
  double final_cost = -1.0;

  void Solve(double tolerance, PoseGraph* graph);
};

// The σ of one normal number from which on the robust step leaves out one of so many.
double RejectedFrom(std::size_t tests);

// Rows and priors less unknowns; rejected observations do not count.
double ResidualDof(const PoseGraph& graph, const ReducedSystem& system);

// How far the variances are from their optimum at the graph's state; `system`: of the graph.
OffOptimum FurthestOff(const NoiseState& noise,
                       const PoseGraph& graph,
                       const ReducedSystem& system);

// The robust step, the excess noise and the solution, in turn until nothing changes. Returns the
// number of rounds.
int SettleNoise(const RobustOptions& robust,
                NoiseState* noise,
                PoseGraph* graph,
                SolveLog* log,
                Findings* findings);

}  // namespace truetriad
