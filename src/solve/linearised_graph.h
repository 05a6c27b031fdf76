// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "problem/graph.h"
#include "solve/chain_factor.h"
#include "solve/row_products.h"

namespace truetriad {

// The graph linearised at its current state, with the poses eliminated by a Schur complement.
//
// A factor has rows r + J t + A p with covariance V: t are the free shared coordinates, and p the
// tangent spaces of the factor's pose, or of its two neighbouring poses. Eliminating the poses
// projects the rows of all factors,
//
//   D = V^-1 - V^-1 A (A^T V^-1 A)^-1 A^T V^-1
//
// so that the reduced information is M = prior + J^T D J. Of V and D, only the blocks of single
// factors are formed, and A^T V^-1 A is block tridiagonal (chain_factor.h): time and memory are
// linear in the number of poses. ChainElimination solves a graph; this class keeps all rows for
// later tests.
class LinearisedGraph {
 public:
  struct Factor {
    std::size_t node = 0;  // the factor's pose, or the first of its two poses
    bool sees_next = false;
    Eigen::Index row = 0;  // index of its first row among those of all factors
    Eigen::Index rows = 0;

    // Number of columns of A: three, or six if the factor also depends on the next pose.
    Eigen::Index tangents() const { return sees_next ? 6 : 3; }
  };

  // Linearises all factors: first those of the poses, then the increments, each in the order of the
  // graph.
  explicit LinearisedGraph(const PoseGraph& graph) { Linearise(graph); }

  // Linearises again, reusing the memory.
  void Linearise(const PoseGraph& graph);

  // Eliminates the poses with the graph's present variances and weights. This takes little time
  // compared with the constructor, and may be called again after the variances changed.
  void Eliminate(const PoseGraph& graph);

  const std::vector<Factor>& factors() const { return factors_; }
  int size() const { return static_cast<int>(columns_.cols()) - 1; }

  // For the rows of all factors: residual() is r, J() is J, and B() is D J.
  const Eigen::VectorXd& residual() const { return residual_; }
  auto J() const { return columns_.leftCols(size()); }
  auto B() const { return projected_columns_.leftCols(size()); }

  // cost(): half the sum of squares at the present state, priors included. gradient(): the gradient
  // of the cost after the poses are optimised. matrix(): the reduced information M.
  double cost() const { return cost_; }
  const Eigen::VectorXd& gradient() const { return gradient_; }
  const Eigen::MatrixXd& matrix() const { return matrix_; }

  // The optimal steps of all poses if the shared coordinates take the step `shared_step`. The
  // vector has the steps of one pose after another.
  Eigen::VectorXd PoseSteps(const Eigen::VectorXd& shared_step) const;

  // Moves `graph`, which must be the linearised one, by a step of the free shared coordinates and
  // the optimal step of its poses.
  void TakeStep(const Eigen::VectorXd& shared_step, PoseGraph* graph) const;

  // The product D y; y may have any number of columns.
  StackedRows Project(StackedRows y) const {
    ProjectInPlace(&y);
    return y;
  }

 protected:
  static Eigen::Index PoseRow(const Factor& factor) {
    return 3 * static_cast<Eigen::Index>(factor.node);
  }
  // A factor's blocks of A and of V^-1 A.
  auto A(const Factor& factor) const {
    return A_.block(factor.row, 0, factor.rows, factor.tangents());
  }
  auto Weighted(const Factor& factor) const {
    return weighted_.block(factor.row, 0, factor.rows, factor.tangents());
  }
  // The block of V^-1 for up to three rows of a factor, beginning with `row`, a multiple of three.
  // V^-1 is zero outside of these blocks.
  auto Information(const Factor& factor, Eigen::Index row) const {
    const Eigen::Index rows = std::min<Eigen::Index>(3, factor.rows - row);
    return information_.block(factor.row + row, 0, rows, rows);
  }
  // Whether there are factors of two poses.
  bool sees_pairs() const { return A_.cols() > 3; }
  const ChainFactor& chain() const { return chain_; }
  const StackedRows& projected_columns() const { return projected_columns_; }

 private:
  void PlaceFactors(const PoseGraph& graph);
  void LineariseFactors(const PoseGraph& graph);
  void Weight(const PoseGraph& graph);
  void FormChain();
  void ProjectInPlace(StackedRows* y) const;

  std::vector<Factor> factors_;
  StackedRows A_, weighted_;       // three columns, or six if a factor depends on two poses
  StackedRows information_;        // V^-1, its three by three blocks one below the other
  StackedRows columns_;            // J, r
  StackedRows projected_columns_;  // D J, D r
  Eigen::VectorXd residual_;
  std::vector<int> tangent_sizes_;
  ChainFactor chain_;
  Eigen::MatrixXd prior_information_;
  Eigen::VectorXd prior_gradient_;
  double prior_cost_ = 0.0;
  Eigen::MatrixXd matrix_;
  Eigen::VectorXd gradient_;
  double cost_ = 0.0;
};

// The block of a symmetric matrix for the one or two poses of a factor, assembled from the blocks
// of single poses and of neighbours.
using PairBlock = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 6, 6>;
PairBlock PoseBlock(const LinearisedGraph::Factor& factor, const ChainFactor::Blocks& blocks);

// Adds a factor's block to the blocks of its poses.
void AddPoseBlock(const LinearisedGraph::Factor& factor,
                  const PairBlock& block,
                  ChainFactor::Blocks* blocks);

}  // namespace truetriad
