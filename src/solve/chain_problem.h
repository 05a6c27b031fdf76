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

// What is unknown about one pose of a chain.
struct ChainState {
  PoseKind kind = PoseKind::kRotation;
  PoseValues values{0.0, 0.0, 0.0, 1.0};
};

// A row with what it is weighted with, and the first state that it sees. Rows that see no state may
// have any.
struct ChainRow {
  std::shared_ptr<const Row> row;
  RowRoot root;
  std::size_t state = 0;
};

// A problem of shared parameters and a chain of states: rows see shared parameters and one state,
// or a state and the next.
struct ChainProblem {
  const SharedLayout* layout = nullptr;  // must outlive the problem
  std::vector<ChainState> states;
  std::vector<ChainRow> rows;  // by state; those that see two after those that see one
};

// The unknowns and rows of a graph. They refer to its layout and to its turns.
ChainProblem ChainOf(const PoseGraph& graph);
// The same, taking the nodes of the graph, whose rows hold all that they said: for a hundred
// thousand poses there is not both.
ChainProblem TakeChain(PoseGraph* graph);

}  // namespace truetriad
