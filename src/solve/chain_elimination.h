// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "problem/rows/row.h"
#include "problem/rows/row_evaluation.h"
#include "solve/chain_factor.h"
#include "solve/chain_problem.h"
#include "solve/eliminated.h"

namespace truetriad {

// A linearised problem whose states (tangent spaces p_k) are eliminated from the first to the last,
// before the free shared coordinates t: an arrow matrix. With whitened rows r + J t + A p and N =
// A^T A (chain_factor.h), the reduced system is M = J^T J - J^T A N^-1 A^T J with its gradient.
// Each state stores only what its back substitution needs: time and memory are linear in their
// number.
class ChainElimination final : public EliminatedProblem {
 public:
  explicit ChainElimination(ChainProblem problem);

  // Linearises at `shared`, and at the states that the last linearisation gives there, or for the
  // first time at the problem's own states.
  void Linearise(const Eigen::VectorXd& shared) override;
  // As Linearise, in less memory: afterwards, no states can be computed at other parameters.
  void LineariseOnce(const Eigen::VectorXd& shared);
  double CostAt(const Eigen::VectorXd& shared) const override;
  double cost() const override { return cost_; }
  const Eigen::VectorXd& gradient() const override { return gradient_; }
  const Eigen::MatrixXd& information() const override { return information_; }

  // The parameters of the last linearisation.
  const Eigen::VectorXd& shared() const { return at_; }
  ChainProblem TakeProblem() && { return std::move(problem_); }
  const std::vector<ChainState>& states() const { return problem_.states; }
  const std::vector<ChainRow>& rows() const { return problem_.rows; }

  // For each row, at the last linearisation: its whitened values, and the share of their covariance
  // that the states leave, 1 - leverage; rows of fewer than three values have zeros.
  struct Residual {
    Eigen::Vector3d value = Eigen::Vector3d::Zero();
    Eigen::Matrix3d left = Eigen::Matrix3d::Zero();
  };
  std::vector<Residual> Residuals() const;

 private:
  // Rows with the same shared blocks, and the map from the columns of these blocks to those of the
  // free coordinates in them.
  struct Pattern {
    std::vector<SharedBlock> blocks;
    struct Term {
      int start = 0;   // of the block's columns among those of all blocks
      int size = 0;    // of the block
      int column = 0;  // in the block
      int free = 0;    // among `free`
      double factor = 0.0;
    };
    std::vector<Term> terms;
    std::vector<int> free;
  };
  using FreeJacobian = Eigen::Matrix<double, 3, Eigen::Dynamic>;
  class SquaredRows;
  struct LinearRow;
  struct Arrow;

  static double BendOf(const LinearRow& row);
  std::size_t PatternOf(const Row& row);
  void LineariseRow(std::size_t index, RowEvaluation* evaluation, LinearRow* linear) const;
  void LineariseAndEliminate(const Eigen::VectorXd& shared);
  void EliminateState(std::size_t k, Arrow* arrow);
  void Finish(std::vector<SquaredRows>* squares, const Eigen::MatrixXd& eliminated);
  std::vector<ChainState> StatesAt(const Eigen::VectorXd& shared) const;

  ChainProblem problem_;
  std::vector<Pattern> patterns_;
  std::vector<std::size_t> pattern_of_;  // for each row, its index in patterns_

  bool is_linearised_ = false;
  bool keeps_panels_ = true;
  Eigen::VectorXd at_;
  double cost_ = 0.0;
  Eigen::VectorXd gradient_;
  Eigen::MatrixXd information_;
  ChainFactor factor_;
  // H_k times the columns A_k^T [J, r] that are left when k is eliminated, kPanelStates states per
  // panel; only the last panel if states are not needed.
  std::vector<Eigen::MatrixXd> panels_;
};

// A graph linearised at its present values; the graph must outlive the result.
ChainElimination Linearised(const PoseGraph& graph);

}  // namespace truetriad
