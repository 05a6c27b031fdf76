// SPDX-License-Identifier: Apache-2.0
#include "solve/chain_factor.h"

#include <algorithm>

#include "math/dense/cholesky.h"
#include "math/dense/products.h"

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

// The rows of x = N^-1 b at the panel's states. Forward, c_k = b_k - G_{k-1}^T c_{k-1}; at the last
// state, x_k = (N^-1)_kk c_k; from there backward, x_k = H_k^T H_k c_k - G_k x_{k+1}.
Eigen::MatrixXd ChainFactor::SolvedWithin(const Panel& b, const Blocks& inverse) const {
  Eigen::MatrixXd x = b.rows;
  const Eigen::Index last = x.rows() / 3 - 1;
  const auto state_of = [&](Eigen::Index i) { return b.first + static_cast<std::size_t>(i); };
  for (Eigen::Index j = 0; j < x.cols(); ++j) {
    const auto at = [&](Eigen::Index i) { return x.col(j).segment<3>(3 * i); };
    for (Eigen::Index i = 1; i <= last; ++i) {
      if (!IsCoupled(state_of(i - 1))) continue;
      at(i).noalias() -= gain_[state_of(i - 1)].transpose() * at(i - 1);
    }
    at(last) = inverse.own[state_of(last)] * Eigen::Vector3d(at(last));
    for (Eigen::Index i = last; i-- > 0;) {
      const Eigen::Matrix3d& half = half_[state_of(i)];
      const Eigen::Vector3d halved = half * at(i);
      at(i).noalias() = half.transpose() * halved;
      if (IsCoupled(state_of(i))) at(i).noalias() -= gain_[state_of(i)] * at(i + 1);
    }
  }
  return x;
}

// For x = N^-1 b_h and the first state f of b_h, x_k = (-G_k) ... (-G_{f-1}) x_f at earlier states
// k. The rows of an earlier b_g before f thus enter as one block, Σ_{k < f} (-G_{f-1})^T ...
// (-G_k)^T b_gk. This block is moved from the f of one panel to the f of the next panel.
Eigen::MatrixXd ChainFactor::InverseBetween(const std::vector<Panel>& panels,
                                            const Blocks& inverse) const {
  using ThreeRows = Eigen::Matrix<double, 3, Eigen::Dynamic>;
  const Eigen::Index wide = panels.front().rows.cols();
  const auto place = [wide](std::size_t panel) { return wide * static_cast<Eigen::Index>(panel); };
  Eigen::MatrixXd all = Eigen::MatrixXd::Zero(place(panels.size()), place(panels.size()));
  std::vector<ThreeRows> moved(panels.size(), ThreeRows::Zero(3, wide));
  std::size_t from = 0;
  for (std::size_t h = 0; h < panels.size(); ++h) {
    const Panel& own = panels[h];
    if (own.rows.rows() == 0) continue;
    Eigen::Matrix3d move = Eigen::Matrix3d::Identity();
    std::vector<ThreeRows> more(h, ThreeRows::Zero(3, wide));
    for (std::size_t k = own.first; k-- > from;) {
      if (!IsCoupled(k)) {
        move.setZero();
        break;
      }
      move = -(move * gain_[k].transpose()).eval();
      for (std::size_t g = h; g-- > 0;) {
        if (panels[g].rows.rows() == 0) continue;
        if (panels[g].end() <= k) break;
        const auto row = 3 * static_cast<Eigen::Index>(k - panels[g].first);
        more[g].noalias() += move.lazyProduct(panels[g].rows.middleRows<3>(row));
      }
    }
    from = own.first;
    const Eigen::MatrixXd x = SolvedWithin(own, inverse);
    for (std::size_t g = 0; g <= h; ++g) {
      if (panels[g].rows.rows() == 0) continue;
      if (g < h) moved[g] = move.lazyProduct(moved[g]).eval() + more[g];
      Eigen::MatrixXd product = moved[g].transpose().lazyProduct(x.topRows<3>());
      if (panels[g].end() > from) {
        const auto both = 3 * static_cast<Eigen::Index>(panels[g].end() - from);
        product += TransposeTimes(panels[g].rows.bottomRows(both), x.topRows(both));
      }
      all.block(place(g), place(h), wide, wide) = product;
      if (g < h) all.block(place(h), place(g), wide, wide) = product.transpose();
    }
  }
  return all;
}

}  // namespace truetriad
