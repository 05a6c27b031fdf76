// SPDX-License-Identifier: Apache-2.0
#include "solve/reduced_system.h"

namespace truetriad {
namespace {

using Block = TridiagonalChain::Block;
using ThreeRows = Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, 6>;

}  // namespace

ReducedSystem::ReducedSystem(const PoseGraph& graph) : LinearisedGraph(graph) { Complete(graph); }

void ReducedSystem::Eliminate(const PoseGraph& graph) {
  LinearisedGraph::Eliminate(graph);
  Complete(graph);
}

void ReducedSystem::Complete(const PoseGraph& graph) {
  D_.resize(factors().size());
  for (std::size_t f = 0; f < D_.size(); ++f) {
    const Factor& factor = factors()[f];
    D_[f] = factor.information;
    if (factor.A.cols() == 0) continue;
    const PoseColumns half = factor.weighted.lazyProduct(
        PoseBlock(factor, chain().covariances(), chain().covariances_with_next()));
    D_[f].noalias() -= half.lazyProduct(factor.weighted.transpose());
  }
  shared_ = SharedInformation(graph.layout, graph.shared, matrix(), gradient());
  projected_ = projected_columns().col(size());
  if (size() > 0) projected_ += B() * step();
  BM_ = ProductOfRows(projected_columns(), covariance());
}

Eigen::Matrix3d ReducedSystem::ProjectorBlock(std::size_t factor, Eigen::Index row) const {
  Eigen::Matrix3d block = D_[factor].block<3, 3>(row, row);
  const Eigen::Index first = factors()[factor].row + row;
  block.noalias() -= BM_.middleRows<3>(first).lazyProduct(B().middleRows<3>(first).transpose());
  return block;
}

// With W = V^-1, N = A^T W A, E = W A: dW = -W dV W, dN = A^T dW A, and of D = W - E N^-1 E^T the
// block of the rows c, where the rows b of the same factor change,
//
//   dW_cc - H - H^T - E_c d(N^-1) E_c^T,    dW_cc = -W_cb dV W_bc,  H = -W_cb dV E_b N^-1 E_c^T.
std::vector<Eigen::Matrix3d> ReducedSystem::ProjectorDerivative(
    const std::vector<VarianceChange>& dV, const std::vector<VarianceChange>& wanted) const {
  const auto rows_of = [&](const VarianceChange& at) -> ThreeRows {
    return factors()[at.factor].weighted.middleRows<3>(at.row);
  };
  std::vector<Block> diagonal, coupling(tangent_sizes().empty() ? 0 : tangent_sizes().size() - 1);
  for (const int size : tangent_sizes()) diagonal.push_back(Block::Zero(size, size));
  for (std::size_t k = 0; k < coupling.size(); ++k) {
    coupling[k].setZero(chain().CovarianceWithNext(k).rows(), chain().CovarianceWithNext(k).cols());
  }
  std::vector<std::vector<const VarianceChange*>> of_factor(factors().size());
  for (const VarianceChange& at : dV) {
    of_factor[at.factor].push_back(&at);
    const Factor& factor = factors()[at.factor];
    if (factor.A.cols() == 0) continue;
    const ThreeRows E = rows_of(at);
    const ThreeRows changed = at.change.lazyProduct(E);
    AddPoseBlock(factor, PairBlock(-E.transpose().lazyProduct(changed)), &diagonal, &coupling);
  }
  std::vector<Block> own, with_next;
  chain().CovarianceDerivative(diagonal, coupling, &own, &with_next);
  std::vector<Eigen::Matrix3d> blocks;
  blocks.reserve(wanted.size());
  for (const VarianceChange& at : wanted) {
    const Factor& factor = factors()[at.factor];
    Eigen::Matrix3d& block = blocks.emplace_back(Eigen::Matrix3d::Zero());
    const ThreeRows E = rows_of(at);
    ThreeRows by_poses(3, E.cols());
    if (E.cols() > 0) {
      const ThreeRows changed = E.lazyProduct(PoseBlock(factor, own, with_next));
      block.noalias() -= changed.lazyProduct(E.transpose());
      by_poses.noalias() =
          E.lazyProduct(PoseBlock(factor, chain().covariances(), chain().covariances_with_next()));
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
