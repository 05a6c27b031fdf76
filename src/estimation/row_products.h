// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

#include <Eigen/Core>

namespace truetriad {

// Rows of several factors or poses, one after another.
using StackedRows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// A corner of up to three rows and columns of a small matrix, and the long rows that it takes from
// and adds to.
struct RowTile {
  int rows = 0;
  int cols = 0;
  Eigen::Matrix3d factors;
  const double* in = nullptr;
  Eigen::Index in_stride = 0;
  double* out = nullptr;
  Eigen::Index out_stride = 0;
  Eigen::Index length = 0;
};
void AddTile(const RowTile& tile);

// out += sign * a * b for a small `a` and long rows of `b` and `out`, which do not overlap: in
// tiles, where a general product would spend most of its time on packing. Tiles of zeros cost
// nothing.
template <typename Small, typename In, typename Out>
void AddProduct(double sign, const Small& a, const In& b, Out&& out) {
  constexpr Eigen::Index kTile = 3;
  RowTile tile;
  tile.in_stride = b.outerStride();
  tile.out_stride = out.outerStride();
  tile.length = b.cols();
  for (Eigen::Index i = 0; i < a.rows(); i += kTile) {
    for (Eigen::Index j = 0; j < a.cols(); j += kTile) {
      tile.rows = static_cast<int>(std::min(kTile, a.rows() - i));
      tile.cols = static_cast<int>(std::min(kTile, a.cols() - j));
      bool is_zero = true;
      for (int c = 0; c < tile.cols; ++c) {
        for (int r = 0; r < tile.rows; ++r) {
          tile.factors(r, c) = sign * a(i + r, j + c);
          is_zero = is_zero && tile.factors(r, c) == 0.0;
        }
      }
      if (is_zero) continue;
      tile.in = b.data() + j * tile.in_stride;
      tile.out = out.data() + i * tile.out_stride;
      AddTile(tile);
    }
  }
}

}  // namespace truetriad
