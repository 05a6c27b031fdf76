// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

namespace truetriad {

// Rows of several factors or poses, one after another.
using StackedRows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// out += sign * a * b for a small `a` and long rows of `b` and `out`: a row at a time, where a
// general product would spend most of its time on packing. Zeros of `a` cost nothing.
template <typename Small, typename In, typename Out>
void AddProduct(double sign, const Small& a, const In& b, Out&& out) {
  for (Eigen::Index i = 0; i < a.rows(); ++i) {
    for (Eigen::Index j = 0; j < a.cols(); ++j) {
      const double factor = sign * a(i, j);
      if (factor != 0.0) out.row(i) += factor * b.row(j);
    }
  }
}

}  // namespace truetriad
