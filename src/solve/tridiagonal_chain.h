// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "solve/row_products.h"

namespace truetriad {

// The part of a normal matrix that belongs to the poses when only neighbours hang together: block
// tridiagonal, symmetric, positive definite, a block a pose. Everything is linear in the number of
// poses.
//
//   N = [ N_0   U_0              ]      eliminated from the first pose to the last:
//       [ U_0^T N_1   U_1        ]        L_0 = N_0,  L_k = N_k - U_{k-1}^T L_{k-1}^-1 U_{k-1}
//       [       U_1^T N_2   …    ]        G_k = L_k^-1 U_k
//
// Poses may differ in size, zero included (an attitude that is known exactly); an empty coupling
// starts a new chain.
class TridiagonalChain {
 public:
  using Block = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 3, 3>;

  TridiagonalChain() = default;
  // `coupling[k]` is U_k, between pose k and the next: one less than poses.
  TridiagonalChain(const std::vector<Block>& diagonal, const std::vector<Block>& coupling);

  std::size_t poses() const { return inverse_.size(); }
  // Rows of all poses, and where those of one begin.
  Eigen::Index size() const { return size_; }
  Eigen::Index offset(std::size_t pose) const { return offset_[pose]; }

  // From b to N^-1 b, for any number of columns.
  void SolveInPlace(StackedRows* b) const;

  // Blocks of N^-1: of one pose, and between a pose and the next (empty when not coupled).
  const Block& Covariance(std::size_t pose) const { return covariance_[pose]; }
  const Block& CovarianceWithNext(std::size_t pose) const { return with_next_[pose]; }
  const std::vector<Block>& covariances() const { return covariance_; }
  const std::vector<Block>& covariances_with_next() const { return with_next_; }

  // How those blocks change when N changes by blocks of the same sizes.
  void CovarianceDerivative(const std::vector<Block>& diagonal,
                            const std::vector<Block>& coupling,
                            std::vector<Block>* own,
                            std::vector<Block>* with_next) const;

 private:
  bool IsCoupled(std::size_t pose) const { return coupling_[pose].size() > 0; }

  Eigen::Index size_ = 0;
  std::vector<Eigen::Index> offset_;
  std::vector<Block> coupling_;  // U_k
  std::vector<Block> inverse_;   // L_k^-1
  std::vector<Block> gain_;      // G_k
  std::vector<Block> covariance_, with_next_;
};

}  // namespace truetriad
