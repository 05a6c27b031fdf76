// SPDX-License-Identifier: Apache-2.0
#include "solve/tridiagonal_chain.h"

#include <Eigen/LU>
#include <gtest/gtest.h>

#include "math/random.h"

namespace truetriad {
namespace {

using Block = TridiagonalChain::Block;

// Poses of all sizes in two chains, beside two poses that hang on nothing; and the same dense.
struct Example {
  std::vector<Block> diagonal, coupling;
  Eigen::MatrixXd dense;

  explicit Example(std::uint64_t seed) {
    Random random(seed);
    const std::vector<Eigen::Index> sizes = {3, 2, 3, 3, 0, 3, 2, 2, 3};
    const std::vector<bool> coupled = {true, true, true, false, false, true, true, false};
    Eigen::Index size = 0;
    for (const Eigen::Index n : sizes) size += n;
    dense = Eigen::MatrixXd::Zero(size, size);
    Eigen::Index at = 0;
    for (std::size_t k = 0; k < sizes.size(); ++k) {
      const Eigen::Index n = sizes[k];
      Block block = Block::Identity(n, n) * 4.0;
      for (Eigen::Index i = 0; i < n; ++i) block(i, i) += random.Uniform(0.0, 3.0);
      diagonal.push_back(block);
      dense.block(at, at, n, n) = block;
      if (k + 1 < sizes.size()) {
        Block next(coupled[k] ? n : 0, coupled[k] ? sizes[k + 1] : 0);
        for (Eigen::Index i = 0; i < next.size(); ++i) next.data()[i] = random.Uniform(-0.6, 0.6);
        coupling.push_back(next);
        if (coupled[k]) {
          dense.block(at, at + n, n, sizes[k + 1]) = next;
          dense.block(at + n, at, sizes[k + 1], n) = next.transpose();
        }
      }
      at += n;
    }
  }
};

TEST(TridiagonalChain, SolvesAsTheDenseMatrixDoes) {
  const Example example(1);
  const TridiagonalChain chain(example.diagonal, example.coupling);
  ASSERT_EQ(chain.size(), example.dense.rows());
  const StackedRows b = StackedRows::Random(chain.size(), 4);
  StackedRows x = b;
  chain.SolveInPlace(&x);
  EXPECT_LT((example.dense * x - b).norm(), 1e-13);
}

TEST(TridiagonalChain, GivesTheBlocksOfTheInverse) {
  const Example example(2);
  const TridiagonalChain chain(example.diagonal, example.coupling);
  const Eigen::MatrixXd inverse = example.dense.inverse();
  for (std::size_t k = 0; k < chain.poses(); ++k) {
    const Block& own = chain.Covariance(k);
    EXPECT_LT(
        (own - inverse.block(chain.offset(k), chain.offset(k), own.rows(), own.cols())).norm(),
        1e-14);
    if (k + 1 == chain.poses()) continue;
    const Block& next = chain.CovarianceWithNext(k);
    EXPECT_LT((next - inverse.block(chain.offset(k), chain.offset(k + 1), next.rows(), next.cols()))
                  .norm(),
              1e-14);
    EXPECT_EQ(next.size(), example.coupling[k].size());
  }
}

// d N^-1 = -N^-1 dN N^-1, exactly.
TEST(TridiagonalChain, GivesTheDerivativeOfTheInverse) {
  const Example at(3), change(4);
  const TridiagonalChain chain(at.diagonal, at.coupling);
  const Eigen::MatrixXd inverse = at.dense.inverse();
  const Eigen::MatrixXd expected = -inverse * change.dense * inverse;
  std::vector<Block> own, with_next;
  chain.CovarianceDerivative(change.diagonal, change.coupling, &own, &with_next);
  for (std::size_t k = 0; k < chain.poses(); ++k) {
    const auto rows = expected.middleRows(chain.offset(k), own[k].rows());
    EXPECT_LT((own[k] - rows.middleCols(chain.offset(k), own[k].cols())).norm(), 1e-14);
    if (k + 1 == chain.poses() || with_next[k].size() == 0) continue;
    EXPECT_LT((with_next[k] - rows.middleCols(chain.offset(k + 1), with_next[k].cols())).norm(),
              1e-14);
  }
}

TEST(TridiagonalChain, MayBeEmpty) {
  const TridiagonalChain chain(std::vector<Block>{}, std::vector<Block>{});
  EXPECT_EQ(chain.size(), 0);
  StackedRows nothing(0, 2);
  chain.SolveInPlace(&nothing);
  EXPECT_EQ(nothing.cols(), 2);
}

}  // namespace
}  // namespace truetriad
