// SPDX-License-Identifier: Apache-2.0
#include "solve/linearised_graph.h"

#include <algorithm>

namespace truetriad {
namespace {

// A nonzero entry of the basis of the free coordinates; most columns have only one.
struct BasisEntry {
  Eigen::Index row = 0;
  Eigen::Index column = 0;
  double value = 0.0;
};

std::vector<BasisEntry> EntriesOf(const Eigen::MatrixXd& basis) {
  std::vector<BasisEntry> entries;
  for (Eigen::Index column = 0; column < basis.cols(); ++column) {
    for (Eigen::Index row = 0; row < basis.rows(); ++row) {
      if (basis(row, column) != 0.0) entries.push_back({row, column, basis(row, column)});
    }
  }
  return entries;
}

}  // namespace

PairBlock PoseBlock(const LinearisedGraph::Factor& factor, const ChainFactor::Blocks& blocks) {
  const std::size_t k = factor.node;
  if (!factor.sees_next) return blocks.own[k];
  PairBlock block(6, 6);
  const Eigen::Matrix3d with_next = blocks.WithNext(k);
  block << blocks.own[k], with_next, with_next.transpose(), blocks.own[k + 1];
  return block;
}

void AddPoseBlock(const LinearisedGraph::Factor& factor,
                  const PairBlock& block,
                  ChainFactor::Blocks* blocks) {
  blocks->own[factor.node] += block.topLeftCorner<3, 3>();
  if (!factor.sees_next) return;
  blocks->own[factor.node + 1] += block.bottomRightCorner<3, 3>();
  blocks->with_next[factor.node] += block.topRightCorner<3, 3>();
}

void LinearisedGraph::PlaceFactors(const PoseGraph& graph) {
  factors_.clear();
  factors_.reserve(graph.nodes.size() + graph.increments.size());
  tangent_sizes_.clear();
  tangent_sizes_.reserve(graph.nodes.size());
  Eigen::Index row = 0;
  for (std::size_t k = 0; k < graph.nodes.size(); ++k) {
    factors_.push_back({k, false, row, graph.nodes[k].row_count()});
    row += factors_.back().rows;
    tangent_sizes_.push_back(graph.nodes[k].tangent_size());
  }
  for (const IncrementEdge& edge : graph.increments) {
    factors_.push_back({edge.from, true, row, 3});
    row += factors_.back().rows;
  }
  columns_.resize(row, graph.layout.free_size() + 1);
  A_.setZero(row, graph.increments.empty() ? 3 : 6);
  weighted_.resize(A_.rows(), A_.cols());
  information_.setZero(row, 3);
}

void LinearisedGraph::LineariseFactors(const PoseGraph& graph) {
  const SharedLayout& layout = graph.layout;
  const int n = layout.free_size();
  const std::vector<BasisEntry> basis = EntriesOf(layout.basis);
  PoseSharedJacobian shared_jacobian;
  const auto take = [&](const Factor& factor, const auto& residual) {
    auto own = columns_.middleRows(factor.row, factor.rows);
    own.setZero();
    for (const BasisEntry& entry : basis) {
      own.col(entry.column) += entry.value * shared_jacobian.col(entry.row);
    }
    own.col(n) = residual;
  };
  const std::size_t nodes = graph.nodes.size();
  for (std::size_t k = 0; k < nodes; ++k) {
    const PoseNode& node = graph.nodes[k];
    PoseResidual12 residual;
    PoseStateJacobian by_state;
    node.Evaluate(
        layout, graph.shared.data(), node.state.data(), &residual, &shared_jacobian, &by_state);
    A_.block(factors_[k].row, 0, by_state.rows(), by_state.cols()) = by_state;
    take(factors_[k], residual);
  }
  for (std::size_t i = 0; i < graph.increments.size(); ++i) {
    const IncrementEdge& edge = graph.increments[i];
    const Factor& factor = factors_[nodes + i];
    Eigen::Vector3d residual;
    Eigen::Matrix3d by_first, by_second;
    edge.Evaluate(layout,
                  graph.shared.data(),
                  graph.nodes[edge.from].state.data(),
                  graph.nodes[edge.from + 1].state.data(),
                  &residual,
                  &shared_jacobian,
                  &by_first,
                  &by_second);
    const int first = graph.nodes[edge.from].tangent_size();
    const int second = graph.nodes[edge.from + 1].tangent_size();
    A_.block(factor.row, 0, 3, first) = by_first.leftCols(first);
    A_.block(factor.row, 3, 3, second) = by_second.leftCols(second);
    take(factor, residual);
  }
}

void LinearisedGraph::Linearise(const PoseGraph& graph) {
  PlaceFactors(graph);
  LineariseFactors(graph);
  const SharedLayout& layout = graph.layout;
  const int n = layout.free_size();
  residual_ = columns_.col(n);
  prior_information_ = Eigen::MatrixXd::Zero(n, n);
  prior_gradient_ = Eigen::VectorXd::Zero(n);
  prior_cost_ = 0.0;
  for (const ScalarPrior& prior : graph.priors) {
    const Eigen::RowVectorXd direction = layout.basis.row(prior.index) / prior.sigma;
    prior_information_ += direction.transpose() * direction;
    const double off = (graph.shared[prior.index] - prior.mean) / prior.sigma;
    prior_gradient_ += direction.transpose() * off;
    prior_cost_ += 0.5 * off * off;
  }
  Eliminate(graph);
}

// Forms A^T V^-1 A from the blocks of the factors.
void LinearisedGraph::FormChain() {
  ChainFactor::Blocks blocks = ChainFactor::Blocks::Zero(tangent_sizes_.size(), sees_pairs());
  for (const Factor& factor : factors_) {
    AddPoseBlock(factor, A(factor).transpose().lazyProduct(Weighted(factor)), &blocks);
  }
  chain_ = ChainFactor();
  chain_.Reserve(tangent_sizes_.size());
  for (std::size_t k = 0; k < tangent_sizes_.size(); ++k) {
    for (int i = tangent_sizes_[k]; i < 3; ++i) blocks.own[k](i, i) = 1.0;
    chain_.Append(blocks.own[k], blocks.WithNext(k));
  }
}

// Replaces y by D y = W y - W A (A^T W A)^-1 A^T W y, with W = V^-1.
void LinearisedGraph::ProjectInPlace(StackedRows* y) const {
  StackedRows right = StackedRows::Zero(chain_.size(), y->cols());
  StackedRows three;
  for (const Factor& factor : factors_) {
    auto own = y->middleRows(factor.row, factor.rows);
    AddProduct(1.0,
               Weighted(factor).transpose(),
               own,
               right.middleRows(PoseRow(factor), factor.tangents()));
    for (Eigen::Index row = 0; row < factor.rows; row += 3) {
      const auto information = Information(factor, row);
      three = own.middleRows(row, information.rows());
      own.middleRows(row, information.rows()).setZero();
      AddProduct(1.0, information, three, own.middleRows(row, information.rows()));
    }
  }
  chain_.SolveInPlace(&right);
  for (const Factor& factor : factors_) {
    AddProduct(-1.0,
               Weighted(factor),
               right.middleRows(PoseRow(factor), factor.tangents()),
               y->middleRows(factor.row, factor.rows));
  }
}

// Computes V^-1 and V^-1 A with the graph's present variances and weights.
void LinearisedGraph::Weight(const PoseGraph& graph) {
  const auto take = [&](const Factor& factor, const auto& information) {
    for (Eigen::Index row = 0; row < factor.rows; row += 3) {
      const Eigen::Index rows = std::min<Eigen::Index>(3, factor.rows - row);
      const auto block = information.block(row, row, rows, rows);
      const Eigen::Index at = factor.row + row;
      information_.block(at, 0, rows, rows) = block;
      weighted_.block(at, 0, rows, factor.tangents()).noalias() =
          block.lazyProduct(A_.block(at, 0, rows, factor.tangents()));
    }
  };
  const std::size_t nodes = graph.nodes.size();
  for (std::size_t k = 0; k < nodes; ++k) take(factors_[k], graph.nodes[k].Information());
  for (std::size_t i = 0; i < graph.increments.size(); ++i) {
    take(factors_[nodes + i], graph.increments[i].Information());
  }
}

void LinearisedGraph::Eliminate(const PoseGraph& graph) {
  const int n = size();
  Weight(graph);
  FormChain();
  projected_columns_ = columns_;
  ProjectInPlace(&projected_columns_);
  const Eigen::MatrixXd whole = SymmetricProduct(columns_, projected_columns_);
  matrix_ = prior_information_ + whole.topLeftCorner(n, n);
  gradient_ = prior_gradient_ + whole.topRightCorner(n, 1);
  cost_ = prior_cost_;
  for (const Factor& factor : factors_) {
    for (Eigen::Index row = 0; row < factor.rows; row += 3) {
      const auto information = Information(factor, row);
      const auto r = residual_.segment(factor.row + row, information.rows());
      cost_ += 0.5 * r.dot(information.lazyProduct(r));
    }
  }
}

// The steps are -(A^T W A)^-1 A^T W (r + J t), with W = V^-1 and the shared step t.
Eigen::VectorXd LinearisedGraph::PoseSteps(const Eigen::VectorXd& shared_step) const {
  Eigen::VectorXd left = residual_;
  if (size() > 0) left += J() * shared_step;
  StackedRows steps = StackedRows::Zero(chain_.size(), 1);
  for (const Factor& factor : factors_) {
    steps.middleRows(PoseRow(factor), factor.tangents()).noalias() -=
        Weighted(factor).transpose().lazyProduct(left.segment(factor.row, factor.rows));
  }
  chain_.SolveInPlace(&steps);
  return steps.col(0);
}

void LinearisedGraph::TakeStep(const Eigen::VectorXd& shared_step, PoseGraph* graph) const {
  const Eigen::VectorXd pose_steps = PoseSteps(shared_step);
  for (std::size_t k = 0; k < graph->nodes.size(); ++k) {
    PoseNode& node = graph->nodes[k];
    node.Step(pose_steps.segment<3>(3 * static_cast<Eigen::Index>(k)));
  }
  graph->shared += graph->layout.basis * shared_step;
}

}  // namespace truetriad
