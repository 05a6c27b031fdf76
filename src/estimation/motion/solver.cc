// SPDX-License-Identifier: Apache-2.0
#include "estimation/motion/solver.h"

#include <cmath>
#include <utility>
#include <vector>

#include <Eigen/Eigenvalues>
#include <ceres/cost_function.h>
#include <ceres/problem.h>

#include "estimation/pose_cost.h"
#include "estimation/shared_problem.h"

namespace truetriad {
namespace {

constexpr int kMaxIterations = 50;
constexpr double kRankTolerance = 1e-15;

using RowMajorMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

class MotionCost final : public ceres::CostFunction {
 public:
  MotionCost(const SharedLayout& layout, const Eigen::VectorXd& start, MotionChain* chain)
      : layout_(layout), blocks_(SharedBlocks(layout)), chain_(*chain), at_(start) {
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
      // Only the length counts.
      residual.setZero();
      residual[n] = std::sqrt(2.0 * CostAt(shared));
      return residual.allFinite();
    }
    if (!is_linearised_ || shared != at_) {
      if (is_linearised_) chain_.SetAttitudes(AttitudesAt(shared));
      at_ = shared;
      chain_.Linearise(at_.data());
      is_linearised_ = true;
      FindRoot();
    }
    residual = residual_;
    for (std::size_t i = 0; i < blocks_.size(); ++i) {
      if (jacobians[i] == nullptr) continue;
      Eigen::Map<RowMajorMatrix> jacobian(jacobians[i], n + 1, blocks_[i].size);
      jacobian.topRows(n).noalias() =
          root_ * layout_.basis.middleRows(blocks_[i].offset, blocks_[i].size).transpose();
      jacobian.row(n).setZero();
    }
    return residual.allFinite();
  }

 private:
  // The attitudes that the last linearisation gives at other shared parameters.
  std::vector<Eigen::Quaterniond> AttitudesAt(const Eigen::VectorXd& shared) const {
    return chain_.AttitudesAfter(layout_.basis.transpose() * (shared - at_));
  }
  double CostAt(const Eigen::VectorXd& shared) const {
    if (shared == at_) return chain_.cost();
    return chain_.CostAt(shared.data(), AttitudesAt(shared));
  }
  void FindRoot() const {
    const int n = layout_.free_size();
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(
        scale_.asDiagonal() * chain_.information() * scale_.asDiagonal());
    const Eigen::VectorXd values = solver.eigenvalues().cwiseMax(0.0).cwiseSqrt();
    const double least = std::sqrt(kRankTolerance) * values.maxCoeff();
    const Eigen::MatrixXd vectors = solver.eigenvectors();
    root_ = values.asDiagonal() * vectors.transpose() * scale_.cwiseInverse().asDiagonal();
    residual_.setZero(n + 1);
    const Eigen::VectorXd gradient = vectors.transpose() * scale_.cwiseProduct(chain_.gradient());
    for (int i = 0; i < n; ++i) {
      if (values[i] > least) residual_[i] = gradient[i] / values[i];
    }
    residual_[n] = std::sqrt(std::max(2.0 * chain_.cost() - residual_.squaredNorm(), 0.0));
  }

  const SharedLayout& layout_;
  std::vector<SharedBlock> blocks_;
  MotionChain& chain_;
  Eigen::VectorXd scale_;
  // Ceres evaluates through a const pointer; what stands below belongs to the last linearisation.
  mutable bool is_linearised_ = false;
  mutable Eigen::VectorXd at_;
  mutable Eigen::MatrixXd root_;
  mutable Eigen::VectorXd residual_;
};

}  // namespace

SolveOutcome SolveMotion(MotionChain* chain, PoseGraph* graph, double tolerance) {
  ceres::Problem problem;
  const std::vector<double*> blocks = AddSharedBlocks(graph, &problem);
  problem.AddResidualBlock(new MotionCost(graph->layout, graph->shared, chain), nullptr, blocks);

  ceres::Solver::Options options = SolverOptions(tolerance);
  options.linear_solver_type = ceres::DENSE_QR;
  options.max_num_iterations = kMaxIterations;
  return SolveProblem(options, &problem);
}

}  // namespace truetriad
