// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "solve/row_products.h"

namespace truetriad {

// The normal matrix of the states of a chain in which only neighbours are coupled: block
// tridiagonal, symmetric, positive definite, three rows per state. Every operation is linear in the
// number of states.
//
//   N = [ N_0   U_0              ]      eliminated from the first state to the last:
//       [ U_0^T N_1   U_1        ]        L_0 = N_0,  L_k = N_k - U_{k-1}^T L_{k-1}^-1 U_{k-1}
//       [       U_1^T N_2   …    ]        G_k = L_k^-1 U_k,  H_k^T H_k = L_k^-1
//
// Unused dimensions of a state have 1 on the diagonal and zeros beside it. If a state and the next
// are not coupled, a new chain starts there.
class ChainFactor {
 public:
  void Reserve(std::size_t states);
  // Appends a state: its diagonal block of N, and the block between this state and the next, which
  // is zero if the two are not coupled.
  void Append(const Eigen::Matrix3d& diagonal, const Eigen::Matrix3d& coupling);

  std::size_t states() const { return half_.size(); }
  // Number of rows of all states; those of state k begin at 3 k.
  Eigen::Index size() const { return 3 * static_cast<Eigen::Index>(states()); }
  const Eigen::Matrix3d& half(std::size_t state) const { return half_[state]; }  // H_k
  // G_k; the state must be coupled with the next.
  const Eigen::Matrix3d& gain(std::size_t state) const { return gain_[state]; }
  bool IsCoupled(std::size_t state) const { return state < gain_.size() && is_coupled_[state]; }

  // Replaces b by N^-1 b, for any number of columns.
  void SolveInPlace(StackedRows* b) const;

  // Blocks of N^-1: of each state, and between each state and the next.
  struct Blocks {
    std::vector<Eigen::Matrix3d> own;
    std::vector<Eigen::Matrix3d> with_next;  // empty if no states are coupled
    static Blocks Zero(std::size_t states, bool coupled);
    Eigen::Matrix3d WithNext(std::size_t state) const {
      return with_next.empty() ? Eigen::Matrix3d(Eigen::Matrix3d::Zero()) : with_next[state];
    }
  };
  Blocks Inverse() const;
  // The derivative of the blocks of N^-1 for a change of N's blocks; `inverse`: the result of
  // Inverse.
  Blocks InverseDerivative(const Blocks& inverse, const Blocks& change) const;

  // Columns that are zero except in the rows of consecutive states, `first` to `end` - 1.
  struct Panel {
    std::size_t first = 0;
    Eigen::MatrixXd rows;
    std::size_t end() const { return first + static_cast<std::size_t>(rows.rows() / 3); }
  };
  // b_g^T N^-1 b_h of each pair of panels, as block (g, h). All panels must have the same number of
  // columns, and must be sorted by their first states and also by their ends. Panels may have no
  // rows.
  Eigen::MatrixXd InverseBetween(const std::vector<Panel>& panels, const Blocks& inverse) const;

 private:
  Eigen::MatrixXd SolvedWithin(const Panel& b, const Blocks& inverse) const;

  std::vector<Eigen::Matrix3d> half_;
  // Both lists end with the last state that is coupled with the next; they are empty for poses
  // without turns.
  std::vector<Eigen::Matrix3d> coupling_, gain_;
  std::vector<bool> is_coupled_;
};

}  // namespace truetriad
