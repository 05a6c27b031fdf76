// SPDX-License-Identifier: Apache-2.0
#include "estimation/row_products.h"

#include <array>

namespace truetriad {
namespace {

template <int kRows, int kCols>
void AddTileOf(const RowTile& tile) {
  const Eigen::Matrix3d factors = tile.factors;
  std::array<const double*, kCols> in;
  std::array<double*, kRows> out;
  for (int c = 0; c < kCols; ++c) in[c] = tile.in + c * tile.in_stride;
  for (int r = 0; r < kRows; ++r) out[r] = tile.out + r * tile.out_stride;
// The rows do not overlap.
#pragma GCC ivdep
  for (Eigen::Index k = 0; k < tile.length; ++k) {
    for (int r = 0; r < kRows; ++r) {
      double sum = out[r][k];
      for (int c = 0; c < kCols; ++c) sum += factors(r, c) * in[c][k];
      out[r][k] = sum;
    }
  }
}

template <int kRows>
void AddTileOfRows(const RowTile& tile) {
  if (tile.cols == 3) {
    AddTileOf<kRows, 3>(tile);
  } else if (tile.cols == 2) {
    AddTileOf<kRows, 2>(tile);
  } else {
    AddTileOf<kRows, 1>(tile);
  }
}

}  // namespace

void AddTile(const RowTile& tile) {
  if (tile.rows == 3) {
    AddTileOfRows<3>(tile);
  } else if (tile.rows == 2) {
    AddTileOfRows<2>(tile);
  } else {
    AddTileOfRows<1>(tile);
  }
}

}  // namespace truetriad
