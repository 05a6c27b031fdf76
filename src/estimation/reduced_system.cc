// SPDX-License-Identifier: Apache-2.0
#include "estimation/reduced_system.h"

#include <utility>

#include <Eigen/Cholesky>

namespace truetriad {
namespace {

using Block = TridiagonalChain::Block;
using SixColumns = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxPoseRows, 6>;
using SixBlock = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 6, 6>;

// Columns of both poses that a factor sees.
SixColumns PoseColumns(const ReducedSystem::Factor& factor) {
  SixColumns columns(factor.A.rows(), factor.A.cols() + factor.A_next.cols());
  columns << factor.A, factor.A_next;
  return columns;
}

// The block of a symmetric matrix that belongs to the poses a factor sees, from its own blocks.
SixBlock PoseBlock(const ReducedSystem::Factor& factor,
                   const std::vector<Block>& own,
                   const std::vector<Block>& with_next) {
  if (factor.A_next.cols() == 0) return own[factor.node];
  const Block& first = own[factor.node];
  const Block& second = own[factor.node + 1];
  SixBlock block(first.rows() + second.rows(), first.cols() + second.cols());
  block << first, with_next[factor.node], with_next[factor.node].transpose(), second;
  return block;
}

}  // namespace

ReducedSystem::ReducedSystem(const PoseGraph& graph) {
  const SharedLayout& layout = graph.layout;
  const int n = layout.free_size();
  factors_.resize(graph.nodes.size() + graph.increments.size());
  PoseSharedJacobian shared_jacobian;
  for (std::size_t k = 0; k < graph.nodes.size(); ++k) {
    Factor& factor = factors_[k];
    factor.node = k;
    graph.nodes[k].Evaluate(layout,
                            graph.shared.data(),
                            graph.nodes[k].state.data(),
                            &factor.residual,
                            &shared_jacobian,
                            &factor.A);
    factor.A_next.resize(factor.A.rows(), 0);
    factor.J = shared_jacobian * layout.basis;
    tangent_sizes_.push_back(graph.nodes[k].tangent_size());
  }
  for (std::size_t i = 0; i < graph.increments.size(); ++i) {
    const IncrementEdge& edge = graph.increments[i];
    Factor& factor = factors_[graph.nodes.size() + i];
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
    factor.residual = residual;
    factor.A = by_first.leftCols(graph.nodes[edge.from].tangent_size());
    factor.A_next = by_second.leftCols(graph.nodes[edge.from + 1].tangent_size());
    factor.J = shared_jacobian * layout.basis;
  }
  prior_information_ = Eigen::MatrixXd::Zero(n, n);
  prior_gradient_ = Eigen::VectorXd::Zero(n);
  for (const ScalarPrior& prior : graph.priors) {
    const Eigen::RowVectorXd row = layout.basis.row(prior.index) / prior.sigma;
    prior_information_ += row.transpose() * row;
    prior_gradient_ += row.transpose() * ((graph.shared[prior.index] - prior.mean) / prior.sigma);
  }
  Eliminate(graph);
}

// A^T V^-1 A from the factors' information.
void ReducedSystem::FormChain() {
  std::vector<Block> diagonal;
  std::vector<Block> coupling(tangent_sizes_.empty() ? 0 : tangent_sizes_.size() - 1);
  for (const int size : tangent_sizes_) diagonal.push_back(Block::Zero(size, size));
  for (const Factor& factor : factors_) {
    if (factor.A.cols() > 0) {
      diagonal[factor.node] += factor.A.transpose() * factor.information * factor.A;
    }
    if (factor.A_next.cols() == 0) continue;
    diagonal[factor.node + 1] += factor.A_next.transpose() * factor.information * factor.A_next;
    if (factor.A.cols() > 0) {
      coupling[factor.node] = factor.A.transpose() * factor.information * factor.A_next;
    }
  }
  chain_ = TridiagonalChain(diagonal, coupling);
}

// Sum over the factors of A^T times their rows, pose by pose.
Eigen::MatrixXd ReducedSystem::PoseRightSide(const std::vector<PoseRows>& weighted) const {
  Eigen::MatrixXd right = Eigen::MatrixXd::Zero(chain_.size(), weighted.front().cols());
  for (std::size_t f = 0; f < factors_.size(); ++f) {
    const Factor& factor = factors_[f];
    if (factor.A.cols() > 0) {
      right.middleRows(chain_.offset(factor.node), factor.A.cols()).noalias() +=
          factor.A.transpose() * weighted[f];
    }
    if (factor.A_next.cols() > 0) {
      right.middleRows(chain_.offset(factor.node + 1), factor.A_next.cols()).noalias() +=
          factor.A_next.transpose() * weighted[f];
    }
  }
  return right;
}

std::vector<PoseRows> ReducedSystem::Project(const std::vector<PoseRows>& y) const {
  std::vector<PoseRows> projected(y.size());
  if (y.empty()) return projected;
  for (std::size_t f = 0; f < y.size(); ++f) projected[f] = factors_[f].information * y[f];
  const Eigen::MatrixXd poses = chain_.Solve(PoseRightSide(projected));
  for (std::size_t f = 0; f < y.size(); ++f) {
    const Factor& factor = factors_[f];
    if (factor.A.cols() > 0) {
      projected[f].noalias() -= factor.information * factor.A *
                                poses.middleRows(chain_.offset(factor.node), factor.A.cols());
    }
    if (factor.A_next.cols() > 0) {
      projected[f].noalias() -=
          factor.information * factor.A_next *
          poses.middleRows(chain_.offset(factor.node + 1), factor.A_next.cols());
    }
  }
  return projected;
}

void ReducedSystem::Eliminate(const PoseGraph& graph) {
  const int n = graph.layout.free_size();
  std::vector<PoseRows> columns(factors_.size());
  for (std::size_t f = 0; f < factors_.size(); ++f) {
    Factor& factor = factors_[f];
    PoseRowMatrix root;
    if (f < graph.nodes.size()) {
      root = graph.nodes[f].SquareRootInformation();
    } else {
      root = graph.increments[f - graph.nodes.size()].SquareRootInformation();
    }
    factor.information = root.transpose() * root;
    columns[f].resize(factor.J.rows(), n + 1);
    columns[f] << factor.J, factor.residual;
  }
  FormChain();
  Eigen::MatrixXd information = prior_information_;
  Eigen::VectorXd gradient = prior_gradient_;
  const std::vector<PoseRows> projected = Project(columns);
  for (std::size_t f = 0; f < factors_.size(); ++f) {
    Factor& factor = factors_[f];
    factor.B = projected[f].leftCols(n);
    factor.projected = projected[f].col(n);
    information.noalias() += factor.J.transpose() * factor.B;
    gradient.noalias() += factor.B.transpose() * factor.residual;
    factor.D = factor.information;
    const SixColumns seen = factor.information * PoseColumns(factor);
    if (seen.cols() == 0) continue;
    factor.D -= seen * PoseBlock(factor, chain_.covariances(), chain_.covariances_with_next()) *
                seen.transpose();
  }

  shared_ = SharedInformation(graph.layout, graph.shared, std::move(information), gradient);
  if (size() == 0) return;
  for (Factor& factor : factors_) factor.projected += factor.B * step();
}

Eigen::MatrixXd ReducedSystem::ProjectorBlock(std::size_t factor) const {
  const PoseRows& B = factors_[factor].B;
  return factors_[factor].D - B * covariance() * B.transpose();
}

// With W = V^-1, N = A^T W A: dW = -W dV W, dN = A^T dW A, and of
// D = W - W A N^-1 A^T W one factor's block at a time.
std::vector<PoseRowMatrix> ReducedSystem::ProjectorDerivative(
    const std::vector<PoseRowMatrix>& dV) const {
  std::vector<PoseRowMatrix> dW(factors_.size());
  std::vector<Block> diagonal, coupling(tangent_sizes_.empty() ? 0 : tangent_sizes_.size() - 1);
  for (const int size : tangent_sizes_) diagonal.push_back(Block::Zero(size, size));
  for (std::size_t k = 0; k < coupling.size(); ++k) {
    coupling[k].setZero(chain_.CovarianceWithNext(k).rows(), chain_.CovarianceWithNext(k).cols());
  }
  for (std::size_t f = 0; f < factors_.size(); ++f) {
    const Factor& factor = factors_[f];
    dW[f] = -factor.information * dV[f] * factor.information;
    if (factor.A.cols() > 0) {
      diagonal[factor.node] += factor.A.transpose() * dW[f] * factor.A;
    }
    if (factor.A_next.cols() == 0) continue;
    diagonal[factor.node + 1] += factor.A_next.transpose() * dW[f] * factor.A_next;
    if (factor.A.cols() > 0) coupling[factor.node] = factor.A.transpose() * dW[f] * factor.A_next;
  }
  std::vector<Block> own, with_next;
  chain_.CovarianceDerivative(diagonal, coupling, &own, &with_next);
  std::vector<PoseRowMatrix> dD = dW;
  for (std::size_t f = 0; f < factors_.size(); ++f) {
    const Factor& factor = factors_[f];
    const SixColumns columns = PoseColumns(factor);
    if (columns.cols() == 0) continue;
    const SixBlock covariance =
        PoseBlock(factor, chain_.covariances(), chain_.covariances_with_next());
    const SixColumns seen = factor.information * columns;
    const PoseRowMatrix half = dW[f] * columns * covariance * seen.transpose();
    dD[f] -= half + half.transpose() + seen * PoseBlock(factor, own, with_next) * seen.transpose();
  }
  return dD;
}

}  // namespace truetriad
