// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <ceres/cost_function.h>

#include "problem/increment_edge.h"
#include "problem/parameters.h"
#include "problem/pose_node.h"
#include "solve/shared_blocks.h"

namespace truetriad {

// One residual block a pose: all its triads and its attitude prior, whitened.
//
// Poses that share a block with others would forbid the Schur complement, many small blocks a pose
// would cost more than their arithmetic: one pose, one block. The node belongs to the
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

}  // namespace truetriad
