// SPDX-License-Identifier: Apache-2.0
#include "estimation/shared_problem.h"

#include <cmath>

#include "estimation/pose_cost.h"

namespace truetriad {

std::vector<double*> AddSharedBlocks(PoseGraph* graph, ceres::Problem* problem) {
  std::vector<double*> blocks;
  for (const SharedBlock& block : SharedBlocks(graph->layout)) {
    double* values = graph->shared.data() + block.offset;
    problem->AddParameterBlock(values, block.size);
    const Eigen::MatrixXd basis = graph->layout.BlockBasis(block.offset, block.size);
    if (basis.cols() == 0) {
      problem->SetParameterBlockConstant(values);
    } else {
      problem->SetManifold(values, new LinearManifold(basis));
    }
    blocks.push_back(values);
  }
  return blocks;
}

ceres::Solver::Options SolverOptions(double tolerance) {
  ceres::Solver::Options options;
  options.logging_type = ceres::SILENT;
  options.num_threads = 1;
  options.function_tolerance = tolerance;
  options.parameter_tolerance = 1e-13;
  options.gradient_tolerance = 0.0;
  options.initial_trust_region_radius = 1e8;
  return options;
}

namespace {

// At the optimum rounding decides whether a step lowers the cost. Ceres would try shorter and
// shorter ones.
class StopAtRounding : public ceres::IterationCallback {
 public:
  ceres::CallbackReturnType operator()(const ceres::IterationSummary& summary) override {
    constexpr double kRounding = 1e-12;
    const bool has_not_moved = summary.iteration > 0 && !summary.step_is_successful &&
                               summary.step_is_valid &&
                               std::abs(summary.cost_change) <= kRounding * summary.cost;
    return has_not_moved ? ceres::SOLVER_TERMINATE_SUCCESSFULLY : ceres::SOLVER_CONTINUE;
  }
};

}  // namespace

SolveOutcome SolveProblem(ceres::Solver::Options options, ceres::Problem* problem) {
  StopAtRounding stop;
  options.callbacks.push_back(&stop);
  ceres::Solver::Summary summary;
  ceres::Solve(options, problem, &summary);
  SolveOutcome outcome;
  outcome.converged = summary.termination_type == ceres::CONVERGENCE ||
                      summary.termination_type == ceres::USER_SUCCESS;
  outcome.iterations = static_cast<int>(summary.iterations.size());
  outcome.initial_cost = summary.initial_cost;
  outcome.final_cost = summary.final_cost;
  return outcome;
}

}  // namespace truetriad
