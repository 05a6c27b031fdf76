// SPDX-License-Identifier: Apache-2.0
#include "support/pose_cost.h"

#include <algorithm>
#include <array>

#include "truetriad/math/rotation.h"

namespace truetriad {
namespace {

using RowMajorMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

using SharedVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxSharedSize, 1>;

// The shared vector from its blocks; what no block gives is zero.
SharedVector Gather(const SharedLayout& layout,
                    const std::vector<SharedBlock>& blocks,
                    double const* const* parameters) {
  SharedVector shared = SharedVector::Zero(layout.size);
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    std::copy_n(parameters[i], blocks[i].size, shared.data() + blocks[i].offset);
  }
  return shared;
}

// d = 2 vec(q0^-1 q): dd/dq = 2 [w I - [u]_x, -u] for q = (u, w).
Eigen::Matrix<double, 3, 4> TangentFromQuaternion(const double* state) {
  const Eigen::Map<const Eigen::Quaterniond> q(state);
  Eigen::Matrix<double, 3, 4> from_ambient;
  from_ambient << 2.0 * (q.w() * Eigen::Matrix3d::Identity() - Skew(q.vec())), -2.0 * q.vec();
  return from_ambient;
}

}  // namespace

PoseCost::PoseCost(const SharedLayout& layout, const PoseNode& node)
    : layout_(layout), node_(node), blocks_(SharedBlocks(layout)) {
  for (const SharedBlock& block : blocks_) mutable_parameter_block_sizes()->push_back(block.size);
  mutable_parameter_block_sizes()->push_back(node.state_size());
  set_num_residuals(node.row_count());
}

bool PoseCost::Evaluate(double const* const* parameters,
                        double* residuals,
                        double** jacobians) const {
  const SharedVector shared = Gather(layout_, blocks_, parameters);
  const double* state = parameters[blocks_.size()];
  PoseResidual12 residual;
  PoseSharedJacobian shared_jacobian;
  PoseStateJacobian tangent_jacobian;
  const bool wants_jacobians = jacobians != nullptr;
  node_.Evaluate(layout_,
                 shared.data(),
                 state,
                 &residual,
                 wants_jacobians ? &shared_jacobian : nullptr,
                 wants_jacobians ? &tangent_jacobian : nullptr);
  const PoseRowMatrix root = node_.SquareRootInformation();
  const int rows = node_.row_count();
  Eigen::Map<Eigen::VectorXd>(residuals, rows) = root * residual;
  if (!wants_jacobians) return true;

  for (std::size_t i = 0; i < blocks_.size(); ++i) {
    if (jacobians[i] == nullptr) continue;
    Eigen::Map<RowMajorMatrix>(jacobians[i], rows, blocks_[i].size) =
        root * shared_jacobian.middleCols(blocks_[i].offset, blocks_[i].size);
  }
  double* state_jacobian = jacobians[blocks_.size()];
  if (state_jacobian == nullptr) return true;
  Eigen::Map<RowMajorMatrix> out(state_jacobian, rows, node_.state_size());
  if (node_.kind == PoseKind::kDirection) {
    // Ambient derivative whose restriction to the tangent plane is ours.
    const Eigen::Map<const Eigen::Vector3d> direction(state);
    out = root * tangent_jacobian * TangentBasis(direction).transpose();
  } else if (node_.kind == PoseKind::kRotation) {
    out = root * tangent_jacobian * TangentFromQuaternion(state);
  } else {
    out.setZero();
  }
  return true;
}

IncrementCost::IncrementCost(const SharedLayout& layout, const IncrementEdge& edge)
    : layout_(layout), edge_(edge), blocks_(GyroscopeBlocks(layout)) {
  for (const SharedBlock& block : blocks_) mutable_parameter_block_sizes()->push_back(block.size);
  mutable_parameter_block_sizes()->push_back(4);
  mutable_parameter_block_sizes()->push_back(4);
  set_num_residuals(3);
}

bool IncrementCost::Evaluate(double const* const* parameters,
                             double* residuals,
                             double** jacobians) const {
  const SharedVector shared = Gather(layout_, blocks_, parameters);
  const std::size_t first = blocks_.size();
  Eigen::Vector3d residual;
  PoseSharedJacobian shared_jacobian;
  Eigen::Matrix3d by_first, by_second;
  const bool wants_jacobians = jacobians != nullptr;
  edge_.Evaluate(layout_,
                 shared.data(),
                 parameters[first],
                 parameters[first + 1],
                 &residual,
                 wants_jacobians ? &shared_jacobian : nullptr,
                 wants_jacobians ? &by_first : nullptr,
                 wants_jacobians ? &by_second : nullptr);
  // An asymmetry that nothing determines may run beyond 1, where no rate gives the readings.
  if (!residual.allFinite()) return false;
  const Eigen::Matrix3d root = edge_.SquareRootInformation();
  const Eigen::Vector3d whitened = root * residual;
  std::copy_n(whitened.data(), 3, residuals);
  if (!wants_jacobians) return true;
  for (std::size_t i = 0; i < blocks_.size(); ++i) {
    if (jacobians[i] == nullptr) continue;
    Eigen::Map<RowMajorMatrix>(jacobians[i], 3, blocks_[i].size) =
        root * shared_jacobian.middleCols(blocks_[i].offset, blocks_[i].size);
  }
  const std::array<Eigen::Matrix3d, 2> by_state = {by_first, by_second};
  for (std::size_t i = 0; i < by_state.size(); ++i) {
    if (jacobians[first + i] == nullptr) continue;
    Eigen::Map<RowMajorMatrix>(jacobians[first + i], 3, 4) =
        root * by_state[i] * TangentFromQuaternion(parameters[first + i]);
  }
  return true;
}

}  // namespace truetriad
