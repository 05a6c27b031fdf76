// SPDX-License-Identifier: Apache-2.0
#include "estimation/reduced_system.h"

#include <utility>

#include <Eigen/Cholesky>

namespace truetriad {
namespace {

using Block = TridiagonalChain::Block;
using SixBlock = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 6, 6>;
using ThreeRows = Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, 6>;

// The block of a symmetric matrix that belongs to the poses a factor sees, from its own blocks.
SixBlock PoseBlock(const ReducedSystem::Factor& factor,
                   const std::vector<Block>& own,
                   const std::vector<Block>& with_next) {
  if (factor.own == factor.A.cols()) return own[factor.node];
  const Block& first = own[factor.node];
  const Block& second = own[factor.node + 1];
  SixBlock block(first.rows() + second.rows(), first.cols() + second.cols());
  block << first, with_next[factor.node], with_next[factor.node].transpose(), second;
  return block;
}

// Adds a factor's block to where its poses stand.
void AddPoseBlock(const ReducedSystem::Factor& factor,
                  const SixBlock& block,
                  std::vector<Block>* own,
                  std::vector<Block>* with_next) {
  const Eigen::Index first = factor.own;
  const Eigen::Index second = factor.A.cols() - first;
  if (first > 0) (*own)[factor.node] += block.topLeftCorner(first, first);
  if (second == 0) return;
  (*own)[factor.node + 1] += block.bottomRightCorner(second, second);
  if (first > 0) (*with_next)[factor.node] = block.topRightCorner(first, second);
}

}  // namespace

ReducedSystem::ReducedSystem(const PoseGraph& graph) {
  const SharedLayout& layout = graph.layout;
  const int n = layout.free_size();
  Eigen::Index rows = 3 * static_cast<Eigen::Index>(graph.increments.size());
  for (const PoseNode& node : graph.nodes) rows += node.row_count();
  columns_.resize(rows, n + 1);
  const StackedRows basis = layout.basis;
  factors_.reserve(graph.nodes.size() + graph.increments.size());
  PoseSharedJacobian shared_jacobian;
  Eigen::Index row = 0;
  const auto take = [&](Factor&& factor, const auto& residual) {
    factor.row = row;
    auto own = columns_.middleRows(row, factor.rows());
    own.setZero();
    AddProduct(1.0, shared_jacobian, basis, own.leftCols(n));
    own.col(n) = residual;
    row += factor.rows();
    factors_.push_back(std::move(factor));
  };
  for (std::size_t k = 0; k < graph.nodes.size(); ++k) {
    const PoseNode& node = graph.nodes[k];
    Factor factor;
    factor.node = k;
    PoseResidual12 residual;
    PoseStateJacobian by_state;
    node.Evaluate(
        layout, graph.shared.data(), node.state.data(), &residual, &shared_jacobian, &by_state);
    factor.A = by_state;
    factor.own = by_state.cols();
    tangent_sizes_.push_back(node.tangent_size());
    take(std::move(factor), residual);
  }
  for (const IncrementEdge& edge : graph.increments) {
    Factor factor;
    factor.node = edge.from;
    Eigen::Vector3d residual;
    Eigen::Matrix3d by_first, by_second;
    edge.Evaluate(layout,
                  graph.shared.data(),
                  graph.nodes[edge.from].state.data(),
                  graph.nodes[edge.from + 1].state.data(),
                  &residual,
                  &shared_jacobian,
                  &by_first,
                  &by_second);
    factor.own = graph.nodes[edge.from].tangent_size();
    const int next = graph.nodes[edge.from + 1].tangent_size();
    factor.A.resize(3, factor.own + next);
    factor.A << by_first.leftCols(factor.own), by_second.leftCols(next);
    take(std::move(factor), residual);
  }
  residual_ = columns_.col(n);
  prior_information_ = Eigen::MatrixXd::Zero(n, n);
  prior_gradient_ = Eigen::VectorXd::Zero(n);
  for (const ScalarPrior& prior : graph.priors) {
    const Eigen::RowVectorXd direction = layout.basis.row(prior.index) / prior.sigma;
    prior_information_ += direction.transpose() * direction;
    prior_gradient_ +=
        direction.transpose() * ((graph.shared[prior.index] - prior.mean) / prior.sigma);
  }
  Eliminate(graph);
}

// A^T V^-1 A from the factors' information.
void ReducedSystem::FormChain() {
  std::vector<Block> diagonal;
  std::vector<Block> coupling(tangent_sizes_.empty() ? 0 : tangent_sizes_.size() - 1);
  for (const int size : tangent_sizes_) diagonal.push_back(Block::Zero(size, size));
  for (const Factor& factor : factors_) {
    if (factor.A.cols() == 0) continue;
    AddPoseBlock(factor, factor.A.transpose() * factor.weighted, &diagonal, &coupling);
  }
  chain_ = TridiagonalChain(diagonal, coupling);
}

// With W = V^-1: W y - W A (A^T W A)^-1 A^T W y.
StackedRows ReducedSystem::Project(const StackedRows& y) const {
  StackedRows projected = StackedRows::Zero(y.rows(), y.cols());
  StackedRows right = StackedRows::Zero(chain_.size(), y.cols());
  for (const Factor& factor : factors_) {
    const auto rows = y.middleRows(factor.row, factor.rows());
    AddProduct(1.0, factor.information, rows, projected.middleRows(factor.row, factor.rows()));
    AddProduct(
        1.0, factor.weighted.transpose(), rows, right.middleRows(PoseRow(factor), factor.A.cols()));
  }
  chain_.SolveInPlace(&right);
  for (const Factor& factor : factors_) {
    AddProduct(-1.0,
               factor.weighted,
               right.middleRows(PoseRow(factor), factor.A.cols()),
               projected.middleRows(factor.row, factor.rows()));
  }
  return projected;
}

void ReducedSystem::Eliminate(const PoseGraph& graph) {
  const int n = graph.layout.free_size();
  for (std::size_t f = 0; f < factors_.size(); ++f) {
    Factor& factor = factors_[f];
    const PoseRowMatrix root =
        f < graph.nodes.size()
            ? graph.nodes[f].SquareRootInformation()
            : PoseRowMatrix(graph.increments[f - graph.nodes.size()].SquareRootInformation());
    factor.information.noalias() = root.transpose().lazyProduct(root);
    factor.weighted.noalias() = factor.information.lazyProduct(factor.A);
  }
  FormChain();
  projected_columns_ = Project(columns_);
  for (Factor& factor : factors_) {
    factor.D = factor.information;
    if (factor.A.cols() == 0) continue;
    const PoseColumns half = factor.weighted.lazyProduct(
        PoseBlock(factor, chain_.covariances(), chain_.covariances_with_next()));
    factor.D.noalias() -= half.lazyProduct(factor.weighted.transpose());
  }
  Eigen::MatrixXd whole(n + 1, n + 1);
  whole.noalias() = columns_.transpose() * projected_columns_;
  shared_ = SharedInformation(graph.layout,
                              graph.shared,
                              prior_information_ + whole.topLeftCorner(n, n),
                              prior_gradient_ + whole.topRightCorner(n, 1));
  projected_ = projected_columns_.col(n);
  if (size() > 0) projected_ += B() * step();
  BM_.noalias() = B() * covariance();
}

// -(A^T W A)^-1 A^T W (r + J step).
Eigen::VectorXd ReducedSystem::PoseSteps() const {
  Eigen::VectorXd left = residual_;
  if (size() > 0) left += J() * step();
  StackedRows steps = StackedRows::Zero(chain_.size(), 1);
  for (const Factor& factor : factors_) {
    steps.middleRows(PoseRow(factor), factor.A.cols()).noalias() -=
        factor.weighted.transpose() * left.segment(factor.row, factor.rows());
  }
  chain_.SolveInPlace(&steps);
  return steps.col(0);
}

Eigen::Matrix3d ReducedSystem::ProjectorBlock(std::size_t factor, Eigen::Index row) const {
  const Factor& seen = factors_[factor];
  Eigen::Matrix3d block = seen.D.block<3, 3>(row, row);
  const Eigen::Index first = seen.row + row;
  block.noalias() -=
      BM_.middleRows<3>(first).lazyProduct(B().middleRows<3>(first).transpose());
  return block;
}

// With W = V^-1, N = A^T W A, E = W A: dW = -W dV W, dN = A^T dW A, and of D = W - E N^-1 E^T the
// block of the rows c, where the rows b of the same factor change,
//
//   dW_cc - H - H^T - E_c d(N^-1) E_c^T,    dW_cc = -W_cb dV W_bc,  H = -W_cb dV E_b N^-1 E_c^T.
std::vector<Eigen::Matrix3d> ReducedSystem::ProjectorDerivative(
    const std::vector<VarianceChange>& dV, const std::vector<VarianceChange>& wanted) const {
  const auto rows_of = [&](const VarianceChange& at) -> ThreeRows {
    return factors_[at.factor].weighted.middleRows<3>(at.row);
  };
  std::vector<Block> diagonal, coupling(tangent_sizes_.empty() ? 0 : tangent_sizes_.size() - 1);
  for (const int size : tangent_sizes_) diagonal.push_back(Block::Zero(size, size));
  for (std::size_t k = 0; k < coupling.size(); ++k) {
    coupling[k].setZero(chain_.CovarianceWithNext(k).rows(), chain_.CovarianceWithNext(k).cols());
  }
  std::vector<std::vector<const VarianceChange*>> of_factor(factors_.size());
  for (const VarianceChange& at : dV) {
    of_factor[at.factor].push_back(&at);
    const Factor& factor = factors_[at.factor];
    if (factor.A.cols() == 0) continue;
    const ThreeRows E = rows_of(at);
    const ThreeRows changed = at.change.lazyProduct(E);
    AddPoseBlock(factor, SixBlock(-E.transpose().lazyProduct(changed)), &diagonal, &coupling);
  }
  std::vector<Block> own, with_next;
  chain_.CovarianceDerivative(diagonal, coupling, &own, &with_next);
  std::vector<Eigen::Matrix3d> blocks;
  blocks.reserve(wanted.size());
  for (const VarianceChange& at : wanted) {
    const Factor& factor = factors_[at.factor];
    Eigen::Matrix3d& block = blocks.emplace_back(Eigen::Matrix3d::Zero());
    const ThreeRows E = rows_of(at);
    ThreeRows by_poses(3, E.cols());
    if (E.cols() > 0) {
      const ThreeRows changed = E.lazyProduct(PoseBlock(factor, own, with_next));
      block.noalias() -= changed.lazyProduct(E.transpose());
      by_poses.noalias() =
          E.lazyProduct(PoseBlock(factor, chain_.covariances(), chain_.covariances_with_next()));
    }
    for (const VarianceChange* const cause : of_factor[at.factor]) {
      const Eigen::Matrix3d W = factor.information.block<3, 3>(at.row, cause->row);
      const Eigen::Matrix3d changed = W * cause->change;
      block.noalias() -= changed * W.transpose();
      if (E.cols() == 0) continue;
      const Eigen::Matrix3d half = changed * rows_of(*cause).lazyProduct(by_poses.transpose());
      block += half + half.transpose();
    }
  }
  return blocks;
}

}  // namespace truetriad
