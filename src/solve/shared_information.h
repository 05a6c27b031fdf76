// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include <Eigen/Core>

#include "math/dense/cholesky.h"
#include "math/dense/eigenvalues.h"
#include "problem/graph.h"

namespace truetriad {

// Cholesky factor of a matrix scaled to unit diagonal: per_own * matrix * per_own.
struct ScaledFactor {
  Eigen::VectorXd per_own;  // one over the square roots of the diagonal
  Cholesky factor;
};
// The factor of the scaled matrix; unset if the matrix is nearly singular, since only its
// eigenvalues then show the rank.
std::optional<ScaledFactor> SafeFactorOf(const Eigen::MatrixXd& matrix);

// The information of all factors on the free shared coordinates, after the attitudes are
// eliminated.
class SharedInformation {
 public:
  SharedInformation() = default;
  // `information` M and `gradient` of half the sum of squares, in free coordinates.
  SharedInformation(const SharedLayout& layout,
                    const Eigen::VectorXd& shared,
                    Eigen::MatrixXd information,
                    const Eigen::VectorXd& gradient);

  int size() const { return static_cast<int>(matrix_.rows()); }
  const Eigen::MatrixXd& matrix() const { return matrix_; }
  // M^-1; an undetermined direction (see `rank`) has zero variance here.
  const Eigen::MatrixXd& covariance() const { return covariance_; }
  // Eigenvalues of M in typical units (TypicalSizes), ascending, and their vectors; each call
  // computes them.
  SymmetricEigen FindSpectrum() const;
  // Typical size of each free coordinate.
  const Eigen::VectorXd& scale() const { return scale_; }
  int rank() const { return rank_; }
  // Whether the information of every direction is far above rounding, even if the σ of the
  // parameters differ by orders of magnitude.
  bool is_regular() const { return is_regular_; }
  // The Gauss-Newton step; near zero at the optimum.
  const Eigen::VectorXd& step() const { return step_; }

 private:
  Eigen::MatrixXd matrix_, covariance_;
  Eigen::VectorXd scale_, step_;
  int rank_ = 0;
  bool is_regular_ = false;
};

// Variances of all shared entries, computed from the covariance of the free coordinates.
Eigen::ArrayXd VariancesOf(const SharedLayout& layout, const Eigen::MatrixXd& covariance);

// The largest change of a shared entry, in σ of that entry, if the free coordinates change by the
// columns of `moves` independently: the root of the sum of squares over the columns. Entries
// without a variance are skipped.
double LargestInSigmas(const SharedLayout& layout,
                       const Eigen::MatrixXd& covariance,
                       const Eigen::MatrixXd& moves);

}  // namespace truetriad
