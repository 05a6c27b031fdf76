// SPDX-License-Identifier: Apache-2.0
#include "solve/chain_factor.h"

#include <algorithm>

#include "math/dense/cholesky.h"

namespace truetriad {

void ChainFactor::Reserve(std::size_t states) { half_.reserve(states); }

void ChainFactor::Append(const Eigen::Matrix3d& diagonal, const Eigen::Matrix3d& coupling) {
  Eigen::Matrix3d left = diagonal;
  if (states() > 0 && IsCoupled(states() - 1)) {
    left.noalias() -= coupling_.back().transpose() * gain_.back();
  }
  half_.push_back(InverseCholeskyRoot(left));
  if (coupling.isZero(0.0)) return;
  coupling_.resize(states(), Eigen::Matrix3d::Zero());
  gain_.resize(states(), Eigen::Matrix3d::Zero());
  is_coupled_.resize(states(), false);
  coupling_.back() = coupling;
  const Eigen::Matrix3d half_gain = half_.back() * coupling;
  gain_.back() = half_.back().transpose() * half_gain;
  is_coupled_.back() = true;
}

void ChainFactor::SolveInPlace(StackedRows* b) const {
  const auto rows = [&](std::size_t k) {
    return b->middleRows(3 * static_cast<Eigen::Index>(k), 3);
  };
  for (std::size_t k = 1; k < states(); ++k) {
    if (IsCoupled(k - 1)) AddProduct(-1.0, gain_[k - 1].transpose(), rows(k - 1), rows(k));
  }
  StackedRows own;
  for (std::size_t k = states(); k-- > 0;) {
    own = rows(k);
    rows(k).setZero();
    const Eigen::Matrix3d inverse = half_[k].transpose() * half_[k];
    AddProduct(1.0, inverse, own, rows(k));
    if (k + 1 < states() && IsCoupled(k)) AddProduct(-1.0, gain_[k], rows(k + 1), rows(k));
  }
}

// Computes c_k = b_k - G_{k-1}^T c_{k-1} until c_k is negligible. Then replaces each c_k by H_k
// c_k.
void ChainFactor::HalfSolveInPlace(Panel* panel) const {
  constexpr double kNothingLeft = 1e-10;  // share of the largest; its square is below rounding
  StackedRows& rows = panel->rows;
  Eigen::Index count = rows.rows() / 3;
  double largest = 0.0;
  for (Eigen::Index i = 0; i < count; ++i) {
    const std::size_t state = panel->first + static_cast<std::size_t>(i);
    if (i > 0 && IsCoupled(state - 1)) {
      rows.middleRows<3>(3 * i) -=
          gain_[state - 1].transpose().lazyProduct(rows.middleRows<3>(3 * i - 3)).eval();
    }
    const double size = rows.middleRows<3>(3 * i).cwiseAbs().maxCoeff();
    largest = std::max(largest, size);
    const bool is_last = i + 1 == count;
    if (!is_last || !IsCoupled(state) || size <= kNothingLeft * largest) continue;
    if (3 * count == rows.rows()) {
      rows.conservativeResizeLike(StackedRows::Zero(6 * count + 3, rows.cols()));
    }
    ++count;
  }
  rows.conservativeResize(3 * count, Eigen::NoChange);
  for (Eigen::Index i = 0; i < count; ++i) {
    auto own = rows.middleRows<3>(3 * i);
    own = half_[panel->first + static_cast<std::size_t>(i)].lazyProduct(own).eval();
  }
}

ChainFactor::Blocks ChainFactor::Blocks::Zero(std::size_t states, bool coupled) {
  return {std::vector<Eigen::Matrix3d>(states, Eigen::Matrix3d::Zero()),
          std::vector<Eigen::Matrix3d>(coupled ? states : 0, Eigen::Matrix3d::Zero())};
}

ChainFactor::Blocks ChainFactor::Inverse() const {
  Blocks inverse = Blocks::Zero(states(), !gain_.empty());
  for (std::size_t k = states(); k-- > 0;) {
    inverse.own[k].noalias() = half_[k].transpose() * half_[k];
    if (k + 1 == states() || !IsCoupled(k)) continue;
    inverse.with_next[k].noalias() = -gain_[k] * inverse.own[k + 1];
    inverse.own[k].noalias() -= inverse.with_next[k] * gain_[k].transpose();
  }
  return inverse;
}

// Differentiates each line of Append and of Inverse.
ChainFactor::Blocks ChainFactor::InverseDerivative(const Blocks& inverse,
                                                   const Blocks& change) const {
  // Derivatives of L_k^-1 and of G_k.
  std::vector<Eigen::Matrix3d> left_inverse(states()), gain(gain_.size());
  for (std::size_t k = 0; k < states(); ++k) {
    Eigen::Matrix3d left = change.own[k];
    if (k > 0 && IsCoupled(k - 1)) {
      left.noalias() -= change.with_next[k - 1].transpose() * gain_[k - 1];
      left.noalias() -= coupling_[k - 1].transpose() * gain[k - 1];
    }
    const Eigen::Matrix3d own = half_[k].transpose() * half_[k];
    left_inverse[k].noalias() = -own * left * own;
    if (!IsCoupled(k)) continue;
    gain[k].noalias() = left_inverse[k] * coupling_[k] + own * change.with_next[k];
  }
  Blocks derivative = Blocks::Zero(states(), !gain_.empty());
  for (std::size_t k = states(); k-- > 0;) {
    derivative.own[k] = left_inverse[k];
    if (k + 1 == states() || !IsCoupled(k)) continue;
    Eigen::Matrix3d& with_next = derivative.with_next[k];
    with_next.noalias() = -gain[k] * inverse.own[k + 1] - gain_[k] * derivative.own[k + 1];
    derivative.own[k].noalias() -= with_next * gain_[k].transpose();
    derivative.own[k].noalias() -= inverse.with_next[k] * gain[k].transpose();
  }
  return derivative;
}

}  // namespace truetriad
