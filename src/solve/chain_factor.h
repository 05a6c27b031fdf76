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
  // Rows of all states; those of state k begin at 3 k.
  Eigen::Index size() const { return 3 * static_cast<Eigen::Index>(states()); }
  const Eigen::Matrix3d& half(std::size_t state) const { return half_[state]; }  // H_k
  // G_k; only of a state that is coupled with the next.
  const Eigen::Matrix3d& gain(std::size_t state) const { return gain_[state]; }
  bool IsCoupled(std::size_t state) const { return state < gain_.size() && is_coupled_[state]; }

  // Replaces b by N^-1 b, for any number of columns.
  void SolveInPlace(StackedRows* b) const;

  // Columns of b that are zero before state `first`; HalfSolveInPlace replaces them by L^-1 b with
  // N = L L^T. `rows`: b from state `first` to the last nonzero row; afterwards the result, as far
  // as it is not negligible.
  struct Panel {
    std::size_t first = 0;
    StackedRows rows;
    Eigen::Index begin() const { return 3 * static_cast<Eigen::Index>(first); }
    Eigen::Index end() const { return begin() + rows.rows(); }
  };
  void HalfSolveInPlace(Panel* panel) const;

  // The blocks of N^-1 for each state, and those between each state and the next one.
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

 private:
  std::vector<Eigen::Matrix3d> half_;
  // They end with the last state that is coupled with its successor, and are empty for poses
  // without turns.
  std::vector<Eigen::Matrix3d> coupling_, gain_;
  std::vector<bool> is_coupled_;
};

}  // namespace truetriad
