// SPDX-License-Identifier: Apache-2.0
#include "solve/reduced_system.h"

#include <algorithm>

#include "math/dense/products.h"

namespace truetriad {
namespace {

using PoseColumns = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxPoseRows, 6>;
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
  Eigen::Index most = 0;
  for (const Factor& factor : factors()) most = std::max(most, factor.rows);
  D_.setZero(residual().size(), most);
  for (const Factor& factor : factors()) {
    auto own = D_.block(factor.row, 0, factor.rows, factor.rows);
    for (Eigen::Index row = 0; row < factor.rows; row += 3) {
      const auto information = Information(factor, row);
      own.block(row, row, information.rows(), information.cols()) = information;
    }
    const PoseColumns half = Weighted(factor).lazyProduct(PoseBlock(factor, pose_covariance_));
    own.noalias() -= half.lazyProduct(Weighted(factor).transpose());
  }
  shared_ = SharedInformation(graph.layout, graph.shared, matrix(), gradient());
  projected_ = projected_columns().col(size());
  if (size() > 0) projected_ += B() * step();
  ProductOfRows(projected_columns(), covariance(), &BM_);
}

StackedRows ReducedSystem::Projected(const StackedRows& y) const {
  StackedRows Py = Project(y);
  if (size() > 0) Py -= ProductOfRows(BM(), StackedRows(TransposeTimesRows(B(), y)));
  return Py;
}

Eigen::Matrix3d ReducedSystem::ProjectorBlock(std::size_t factor, Eigen::Index row) const {
  const Eigen::Index first = factors()[factor].row + row;
  Eigen::Matrix3d block = D_.block<3, 3>(first, row);
  block.noalias() -= BM_.middleRows<3>(first).lazyProduct(B().middleRows<3>(first).transpose());
  return block;
}

// Let W = V^-1, N = A^T W A and E = W A, so that D = W - E N^-1 E^T, dW = -W dV W and dN = A^T dW
// A. W is block diagonal. If the variance of the rows c changes by dV_c, the block of dD for these
// rows is
//
//   dW_c - H - H^T - E_c d(N^-1) E_c^T,    dW_c = -W_c dV_c W_c,  H = -W_c dV_c E_c N^-1 E_c^T.
std::vector<Eigen::Matrix3d> ReducedSystem::ProjectorDerivative(
    const std::vector<VarianceChange>& dV, const std::vector<VarianceChange>& wanted) const {
  const auto row_of = [&](const VarianceChange& at) { return factors()[at.factor].row + at.row; };
  const auto rows_of = [&](const VarianceChange& at) -> ThreeRows {
    return Weighted(factors()[at.factor]).middleRows<3>(at.row);
  };
  ChainFactor::Blocks changes = ChainFactor::Blocks::Zero(chain().states(), sees_pairs());
  std::vector<const VarianceChange*> of_row(static_cast<std::size_t>(residual().size()));
  for (const VarianceChange& at : dV) {
    of_row[static_cast<std::size_t>(row_of(at))] = &at;
    const ThreeRows E = rows_of(at);
    const ThreeRows changed = at.change.lazyProduct(E);
    AddPoseBlock(factors()[at.factor], PairBlock(-E.transpose().lazyProduct(changed)), &changes);
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
    const VarianceChange* const own = of_row[static_cast<std::size_t>(row_of(at))];
    if (own == nullptr) continue;
    const Eigen::Matrix3d W = Information(factor, at.row);
    const Eigen::Matrix3d weighted = W * own->change;
    block.noalias() -= weighted * W.transpose();
    const ThreeRows by_poses = E.lazyProduct(PoseBlock(factor, pose_covariance_));
    const Eigen::Matrix3d half = weighted * E.lazyProduct(by_poses.transpose());
    block += half + half.transpose();
  }
  return blocks;
}

}  // namespace truetriad
