// SPDX-License-Identifier: Apache-2.0
#include "solve/chain_problem.h"

#include <utility>

#include "problem/graph_rows.h"

namespace truetriad {
namespace {

// `done` is called with each node after its rows are made.
template <typename Done>
ChainProblem MakeChain(const PoseGraph& graph, const Done& done) {
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
    done(k);
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

}  // namespace

ChainProblem ChainOf(const PoseGraph& graph) {
  return MakeChain(graph, [](std::size_t) {});
}

ChainProblem TakeChain(PoseGraph* graph) {
  ChainProblem problem = MakeChain(*graph, [&](std::size_t k) {
    std::vector<Observation>().swap(graph->nodes[k].observations);
  });
  std::vector<PoseNode>().swap(graph->nodes);
  return problem;
}

}  // namespace truetriad
