// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <ceres/cost_function.h>
#include <ceres/manifold.h>

#include "estimation/increment_edge.h"
#include "estimation/parameters.h"
#include "estimation/pose_node.h"

namespace truetriad {

// A block of the shared vector as Ceres sees it.
struct SharedBlock {
  int offset = 0;
  int size = 0;
};

// The blocks of a layout that are parameters of the graph, in the model's order.
std::vector<SharedBlock> SharedBlocks(const SharedLayout& layout);
// Those that turns depend on: the gyroscope's.
std::vector<SharedBlock> GyroscopeBlocks(const SharedLayout& layout);

// One residual block a pose: all its triads and its attitude prior, whitened.
//
// Poses that share a block with others would forbid the Schur complement, many small blocks a pose
// would cost more than their arithmetic: one pose, one block (model.md §2). The node belongs to the
// caller, must outlive the cost, and holds the weights, which may change between solves.
// Parameters: the shared blocks, then the pose's state.
class PoseCost final : public ceres::CostFunction {
 public:
  PoseCost(const SharedLayout& layout, const PoseNode& node);
  bool Evaluate(double const* const* parameters,
                double* residuals,
                double** jacobians) const override;

 private:
  const SharedLayout& layout_;
  const PoseNode& node_;
  std::vector<SharedBlock> blocks_;
};

// One residual block a turn between two poses, whitened. As PoseCost; parameters: the shared
// blocks, then the states of both poses.
class IncrementCost final : public ceres::CostFunction {
 public:
  IncrementCost(const SharedLayout& layout, const IncrementEdge& edge);
  bool Evaluate(double const* const* parameters,
                double* residuals,
                double** jacobians) const override;

 private:
  const SharedLayout& layout_;
  const IncrementEdge& edge_;
  std::vector<SharedBlock> blocks_;
};

// Parameters that move in a linear subspace: x + basis * delta. Held entries are rows of zeros,
// tied entries share a column.
class LinearManifold final : public ceres::Manifold {
 public:
  // Columns of `basis` are orthonormal.
  explicit LinearManifold(Eigen::MatrixXd basis) : basis_(std::move(basis)) {}
  int AmbientSize() const override { return static_cast<int>(basis_.rows()); }
  int TangentSize() const override { return static_cast<int>(basis_.cols()); }
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override;
  bool PlusJacobian(const double* x, double* jacobian) const override;
  bool Minus(const double* y, const double* x, double* y_minus_x) const override;
  bool MinusJacobian(const double* x, double* jacobian) const override;

 private:
  Eigen::MatrixXd basis_;
};

}  // namespace truetriad
