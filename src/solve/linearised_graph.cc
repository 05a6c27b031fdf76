// SPDX-License-Identifier: Apache-2.0
#include "solve/linearised_graph.h"

#include <algorithm>
#include <utility>

namespace truetriad {
namespace {

// What is not zero of the basis of the free coordinates: hardly more than one entry a column.
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
  if (!factor.sees_next()) return blocks.own[k];
  PairBlock block(6, 6);
  block << blocks.own[k], blocks.with_next[k], blocks.with_next[k].transpose(), blocks.own[k + 1];
  return block;
}

void AddPoseBlock(const LinearisedGraph::Factor& factor,
                  const PairBlock& block,
                  ChainFactor::Blocks* blocks) {
  blocks->own[factor.node] += block.topLeftCorner<3, 3>();
  if (!factor.sees_next()) return;
  blocks->own[factor.node + 1] += block.bottomRightCorner<3, 3>();
  blocks->with_next[factor.node] += block.topRightCorner<3, 3>();
}

void LinearisedGraph::LineariseFactors(const PoseGraph& graph) {
  const SharedLayout& layout = graph.layout;
  const int n = layout.free_size();
  Eigen::Index rows = 3 * static_cast<Eigen::Index>(graph.increments.size());
  for (const PoseNode& node : graph.nodes) rows += node.row_count();
  columns_.resize(rows, n + 1);
  const std::vector<BasisEntry> basis = EntriesOf(layout.basis);
  factors_.resize(graph.nodes.size() + graph.increments.size());
  tangent_sizes_.clear();
  tangent_sizes_.reserve(graph.nodes.size());
  PoseSharedJacobian shared_jacobian;
  Eigen::Index row = 0;
  const auto take = [&](const auto& residual, Factor* factor) {
    factor->row = row;
    auto own = columns_.middleRows(row, factor->rows());
    own.setZero();
    for (const BasisEntry& entry : basis) {
      own.col(entry.column) += entry.value * shared_jacobian.col(entry.row);
    }
    own.col(n) = residual;
    row += factor->rows();
  };
  for (std::size_t k = 0; k < graph.nodes.size(); ++k) {
    const PoseNode& node = graph.nodes[k];
    Factor& factor = factors_[k];
    factor.node = k;
    PoseResidual12 residual;
    PoseStateJacobian by_state;
    node.Evaluate(
        layout, graph.shared.data(), node.state.data(), &residual, &shared_jacobian, &by_state);
    factor.A.setZero(by_state.rows(), 3);
    factor.A.leftCols(by_state.cols()) = by_state;
    tangent_sizes_.push_back(node.tangent_size());
    take(residual, &factor);
  }
  for (std::size_t i = 0; i < graph.increments.size(); ++i) {
    const IncrementEdge& edge = graph.increments[i];
    Factor& factor = factors_[graph.nodes.size() + i];
    factor.node = edge.from;
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
    factor.A.setZero(3, 6);
    const int first = graph.nodes[edge.from].tangent_size();
    const int second = graph.nodes[edge.from + 1].tangent_size();
    factor.A.leftCols(first) = by_first.leftCols(first);
    factor.A.middleCols(3, second) = by_second.leftCols(second);
    take(residual, &factor);
  }
}

void LinearisedGraph::Linearise(const PoseGraph& graph) {
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

// A^T V^-1 A from the factors' information.
void LinearisedGraph::FormChain() {
  ChainFactor::Blocks blocks = ChainFactor::Blocks::Zero(tangent_sizes_.size());
  for (const Factor& factor : factors_) {
    AddPoseBlock(factor, factor.A.transpose() * factor.weighted, &blocks);
  }
  chain_ = ChainFactor();
  chain_.Reserve(tangent_sizes_.size());
  for (std::size_t k = 0; k < tangent_sizes_.size(); ++k) {
    for (int i = tangent_sizes_[k]; i < 3; ++i) blocks.own[k](i, i) = 1.0;
    chain_.Append(blocks.own[k], blocks.with_next[k]);
  }
}

StackedRows LinearisedGraph::Project(const StackedRows& y) const {
  StackedRows projected;
  ProjectInto(y, &projected);
  return projected;
}

// With W = V^-1: W y - W A (A^T W A)^-1 A^T W y.
void LinearisedGraph::ProjectInto(const StackedRows& y, StackedRows* projected) const {
  projected->setZero(y.rows(), y.cols());
  StackedRows right = StackedRows::Zero(chain_.size(), y.cols());
  for (const Factor& factor : factors_) {
    const auto rows = y.middleRows(factor.row, factor.rows());
    AddBlockDiagonalProduct(
        factor.information, rows, projected->middleRows(factor.row, factor.rows()));
    AddProduct(
        1.0, factor.weighted.transpose(), rows, right.middleRows(PoseRow(factor), factor.A.cols()));
  }
  chain_.SolveInPlace(&right);
  for (const Factor& factor : factors_) {
    AddProduct(-1.0,
               factor.weighted,
               right.middleRows(PoseRow(factor), factor.A.cols()),
               projected->middleRows(factor.row, factor.rows()));
  }
}

void LinearisedGraph::Eliminate(const PoseGraph& graph) {
  const int n = size();
  for (std::size_t f = 0; f < factors_.size(); ++f) {
    Factor& factor = factors_[f];
    if (f < graph.nodes.size()) {
      factor.information = graph.nodes[f].Information();
    } else {
      factor.information = graph.increments[f - graph.nodes.size()].Information();
    }
    factor.weighted.resize(factor.A.rows(), factor.A.cols());
    constexpr Eigen::Index kBlock = 3;
    for (Eigen::Index row = 0; row < factor.rows(); row += kBlock) {
      const Eigen::Index rows = std::min(kBlock, factor.rows() - row);
      factor.weighted.middleRows(row, rows).noalias() =
          factor.information.block(row, row, rows, rows)
              .lazyProduct(factor.A.middleRows(row, rows));
    }
  }
  FormChain();
  ProjectInto(columns_, &projected_columns_);
  const Eigen::MatrixXd whole = SymmetricProduct(columns_, projected_columns_);
  matrix_ = prior_information_ + whole.topLeftCorner(n, n);
  gradient_ = prior_gradient_ + whole.topRightCorner(n, 1);
  cost_ = prior_cost_;
  for (const Factor& factor : factors_) {
    const auto r = residual_.segment(factor.row, factor.rows());
    cost_ += 0.5 * r.dot(factor.information.lazyProduct(r));
  }
}

// -(A^T W A)^-1 A^T W (r + J t).
Eigen::VectorXd LinearisedGraph::PoseSteps(const Eigen::VectorXd& shared_step) const {
  Eigen::VectorXd left = residual_;
  if (size() > 0) left += J() * shared_step;
  StackedRows steps = StackedRows::Zero(chain_.size(), 1);
  for (const Factor& factor : factors_) {
    steps.middleRows(PoseRow(factor), factor.A.cols()).noalias() -=
        factor.weighted.transpose() * left.segment(factor.row, factor.rows());
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
