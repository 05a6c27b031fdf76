// SPDX-License-Identifier: Apache-2.0
#include "solve/solve_graph.h"

#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "solve/linearised_graph.h"
#include "solve/shared_problem.h"

namespace truetriad {
namespace {

constexpr int kMaxIterations = 200;
constexpr int kMaxIntegrations = 10;
// Of the tolerance: an increment that is linear to this needs no integration.
constexpr double kStillLinear = 1e-2;

// The poses eliminated; `graph` stands where it was linearised last.
class PoseElimination final : public EliminatedProblem {
 public:
  explicit PoseElimination(PoseGraph* graph) : graph_(*graph) {}

  void Linearise(const Eigen::VectorXd& shared) override {
    if (system_) system_->TakeStep(StepTo(shared), &graph_);
    graph_.shared = shared;
    system_.emplace(graph_);
  }

  double CostAt(const Eigen::VectorXd& shared) const override {
    Eigen::VectorXd pose_steps;
    if (system_) pose_steps = system_->PoseSteps(StepTo(shared));
    double sum = 0.0;
    PoseResidual12 residual;
    std::vector<std::array<double, 4>> states;
    Eigen::Index at = 0;
    for (const PoseNode& node : graph_.nodes) {
      const int size = node.tangent_size();
      states.push_back(system_ ? node.StateAfter(pose_steps.segment(at, size)) : node.state);
      at += size;
      if (node.row_count() == 0) continue;
      node.Evaluate(
          graph_.layout, shared.data(), states.back().data(), &residual, nullptr, nullptr);
      sum += residual.dot(node.Information() * residual);
    }
    for (const IncrementEdge& edge : graph_.increments) {
      Eigen::Vector3d turn;
      edge.Evaluate(graph_.layout,
                    shared.data(),
                    states[edge.from].data(),
                    states[edge.from + 1].data(),
                    &turn,
                    nullptr,
                    nullptr,
                    nullptr);
      sum += turn.dot(edge.Information() * turn);
    }
    for (const ScalarPrior& prior : graph_.priors) {
      const double off = (shared[prior.index] - prior.mean) / prior.sigma;
      sum += off * off;
    }
    return 0.5 * sum;
  }

  double cost() const override { return system_->cost(); }
  const Eigen::VectorXd& gradient() const override { return system_->gradient(); }
  const Eigen::MatrixXd& information() const override { return system_->matrix(); }

 private:
  Eigen::VectorXd StepTo(const Eigen::VectorXd& shared) const {
    return graph_.layout.basis.transpose() * (shared - graph_.shared);
  }

  PoseGraph& graph_;
  std::optional<LinearisedGraph> system_;
};

SolveOutcome SolveAsIntegrated(PoseGraph* graph, double tolerance) {
  PoseElimination problem(graph);
  Eigen::VectorXd shared = graph->shared;
  return SolveEliminated(graph->layout, tolerance, kMaxIterations, &problem, &shared);
}

}  // namespace

SolveOutcome SolveGraph(PoseGraph* graph, double tolerance) {
  const auto integrate = [graph] {
    for (IncrementEdge& edge : graph->increments) {
      edge.Integrate(graph->layout, graph->shared.data());
    }
    graph->integrated_at = graph->shared;
  };
  // An increment is linear in the gyroscope's parameters only near the point where it was
  // integrated: integrated again, until the optimum stays.
  SolveOutcome whole;
  for (int round = 0; round < kMaxIntegrations; ++round) {
    if (graph->integrated_at.size() == 0) graph->integrated_at = graph->shared;
    const SolveOutcome outcome = SolveAsIntegrated(graph, tolerance);
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
    // The error is of second order in what moved. At the end the turns themselves are looked at.
    const bool is_final = tolerance <= kFinalTolerance;
    if (!is_final && moved * moved < kStillLinear * tolerance) break;
    integrate();
    if (moved * moved < tolerance) break;
  }
  return whole;
}

}  // namespace truetriad
