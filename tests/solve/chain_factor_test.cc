// SPDX-License-Identifier: Apache-2.0
#include "solve/chain_factor.h"

#include <utility>

#include <gtest/gtest.h>

#include "math/dense/cholesky.h"
#include "math/random.h"

namespace truetriad {
namespace chain_factor_test {

// States of all sizes in two chains, beside two that are coupled to nothing; and the same dense.
struct Example {
  ChainFactor::Blocks blocks;
  Eigen::MatrixXd dense;

  // As a change of a matrix: without the units of dimensions that are not there.
  Example(std::uint64_t seed, bool is_change) {
    Random random(seed);
    const std::vector<int> sizes = {3, 2, 3, 3, 0, 3, 2, 2, 3};
    const std::vector<bool> coupled = {true, true, true, false, false, true, true, false};
    blocks = ChainFactor::Blocks::Zero(sizes.size(), true);
    const auto count = 3 * static_cast<Eigen::Index>(sizes.size());
    dense = Eigen::MatrixXd::Zero(count, count);
    for (std::size_t k = 0; k < sizes.size(); ++k) {
      Eigen::Matrix3d& own = blocks.own[k];
      for (int i = 0; i < 3; ++i) {
        own(i, i) = i < sizes[k] ? 4.0 + random.Uniform(0.0, 3.0) : is_change ? 0.0 : 1.0;
      }
      const Eigen::Index at = 3 * static_cast<Eigen::Index>(k);
      dense.block<3, 3>(at, at) = own;
      if (k + 1 == sizes.size() || !coupled[k]) continue;
      Eigen::Matrix3d& next = blocks.with_next[k];
      for (int i = 0; i < sizes[k]; ++i) {
        for (int j = 0; j < sizes[k + 1]; ++j) next(i, j) = random.Uniform(-0.6, 0.6);
      }
      dense.block<3, 3>(at, at + 3) = next;
      dense.block<3, 3>(at + 3, at) = next.transpose();
    }
  }

  ChainFactor Factor() const {
    ChainFactor factor;
    for (std::size_t k = 0; k < blocks.own.size(); ++k) {
      factor.Append(blocks.own[k], blocks.with_next[k]);
    }
    return factor;
  }
};

// Blocks of `dense` against those given, but for where nothing is coupled.
void ExpectBlocks(const Eigen::MatrixXd& dense, const ChainFactor::Blocks& blocks) {
  for (std::size_t k = 0; k < blocks.own.size(); ++k) {
    const Eigen::Index at = 3 * static_cast<Eigen::Index>(k);
    EXPECT_LT((blocks.own[k] - dense.block<3, 3>(at, at)).norm(), 1e-14);
    if (k + 1 == blocks.own.size()) continue;
    EXPECT_LT((blocks.with_next[k] - dense.block<3, 3>(at, at + 3)).norm(), 1e-14);
  }
}

TEST(ChainFactor, SolvesAsTheDenseMatrixDoes) {
  const Example example(1, false);
  const ChainFactor factor = example.Factor();
  ASSERT_EQ(factor.size(), example.dense.rows());
  const StackedRows b = StackedRows::Random(factor.size(), 4);
  StackedRows x = b;
  factor.SolveInPlace(&x);
  EXPECT_LT((example.dense * x - b).norm(), 1e-13);
}

TEST(ChainFactor, GivesTheBlocksOfTheInverse) {
  const Example example(2, false);
  ExpectBlocks(Cholesky(example.dense).Inverse(), example.Factor().Inverse());
}

// d N^-1 = -N^-1 dN N^-1, exactly.
TEST(ChainFactor, GivesTheDerivativeOfTheInverse) {
  const Example at(3, false), change(4, true);
  const ChainFactor factor = at.Factor();
  const Eigen::MatrixXd inverse = Cholesky(at.dense).Inverse();
  ExpectBlocks(-inverse * change.dense * inverse,
               factor.InverseDerivative(factor.Inverse(), change.blocks));
}

// Panels that overlap, leave states out, or have no rows, in both chains and beside them.
TEST(ChainFactor, GivesTheProductsOfPanelsWithTheInverse) {
  const Example example(5, false);
  const ChainFactor factor = example.Factor();
  const std::vector<std::pair<std::size_t, int>> places = {
      {0, 2}, {1, 1}, {1, 0}, {2, 2}, {3, 3}, {6, 2}, {8, 1}};
  std::vector<ChainFactor::Panel> panels;
  StackedRows all = StackedRows::Zero(factor.size(), 2 * std::ssize(places));
  for (const auto& [first, states] : places) {
    const auto row = 3 * static_cast<Eigen::Index>(first), column = 2 * std::ssize(panels);
    panels.push_back({first, Eigen::MatrixXd::Random(3 * states, 2)});
    all.block(row, column, 3 * states, 2) = panels.back().rows;
  }
  const Eigen::MatrixXd wanted = all.transpose() * Cholesky(example.dense).Inverse() * all;
  EXPECT_LT((factor.InverseBetween(panels, factor.Inverse()) - wanted).norm(), 1e-14);
}

TEST(ChainFactor, KeepsNothingBetweenStatesThatAreNotCoupled) {
  ChainFactor factor;
  for (int k = 1; k < 4; ++k) {
    factor.Append(k * Eigen::Matrix3d::Identity(), Eigen::Matrix3d::Zero());
  }
  const ChainFactor::Blocks inverse = factor.Inverse();
  EXPECT_TRUE(inverse.with_next.empty());
  EXPECT_EQ(inverse.WithNext(1), Eigen::Matrix3d::Zero().eval());
  EXPECT_LT((inverse.own[1] - 0.5 * Eigen::Matrix3d::Identity()).norm(), 1e-15);
  const ChainFactor::Blocks change = ChainFactor::Blocks::Zero(factor.states(), false);
  EXPECT_TRUE(factor.InverseDerivative(inverse, change).with_next.empty());
}

TEST(ChainFactor, MayBeEmpty) {
  const ChainFactor factor;
  EXPECT_EQ(factor.size(), 0);
  StackedRows nothing(0, 2);
  factor.SolveInPlace(&nothing);
  EXPECT_EQ(nothing.cols(), 2);
}

}  // namespace chain_factor_test
}  // namespace truetriad
