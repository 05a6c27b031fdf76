// SPDX-License-Identifier: Apache-2.0
#include "solve/row_products.h"

#include <algorithm>
#include <cstring>

#include "base/wide_registers.h"
#include "math/dense/products.h"

namespace truetriad {
namespace {

using Index = Eigen::Index;

// AddTile for a tile of three by three, the common size.
TRUETRIAD_WIDE_REGISTERS void AddThreeByThree(const RowTile& tile) {
  const double* const f = tile.factors;
  const Index s = tile.factors_stride;
  const double f00 = f[0], f10 = f[1], f20 = f[2];
  const double f01 = f[s], f11 = f[s + 1], f21 = f[s + 2];
  const double f02 = f[2 * s], f12 = f[2 * s + 1], f22 = f[2 * s + 2];
  const double* const in0 = tile.in;
  const double* const in1 = in0 + tile.in_stride;
  const double* const in2 = in1 + tile.in_stride;
  double* const out0 = tile.out;
  double* const out1 = out0 + tile.out_stride;
  double* const out2 = out1 + tile.out_stride;
  const Index length = tile.length;
#pragma GCC ivdep
  for (Index k = 0; k < length; ++k) {
    const double a = in0[k], b = in1[k], c = in2[k];
    out0[k] += f00 * a + f01 * b + f02 * c;
    out1[k] += f10 * a + f11 * b + f12 * c;
    out2[k] += f20 * a + f21 * b + f22 * c;
  }
}

// A product whose right factor is a stack of rows. It is computed in blocks that stay in registers.
struct RowProduct {
  const double* a = nullptr;  // element (i, k) at i * a_row + k * a_column
  Index a_row = 0, a_column = 0;
  const double* b = nullptr;  // element (k, j) at k * b_row + j
  Index b_row = 0;
  double* out = nullptr;  // element (i, j) at i * out_row + j
  Index out_row = 0;
  Index rows = 0, inner = 0, columns = 0;
  bool upper_only = false;  // blocks wholly below the diagonal are not computed
};

constexpr Index kBlockRows = 4;  // 4 x 8 sums fill eight of AVX's 16 registers
constexpr Index kBlockColumns = 8;

// The result must be at least as large as a block; the last blocks overlap the blocks before them.
TRUETRIAD_WIDE_REGISTERS void MultiplyInBlocks(const RowProduct& p) {
  using Four [[gnu::vector_size(32)]] = double;
  for (Index i = 0;; i = std::min(i + kBlockRows, p.rows - kBlockRows)) {
    const Index first = p.upper_only ? std::min(i, p.columns - kBlockColumns) : 0;
    for (Index j = first;; j = std::min(j + kBlockColumns, p.columns - kBlockColumns)) {
      Four s00{}, s01{}, s10{}, s11{}, s20{}, s21{}, s30{}, s31{};
      const double* a = p.a + i * p.a_row;
      const double* b = p.b + j;
      for (Index k = 0; k < p.inner; ++k) {
        Four left, right;
        std::memcpy(&left, b, sizeof(Four));
        std::memcpy(&right, b + 4, sizeof(Four));
        s00 += a[0] * left;
        s01 += a[0] * right;
        s10 += a[p.a_row] * left;
        s11 += a[p.a_row] * right;
        s20 += a[2 * p.a_row] * left;
        s21 += a[2 * p.a_row] * right;
        s30 += a[3 * p.a_row] * left;
        s31 += a[3 * p.a_row] * right;
        a += p.a_column;
        b += p.b_row;
      }
      double* out = p.out + i * p.out_row + j;
      std::memcpy(out, &s00, sizeof(Four));
      std::memcpy(out + 4, &s01, sizeof(Four));
      std::memcpy(out + p.out_row, &s10, sizeof(Four));
      std::memcpy(out + p.out_row + 4, &s11, sizeof(Four));
      std::memcpy(out + 2 * p.out_row, &s20, sizeof(Four));
      std::memcpy(out + 2 * p.out_row + 4, &s21, sizeof(Four));
      std::memcpy(out + 3 * p.out_row, &s30, sizeof(Four));
      std::memcpy(out + 3 * p.out_row + 4, &s31, sizeof(Four));
      if (j == p.columns - kBlockColumns) break;
    }
    if (i == p.rows - kBlockRows) break;
  }
}

RowProduct TransposedInto(const StackedRows& a, const StackedRows& b, StackedRows* out) {
  RowProduct product;
  product.a = a.data();
  product.a_row = 1;
  product.a_column = a.cols();
  product.b = b.data();
  product.b_row = product.out_row = product.columns = b.cols();
  product.out = out->data();
  product.rows = a.cols();
  product.inner = a.rows();
  return product;
}

bool FillsABlock(const RowProduct& p) { return p.rows >= kBlockRows && p.columns >= kBlockColumns; }

}  // namespace

void AddTile(const RowTile& tile) {
  if (tile.rows == 3 && tile.cols == 3) {
    AddThreeByThree(tile);
    return;
  }
  for (int r = 0; r < tile.rows; ++r) {
    double* const out = tile.out + r * tile.out_stride;
    for (int c = 0; c < tile.cols; ++c) {
      const double factor = tile.factors[r + c * tile.factors_stride];
      const double* const in = tile.in + c * tile.in_stride;
#pragma GCC ivdep
      for (Index k = 0; k < tile.length; ++k) out[k] += factor * in[k];
    }
  }
}

Eigen::MatrixXd SymmetricProduct(const StackedRows& a, const StackedRows& b) {
  StackedRows out(a.cols(), b.cols());
  RowProduct product = TransposedInto(a, b, &out);
  product.upper_only = true;
  if (!FillsABlock(product)) return TransposeTimesRows(a, b);
  MultiplyInBlocks(product);
  return out.selfadjointView<Eigen::Upper>();
}

Eigen::MatrixXd TransposedProduct(const StackedRows& a, const StackedRows& b) {
  StackedRows out(a.cols(), b.cols());
  const RowProduct product = TransposedInto(a, b, &out);
  if (!FillsABlock(product)) return TransposeTimesRows(a, b);
  MultiplyInBlocks(product);
  return out;
}

StackedRows ProductOfRows(const StackedRows& a, const StackedRows& b) {
  StackedRows out;
  ProductOfRows(a, b, &out);
  return out;
}

void ProductOfRows(const StackedRows& a, const StackedRows& b, StackedRows* out) {
  out->resize(a.rows(), b.cols());
  const RowProduct product{a.data(),
                           a.cols(),
                           1,
                           b.data(),
                           b.cols(),
                           out->data(),
                           b.cols(),
                           a.rows(),
                           b.rows(),
                           b.cols()};
  if (FillsABlock(product)) {
    MultiplyInBlocks(product);
  } else {
    out->noalias() = a.leftCols(b.rows()) * b;
  }
}

}  // namespace truetriad
