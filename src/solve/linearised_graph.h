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

// The graph linearised at its current state, with the poses eliminated by our own Schur complement.
//
// A factor has rows r + J t + A p (t: free shared coordinates, p: the tangent spaces of the poses
// that it sees, one, or two neighbours) with covariance V. Eliminating the poses projects the rows
// of all factors,
//
//   D = V^-1 - V^-1 A (A^T V^-1 A)^-1 A^T V^-1
//
// so that the reduced information is M = prior + J^T D J. Only the blocks of one factor are ever
// formed: A^T V^-1 A is block tridiagonal (chain_factor.h), and everything is linear in the number
// of poses. ChainElimination solves; this keeps all rows, for what is to be said about them.
class LinearisedGraph {
 public:
  struct Factor {
    std::size_t node = 0;  // the pose that it sees, or the first of the two
    bool sees_next = false;
    Eigen::Index row = 0;  // where its rows begin among those of all factors
    Eigen::Index rows = 0;

    // Columns of its pose, and of the next where that is seen.
    Eigen::Index tangents() const { return sees_next ? 6 : 3; }
  };

  // Linearises all factors: those of the poses in their order, then the increments in theirs.
  explicit LinearisedGraph(const PoseGraph& graph) { Linearise(graph); }

  // The same anew, in the memory that it has.
  void Linearise(const PoseGraph& graph);

  // Eliminates with the variances and weights the graph has now. Cheap against the constructor; may
  // be called again after the variances changed.
  void Eliminate(const PoseGraph& graph);

  const std::vector<Factor>& factors() const { return factors_; }
  int size() const { return static_cast<int>(columns_.cols()) - 1; }

  // Rows of all factors: residuals r, J, B = D J.
  const Eigen::VectorXd& residual() const { return residual_; }
  auto J() const { return columns_.leftCols(size()); }
  auto B() const { return projected_columns_.leftCols(size()); }

  // Half the sum of squares where it stands, priors included; its gradient with the poses at their
  // best, and M.
  double cost() const { return cost_; }
  const Eigen::VectorXd& gradient() const { return gradient_; }
  const Eigen::MatrixXd& matrix() const { return matrix_; }

  // The best step of all poses that goes with a step of the shared coordinates, tangent space after
  // tangent space.
  Eigen::VectorXd PoseSteps(const Eigen::VectorXd& shared_step) const;

  // Moves `graph`, which this was made of, by a step of the free shared coordinates and the best
  // step of its poses.
  void TakeStep(const Eigen::VectorXd& shared_step, PoseGraph* graph) const;

  // D y, for any number of columns.
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
  // Of V^-1 what couples three of a factor's rows, or as many as are left; `row` is that of the
  // first, a multiple of three. Nothing couples these with others.
  auto Information(const Factor& factor, Eigen::Index row) const {
    const Eigen::Index rows = std::min<Eigen::Index>(3, factor.rows - row);
    return information_.block(factor.row + row, 0, rows, rows);
  }
  // Whether factors see two poses.
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
  StackedRows A_, weighted_;       // three columns, six where factors see two poses
  StackedRows information_;        // V^-1, three rows and three columns after each other
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

// The block of a symmetric matrix that belongs to the poses a factor sees, from its own blocks.
using PairBlock = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 6, 6>;
PairBlock PoseBlock(const LinearisedGraph::Factor& factor, const ChainFactor::Blocks& blocks);

// Adds a factor's block to where its poses stand.
void AddPoseBlock(const LinearisedGraph::Factor& factor,
                  const PairBlock& block,
                  ChainFactor::Blocks* blocks);

}  // namespace truetriad
