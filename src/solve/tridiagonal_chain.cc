// SPDX-License-Identifier: Apache-2.0
#include "solve/tridiagonal_chain.h"

#include <Eigen/LU>
#include <glog/logging.h>

namespace truetriad {

TridiagonalChain::TridiagonalChain(const std::vector<Block>& diagonal,
                                   const std::vector<Block>& coupling)
    : coupling_(coupling) {
  const std::size_t count = diagonal.size();
  CHECK_EQ(coupling.size() + 1, count + (count == 0 ? 1 : 0));
  offset_.reserve(count);
  inverse_.reserve(count);
  gain_.resize(coupling.size());
  for (std::size_t k = 0; k < count; ++k) {
    offset_.push_back(size_);
    size_ += diagonal[k].rows();
    Block left = diagonal[k];
    if (k > 0 && IsCoupled(k - 1)) left.noalias() -= coupling[k - 1].transpose() * gain_[k - 1];
    inverse_.push_back(left.inverse());
    if (k < coupling.size() && IsCoupled(k)) gain_[k] = inverse_[k] * coupling[k];
  }
  covariance_.resize(count);
  with_next_.resize(coupling.size());
  for (std::size_t k = count; k-- > 0;) {
    covariance_[k] = inverse_[k];
    if (k >= coupling.size() || !IsCoupled(k)) continue;
    with_next_[k] = -gain_[k] * covariance_[k + 1];
    covariance_[k].noalias() -= with_next_[k] * gain_[k].transpose();
  }
}

// Each line of the constructor, differentiated.
void TridiagonalChain::CovarianceDerivative(const std::vector<Block>& diagonal,
                                            const std::vector<Block>& coupling,
                                            std::vector<Block>* own,
                                            std::vector<Block>* with_next) const {
  const std::size_t count = poses();
  std::vector<Block> inverse(count), gain(coupling_.size());
  for (std::size_t k = 0; k < count; ++k) {
    Block left = diagonal[k];
    if (k > 0 && IsCoupled(k - 1)) {
      left.noalias() -= coupling[k - 1].transpose() * gain_[k - 1];
      left.noalias() -= coupling_[k - 1].transpose() * gain[k - 1];
    }
    inverse[k] = -inverse_[k] * left * inverse_[k];
    if (k < coupling_.size() && IsCoupled(k)) {
      gain[k] = inverse[k] * coupling_[k] + inverse_[k] * coupling[k];
    }
  }
  own->assign(count, Block());
  with_next->assign(coupling_.size(), Block());
  for (std::size_t k = count; k-- > 0;) {
    (*own)[k] = inverse[k];
    if (k >= coupling_.size() || !IsCoupled(k)) continue;
    (*with_next)[k] = -gain[k] * covariance_[k + 1] - gain_[k] * (*own)[k + 1];
    (*own)[k].noalias() -= (*with_next)[k] * gain_[k].transpose();
    (*own)[k].noalias() -= with_next_[k] * gain[k].transpose();
  }
}

void TridiagonalChain::SolveInPlace(StackedRows* b) const {
  const auto rows = [&](std::size_t k) { return b->middleRows(offset_[k], inverse_[k].rows()); };
  for (std::size_t k = 1; k < poses(); ++k) {
    if (IsCoupled(k - 1)) AddProduct(-1.0, gain_[k - 1].transpose(), rows(k - 1), rows(k));
  }
  StackedRows own;
  for (std::size_t k = poses(); k-- > 0;) {
    own = rows(k);
    rows(k).setZero();
    AddProduct(1.0, inverse_[k], own, rows(k));
    if (k < coupling_.size() && IsCoupled(k)) AddProduct(-1.0, gain_[k], rows(k + 1), rows(k));
  }
}

}  // namespace truetriad
