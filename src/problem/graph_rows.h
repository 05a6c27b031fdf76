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

// The whitening roots of RowsOf(node), in the same order.
std::vector<RowRoot> RootsOf(const PoseNode& node);

// All parameter blocks of a layout: triad by triad, then the reference block and the face tilts.
std::vector<SharedBlock> SharedBlocks(const SharedLayout& layout);

}  // namespace truetriad
