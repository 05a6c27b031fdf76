// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "problem/graph.h"
#include "problem/rows/row.h"
#include "problem/rows/whitened_row.h"

namespace truetriad {

// The rows of one pose, in the order that PoseNode states.
std::vector<std::unique_ptr<Row>> RowsOf(const PoseNode& node, const SharedLayout& layout);

// The row of a turn; `edge` must outlive it.
std::unique_ptr<Row> RowOf(const IncrementEdge& edge, const SharedLayout& layout);

// The row of a prior.
std::unique_ptr<Row> RowOf(const ScalarPrior& prior, const SharedLayout& layout);

// The lower triangular W for which W^T W is the inverse of variance / weight.
RowRoot RootOf(const Eigen::Matrix3d& variance, double weight);

// The whitening root of each of RowsOf(node).
std::vector<RowRoot> RootsOf(const PoseNode& node);

// The blocks of a layout that are parameters of the graph, in the model's order.
std::vector<SharedBlock> SharedBlocks(const SharedLayout& layout);

}  // namespace truetriad
