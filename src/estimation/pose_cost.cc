// SPDX-License-Identifier: Apache-2.0
#include "estimation/pose_cost.h"

#include <algorithm>

namespace truetriad {
namespace {

using RowMajorMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

}  // namespace

std::vector<SharedBlock> SharedBlocks(const SharedLayout& layout) {
  std::vector<SharedBlock> blocks;
  for (const Triad triad : kTriads) {
    if (!layout.Has(triad)) continue;
    blocks.push_back({layout.bias[triad], 3});
    blocks.push_back({layout.sensitivity[triad], 9});
    const ThermalBlock& thermal = layout.thermal[triad];
    if (thermal.size() > 0) blocks.push_back({thermal.at, thermal.size()});
  }
  blocks.push_back({layout.reference, kReferenceSize});
  for (const int tilt : layout.face_tilt) {
    if (tilt >= 0) blocks.push_back({tilt, 2});
  }
  return blocks;
}

PoseCost::PoseCost(const SharedLayout& layout, const PoseNode& node)
    : layout_(layout), node_(node), blocks_(SharedBlocks(layout)) {
  for (const SharedBlock& block : blocks_) mutable_parameter_block_sizes()->push_back(block.size);
  mutable_parameter_block_sizes()->push_back(node.state_size());
  set_num_residuals(node.row_count());
}

bool PoseCost::Evaluate(double const* const* parameters,
                        double* residuals,
                        double** jacobians) const {
  Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxSharedSize, 1> shared(layout_.size);
  for (std::size_t i = 0; i < blocks_.size(); ++i) {
    std::copy_n(parameters[i], blocks_[i].size, shared.data() + blocks_[i].offset);
  }
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
    // d = 2 vec(q0^-1 q): dd/dq = 2 [w I - [u]_x, -u] for q = (u, w).
    const Eigen::Map<const Eigen::Quaterniond> q(state);
    Eigen::Matrix<double, 3, 4> from_ambient;
    from_ambient << 2.0 * (q.w() * Eigen::Matrix3d::Identity() - Skew(q.vec())), -2.0 * q.vec();
    out = root * tangent_jacobian * from_ambient;
  } else {
    out.setZero();
  }
  return true;
}

bool LinearManifold::Plus(const double* x, const double* delta, double* x_plus_delta) const {
  Eigen::Map<Eigen::VectorXd>(x_plus_delta, basis_.rows()) =
      Eigen::Map<const Eigen::VectorXd>(x, basis_.rows()) +
      basis_ * Eigen::Map<const Eigen::VectorXd>(delta, basis_.cols());
  return true;
}

bool LinearManifold::PlusJacobian(const double* /*x*/, double* jacobian) const {
  Eigen::Map<RowMajorMatrix>(jacobian, basis_.rows(), basis_.cols()) = basis_;
  return true;
}

bool LinearManifold::Minus(const double* y, const double* x, double* y_minus_x) const {
  Eigen::Map<Eigen::VectorXd>(y_minus_x, basis_.cols()) =
      basis_.transpose() * (Eigen::Map<const Eigen::VectorXd>(y, basis_.rows()) -
                            Eigen::Map<const Eigen::VectorXd>(x, basis_.rows()));
  return true;
}

bool LinearManifold::MinusJacobian(const double* /*x*/, double* jacobian) const {
  Eigen::Map<RowMajorMatrix>(jacobian, basis_.cols(), basis_.rows()) = basis_.transpose();
  return true;
}

}  // namespace truetriad
