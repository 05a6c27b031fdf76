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

// Linearises a problem and eliminates its states (tangent spaces p_k) from the first to the last,
// so that only the free shared coordinates t remain. With whitened rows r + J t + A p and N = A^T A
// (chain_factor.h), the remaining information is M = J^T J - J^T A N^-1 A^T J. Each state stores
// only what its back substitution needs, so that time and memory are linear in the number of
// states.
class ChainElimination final : public EliminatedProblem {
 public:
  explicit ChainElimination(ChainProblem problem);

  // Linearises at `shared`. The states are back-substituted from the last linearisation; the first
  // call uses the problem's own states.
  void Linearise(const Eigen::VectorXd& shared) override;
  // Like Linearise, but needs less memory: afterwards, the states cannot be computed at other
  // parameters.
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

  // A row at the last linearisation: its whitened values, and the share of their covariance that
  // remains after the states are fitted, 1 - leverage. If a row has fewer than three values, the
  // remaining entries are zero.
  struct Residual {
    Eigen::Vector3d value = Eigen::Vector3d::Zero();
    Eigen::Matrix3d left = Eigen::Matrix3d::Zero();
  };
  std::vector<Residual> Residuals() const;

 private:
  // The shared blocks of a row, and the map from the columns of these blocks to the free
  // coordinates. Rows with the same shared blocks have one pattern.
  struct Pattern {
    std::vector<SharedBlock> blocks;
    struct Term {
      int start = 0;   // index of the block's first column among the columns of all blocks
      int size = 0;    // size of the block
      int column = 0;  // column in the block
      int free = 0;    // index among `free`
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
  // For each state k, H_k times the columns A_k^T [J, r] that remain when the state is eliminated.
  // A panel holds kPanelStates states. If the states are not needed later, only the last panel is
  // kept.
  std::vector<Eigen::MatrixXd> panels_;
};

// A graph linearised at its present values; the graph must outlive the result.
ChainElimination Linearised(const PoseGraph& graph);

}  // namespace truetriad
