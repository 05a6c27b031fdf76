// SPDX-License-Identifier: Apache-2.0
#include "solve/chain_problem.h"

#include <utility>

#include "problem/graph_rows.h"

namespace truetriad {

ChainProblem ChainOf(const PoseGraph& graph) {
  ChainProblem problem;
  problem.layout = &graph.layout;
  problem.states.reserve(graph.nodes.size());
  problem.rows.reserve(graph.nodes.size() + graph.increments.size() + graph.priors.size());
  auto edge = graph.increments.begin();
  for (std::size_t k = 0; k < graph.nodes.size(); ++k) {
    const PoseNode& node = graph.nodes[k];
    problem.states.push_back({node.kind, node.state});
    std::vector<std::unique_ptr<Row>> rows = RowsOf(node, graph.layout);
    const std::vector<RowRoot> roots = RootsOf(node);
    for (std::size_t i = 0; i < rows.size(); ++i) {
      problem.rows.push_back({std::move(rows[i]), roots[i], k});
    }
    for (; edge != graph.increments.end() && edge->from == k; ++edge) {
      problem.rows.push_back({RowOf(*edge, graph.layout), edge->SquareRootInformation(), k});
    }
  }
  for (const ScalarPrior& prior : graph.priors) {
    const RowRoot root = RowRoot::Constant(1, 1, 1.0 / prior.sigma);
    problem.rows.push_back({RowOf(prior, graph.layout), root, graph.nodes.size()});
  }
  return problem;
}

}  // namespace truetriad
