// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

#include <Eigen/Core>

namespace truetriad {

// Rows of several factors or poses, one below the other.
using StackedRows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// out += factors * in for long rows `in` and `out`, which do not overlap. `factors`, column by
// column, has as many rows as `out` and as many columns as `in` has rows: at most three each.
struct RowTile {
  const double* factors = nullptr;
  Eigen::Index factors_stride = 0;
  int rows = 0;
  int cols = 0;
  const double* in = nullptr;
  Eigen::Index in_stride = 0;
  double* out = nullptr;
  Eigen::Index out_stride = 0;
  Eigen::Index length = 0;
};
void AddTile(const RowTile& tile);

// out += sign * a * b for a small `a` and long rows of `b` and `out`, which do not overlap. It is
// computed in tiles, since a general product would spend most of its time on packing.
template <typename Small, typename In, typename Out>
void AddProduct(double sign, const Small& a, const In& b, Out&& out) {
  // Rows and columns of a tile: its nine factors stay in registers.
  constexpr Eigen::Index kTile = 3;
  const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 12, 12> factors = sign * a;
  RowTile tile;
  tile.factors_stride = factors.rows();
  tile.in_stride = b.outerStride();
  tile.out_stride = out.outerStride();
  tile.length = b.cols();
  for (Eigen::Index i = 0; i < factors.rows(); i += kTile) {
    for (Eigen::Index j = 0; j < factors.cols(); j += kTile) {
      tile.factors = &factors.coeffRef(i, j);
      tile.rows = static_cast<int>(std::min(kTile, factors.rows() - i));
      tile.cols = static_cast<int>(std::min(kTile, factors.cols() - j));
      tile.in = b.data() + j * tile.in_stride;
      tile.out = out.data() + i * tile.out_stride;
      AddTile(tile);
    }
  }
}

// Number of rows that are gathered for one product: 64 blocks of three, which fit into the cache.
inline constexpr Eigen::Index kRowsAtOnce = 192;

// a^T * b for matrices of equally many rows.
Eigen::MatrixXd TransposedProduct(const StackedRows& a, const StackedRows& b);

// TransposedProduct for a symmetric result, of which only one triangle is computed.
Eigen::MatrixXd SymmetricProduct(const StackedRows& a, const StackedRows& b);

// The product a * b. If `a` has more columns than `b` has rows, the last columns of `a` are
// ignored. The second function reuses the memory of `out`.
StackedRows ProductOfRows(const StackedRows& a, const StackedRows& b);
void ProductOfRows(const StackedRows& a, const StackedRows& b, StackedRows* out);

}  // namespace truetriad
