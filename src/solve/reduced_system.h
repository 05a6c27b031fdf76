// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

#include "problem/graph.h"
#include "solve/linearised_graph.h"
#include "solve/shared_information.h"

namespace truetriad {

// The linearised graph with the covariance of its free shared coordinates. Unlike
// ceres::Covariance, it also has projected residuals, for variance components, and accepts
// rank-deficient systems. The projector of the whole system is P = V^-1 - V^-1 H (H^T V^-1 H)^-1
// H^T V^-1, with all columns H. It is computed as
//
//   P = D - D J M^-1 J^T D        P r = D (r + J step).
class ReducedSystem : public LinearisedGraph {
 public:
  // Three rows of a factor with a common variance, and the change of that variance.
  struct VarianceChange {
    std::size_t factor = 0;
    Eigen::Index row = 0;  // index of the first of the three among the factor's rows
    Eigen::Matrix3d change = Eigen::Matrix3d::Zero();
  };

  explicit ReducedSystem(const PoseGraph& graph);

  // Both do the same as in LinearisedGraph, and also update the members of this class.
  void Linearise(const PoseGraph& graph);
  void Eliminate(const PoseGraph& graph);

  // BM() is B M^-1, and projected() are the residuals P r, both for the rows of all factors.
  const StackedRows& BM() const { return BM_; }
  const Eigen::VectorXd& projected() const { return projected_; }
  // P y, for any number of columns.
  StackedRows Projected(const StackedRows& y) const;

  // The information M, with its covariance, rank and step.
  const SharedInformation& shared() const { return shared_; }
  const Eigen::MatrixXd& information() const { return shared_.matrix(); }
  const Eigen::MatrixXd& covariance() const { return shared_.covariance(); }
  const Eigen::VectorXd& scale() const { return shared_.scale(); }
  int rank() const { return shared_.rank(); }
  const Eigen::VectorXd& step() const { return shared_.step(); }

  // D(): the diagonal block of D for all rows of a factor. ProjectorBlock(): the diagonal block of
  // P for three rows of a factor, from `row` on.
  auto D(std::size_t factor) const {
    const Eigen::Index rows = factors()[factor].rows;
    return D_.block(factors()[factor].row, 0, rows, rows);
  }
  Eigen::Matrix3d ProjectorBlock(std::size_t factor, Eigen::Index row = 0) const;

  // The diagonal blocks of dD = -D dV D for the rows of each of `wanted`; the member `change` of
  // `wanted` is not used. `dV` must not list a row twice.
  std::vector<Eigen::Matrix3d> ProjectorDerivative(const std::vector<VarianceChange>& dV,
                                                   const std::vector<VarianceChange>& wanted) const;

 protected:
  // Blocks of the inverse of A^T V^-1 A.
  const ChainFactor::Blocks& pose_covariance() const { return pose_covariance_; }

 private:
  void Complete(const PoseGraph& graph);

  ChainFactor::Blocks pose_covariance_;
  StackedRows D_;  // as many columns as the largest number of rows of a factor
  StackedRows BM_;
  Eigen::VectorXd projected_;
  SharedInformation shared_;
};

}  // namespace truetriad
