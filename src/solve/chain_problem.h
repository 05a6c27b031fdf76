// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "problem/graph.h"
#include "problem/pose_state.h"
#include "problem/rows/row.h"
#include "problem/rows/whitened_row.h"

namespace truetriad {

// The unknown attitude of one pose of a chain.
struct ChainState {
  PoseKind kind = PoseKind::kRotation;
  PoseValues values{0.0, 0.0, 0.0, 1.0};
};

// A row with its whitening root, and the first state on which it depends. If the row depends on no
// state, `state` is any number that keeps the rows sorted.
struct ChainRow {
  std::shared_ptr<const Row> row;
  RowRoot root;
  std::size_t state = 0;
};

// A problem of shared parameters and a chain of states. Besides shared parameters, a row depends on
// no state, on one state, or on one state and its successor.
struct ChainProblem {
  const SharedLayout* layout = nullptr;  // must outlive the problem
  std::vector<ChainState> states;
  std::vector<ChainRow> rows;  // sorted by first state; of one state, rows of two states come last
};

// The unknowns and rows of a graph, whose layout and turns must outlive the result.
ChainProblem ChainOf(const PoseGraph& graph);
// Like ChainOf, but frees each node of the graph as soon as its rows are made. The nodes, of which
// there may be 100 000, and their rows thus need not be in memory together.
ChainProblem TakeChain(PoseGraph* graph);

}  // namespace truetriad
