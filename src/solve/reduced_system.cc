// SPDX-License-Identifier: Apache-2.0
#include "solve/reduced_system.h"

namespace truetriad {
namespace {

using ThreeRows = Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, 6>;

}  // namespace

ReducedSystem::ReducedSystem(const PoseGraph& graph) : LinearisedGraph(graph) { Complete(graph); }

void ReducedSystem::Linearise(const PoseGraph& graph) {
  LinearisedGraph::Linearise(graph);
  Complete(graph);
}

void ReducedSystem::Eliminate(const PoseGraph& graph) {
  LinearisedGraph::Eliminate(graph);
  Complete(graph);
}

void ReducedSystem::Complete(const PoseGraph& graph) {
  pose_covariance_ = chain().Inverse();
  D_.resize(factors().size());
  for (std::size_t f = 0; f < D_.size(); ++f) {
    const Factor& factor = factors()[f];
    D_[f] = factor.information;
    const PoseColumns half = factor.weighted.lazyProduct(PoseBlock(factor, pose_covariance_));
    D_[f].noalias() -= half.lazyProduct(factor.weighted.transpose());
  }
  shared_ = SharedInformation(graph.layout, graph.shared, matrix(), gradient());
  projected_ = projected_columns().col(size());
  if (size() > 0) projected_ += B() * step();
  BM_ = {};  // before there is another
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
  ChainFactor::Blocks changes = ChainFactor::Blocks::Zero(chain().states());
  std::vector<std::vector<const VarianceChange*>> of_factor(factors().size());
  for (const VarianceChange& at : dV) {
    of_factor[at.factor].push_back(&at);
    const Factor& factor = factors()[at.factor];
    const ThreeRows E = rows_of(at);
    const ThreeRows changed = at.change.lazyProduct(E);
    AddPoseBlock(factor, PairBlock(-E.transpose().lazyProduct(changed)), &changes);
  }
  const ChainFactor::Blocks derivative = chain().InverseDerivative(pose_covariance_, changes);
  std::vector<Eigen::Matrix3d> blocks;
  blocks.reserve(wanted.size());
  for (const VarianceChange& at : wanted) {
    const Factor& factor = factors()[at.factor];
    Eigen::Matrix3d& block = blocks.emplace_back(Eigen::Matrix3d::Zero());
    const ThreeRows E = rows_of(at);
    const ThreeRows changed = E.lazyProduct(PoseBlock(factor, derivative));
    block.noalias() -= changed.lazyProduct(E.transpose());
    const ThreeRows by_poses = E.lazyProduct(PoseBlock(factor, pose_covariance_));
    for (const VarianceChange* const cause : of_factor[at.factor]) {
      const Eigen::Matrix3d W = factor.information.block<3, 3>(at.row, cause->row);
      const Eigen::Matrix3d weighted = W * cause->change;
      block.noalias() -= weighted * W.transpose();
      const Eigen::Matrix3d half = weighted * rows_of(*cause).lazyProduct(by_poses.transpose());
      block += half + half.transpose();
    }
  }
  return blocks;
}

}  // namespace truetriad
