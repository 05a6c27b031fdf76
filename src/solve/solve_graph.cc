// SPDX-License-Identifier: Apache-2.0
#include "solve/solve_graph.h"

#include <cmath>
#include <cstddef>
#include <utility>

#include "solve/ceres_problem.h"
#include "solve/chain_elimination.h"
#include "solve/eliminated.h"

namespace truetriad {
namespace {

// The most iterations, summed over all integrations. Problems that need more are undetermined or
// start far from the optimum.
constexpr int kMaxIterations = 300;
// Chosen: after this many integrations, the last optimum is kept. Each integration leaves an error
// of second order in the parameters' change.
constexpr int kMaxIntegrations = 10;
// If the error of linearising the increments is below this share of the tolerance, they are not
// integrated again.
constexpr double kStillLinear = 1e-2;

SolveOutcome SolveAsIntegrated(PoseGraph* graph, double tolerance, int max_iterations) {
  ChainProblem problem = ChainOf(*graph);
  const SolveOutcome outcome =
      SolveChain(graph->solver, tolerance, max_iterations, &problem, &graph->shared);
  for (std::size_t k = 0; k < graph->nodes.size(); ++k) {
    graph->nodes[k].state = problem.states[k].values;
  }
  return outcome;
}

}  // namespace

SolveOutcome SolveChain(Solver solver,
                        double tolerance,
                        int max_iterations,
                        ChainProblem* problem,
                        Eigen::VectorXd* shared) {
  if (solver == Solver::kCeres) return SolveByCeres(tolerance, max_iterations, problem, shared);
  const SharedLayout& layout = *problem->layout;
  ChainElimination elimination(std::move(*problem));
  Eigen::VectorXd solved = *shared;
  const SolveOutcome outcome =
      SolveEliminated(layout, tolerance, max_iterations, &elimination, &solved);
  *shared = elimination.shared();
  *problem = std::move(elimination).TakeProblem();
  return outcome;
}

SolveOutcome SolveGraph(PoseGraph* graph, double tolerance) {
  const auto integrate = [graph] {
    for (IncrementEdge& edge : graph->increments) {
      edge.Integrate(graph->layout, graph->shared.data());
    }
    graph->integrated_at = graph->shared;
  };
  // An increment is linear in the gyroscope's parameters only near those at which it was
  // integrated. It is therefore integrated again until the optimum does not change.
  SolveOutcome whole;
  for (int round = 0; round < kMaxIntegrations && whole.iterations < kMaxIterations; ++round) {
    if (graph->integrated_at.size() == 0) graph->integrated_at = graph->shared;
    const SolveOutcome outcome =
        SolveAsIntegrated(graph, tolerance, kMaxIterations - whole.iterations);
    if (round == 0) whole.initial_cost = outcome.initial_cost;
    whole.converged = outcome.converged;
    whole.iterations += outcome.iterations;
    whole.final_cost = outcome.final_cost;
    if (graph->increments.empty()) break;
    const double moved = ((graph->shared - graph->integrated_at).array() /
                          TypicalSizes(graph->layout, graph->shared).array())
                             .abs()
                             .maxCoeff();
    if (!std::isfinite(moved)) break;
    // The error is of second order in `moved`; a final solution always integrates once more.
    const bool is_final = tolerance <= kFinalTolerance;
    if (!is_final && moved * moved < kStillLinear * tolerance) break;
    integrate();
    if (moved * moved < tolerance) break;
  }
  return whole;
}

}  // namespace truetriad
