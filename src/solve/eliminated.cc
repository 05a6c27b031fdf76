// SPDX-License-Identifier: Apache-2.0
#include "solve/eliminated.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <ceres/cost_function.h>
#include <ceres/problem.h>
#include <ceres/solver.h>

#include "math/dense/eigenvalues.h"
#include "math/dense/products.h"
#include "problem/graph_rows.h"
#include "solve/linear_manifold.h"
#include "solve/shared_information.h"

namespace truetriad {
namespace {

// Eigenvalues below this share of the largest are rounding errors: 5 epsilon of a double.
constexpr double kRootTolerance = 1e-15;

using RowMajorMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// A cost function that Ceres minimises in place of the reduced problem, with root^T root =
// information: residual = [root^-T gradient, sqrt(2 * remaining cost)], jacobian = [root, 0].
class EliminatedCost final : public ceres::CostFunction {
 public:
  EliminatedCost(const SharedLayout& layout,
                 const Eigen::VectorXd& start,
                 EliminatedProblem* problem)
      : layout_(layout), blocks_(SharedBlocks(layout)), problem_(*problem), at_(start) {
    for (const SharedBlock& block : blocks_) {
      mutable_parameter_block_sizes()->push_back(block.size);
    }
    set_num_residuals(layout.free_size() + 1);
    scale_ = (TypicalSizes(layout, start).asDiagonal() * layout.basis).colwise().norm();
  }

  bool Evaluate(double const* const* parameters,
                double* residuals,
                double** jacobians) const override {
    Eigen::VectorXd shared = at_;
    for (std::size_t i = 0; i < blocks_.size(); ++i) {
      shared.segment(blocks_[i].offset, blocks_[i].size) =
          Eigen::Map<const Eigen::VectorXd>(parameters[i], blocks_[i].size);
    }
    const int n = layout_.free_size();
    Eigen::Map<Eigen::VectorXd> residual(residuals, n + 1);
    if (jacobians == nullptr) {
      // Without Jacobians Ceres uses only the length of the residuals.
      residual.setZero();
      residual[n] = std::sqrt(
          2.0 * (is_linearised_ && shared == at_ ? problem_.cost() : problem_.CostAt(shared)));
      return residual.allFinite();
    }
    if (!is_linearised_ || shared != at_) {
      at_ = shared;
      problem_.Linearise(at_);
      is_linearised_ = true;
      FindRoot();
    }
    residual = residual_;
    for (std::size_t i = 0; i < blocks_.size(); ++i) {
      if (jacobians[i] == nullptr) continue;
      Eigen::Map<RowMajorMatrix> jacobian(jacobians[i], n + 1, blocks_[i].size);
      jacobian.topRows(n) =
          TimesTranspose(root_, layout_.basis.middleRows(blocks_[i].offset, blocks_[i].size));
      jacobian.row(n).setZero();
    }
    return residual.allFinite();
  }

 private:
  void FindRoot() const {
    const int n = layout_.free_size();
    residual_.setZero(n + 1);
    if (const auto scaled = SafeFactorOf(problem_.information())) {
      root_ = scaled->factor.Root().transpose() * scaled->per_own.cwiseInverse().asDiagonal();
      residual_.head(n) =
          scaled->factor.SolveLowerVector(scaled->per_own.cwiseProduct(problem_.gradient()));
    } else if (n > 0) {
      FindRootBySpectrum();
    }
    residual_[n] = std::sqrt(std::max(2.0 * problem_.cost() - residual_.squaredNorm(), 0.0));
  }

  void FindRootBySpectrum() const {
    const SymmetricEigen solver = EigenOfSymmetric(ScaledBothSides(scale_, problem_.information()));
    const Eigen::VectorXd values = solver.values.cwiseMax(0.0).cwiseSqrt();
    const double least = std::sqrt(kRootTolerance) * values.maxCoeff();
    const Eigen::MatrixXd& vectors = solver.vectors;
    root_ = values.asDiagonal() * vectors.transpose() * scale_.cwiseInverse().asDiagonal();
    const Eigen::VectorXd gradient =
        TransposeTimesVector(vectors, scale_.cwiseProduct(problem_.gradient()));
    for (Eigen::Index i = 0; i < values.size(); ++i) {
      if (values[i] > least) residual_[i] = gradient[i] / values[i];
    }
  }

  const SharedLayout& layout_;
  std::vector<SharedBlock> blocks_;
  EliminatedProblem& problem_;
  Eigen::VectorXd scale_;
  // The members below describe the last linearisation. They are mutable, since Ceres evaluates a
  // const object.
  mutable bool is_linearised_ = false;
  mutable Eigen::VectorXd at_;
  mutable Eigen::MatrixXd root_;
  mutable Eigen::VectorXd residual_;
};

// At the optimum, rounding decides whether a step lowers the cost. This callback then stops Ceres,
// which would otherwise try ever shorter steps.
class StopAtRounding : public ceres::IterationCallback {
 public:
  ceres::CallbackReturnType operator()(const ceres::IterationSummary& summary) override {
    // Rounding error of a sum of 1e4 squares: 1e4 times 1e-16.
    constexpr double kRounding = 1e-12;
    const bool has_not_moved = summary.iteration > 0 && !summary.step_is_successful &&
                               summary.step_is_valid &&
                               std::abs(summary.cost_change) <= kRounding * summary.cost;
    return has_not_moved ? ceres::SOLVER_TERMINATE_SUCCESSFULLY : ceres::SOLVER_CONTINUE;
  }
};

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

}  // namespace

SolveOutcome SolveEliminated(const SharedLayout& layout,
                             double tolerance,
                             int max_iterations,
                             EliminatedProblem* problem,
                             Eigen::VectorXd* shared) {
  ceres::Problem ceres_problem;
  std::vector<double*> blocks;
  for (const SharedBlock& block : SharedBlocks(layout)) {
    double* values = shared->data() + block.offset;
    ceres_problem.AddParameterBlock(values, block.size);
    const Eigen::MatrixXd basis = layout.BlockBasis(block.offset, block.size);
    if (basis.cols() == 0) {
      ceres_problem.SetParameterBlockConstant(values);
    } else {
      ceres_problem.SetManifold(values, new LinearManifold(basis));
    }
    blocks.push_back(values);
  }
  ceres_problem.AddResidualBlock(new EliminatedCost(layout, *shared, problem), nullptr, blocks);

  ceres::Solver::Options options = SolverOptions(tolerance);
  options.linear_solver_type = ceres::DENSE_QR;
  options.max_num_iterations = max_iterations;
  StopAtRounding stop;
  options.callbacks.push_back(&stop);
  ceres::Solver::Summary summary;
  ceres::Solve(options, &ceres_problem, &summary);
  SolveOutcome outcome;
  outcome.converged = summary.termination_type == ceres::CONVERGENCE ||
                      summary.termination_type == ceres::USER_SUCCESS;
  outcome.iterations = static_cast<int>(summary.iterations.size());
  outcome.initial_cost = summary.initial_cost;
  outcome.final_cost = summary.final_cost;
  return outcome;
}

}  // namespace truetriad
