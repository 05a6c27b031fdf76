// SPDX-License-Identifier: Apache-2.0
#include "solve/shared_information.h"

#include <cmath>
#include <utility>

#include "math/dense/eigenvalues.h"
#include "math/dense/products.h"

namespace truetriad {
namespace {

// Eigenvalues of the scaled information below this share of the largest count as rounding errors.
// Information is 1 / σ², so that 1e-14 corresponds to 1e-7 in σ, half the digits of a double.
constexpr double kRankTolerance = 1e-14;

// If the Cholesky diagonal of a matrix with unit diagonal stays above this, all pivots are above
// 1e-10, far from the rank tolerance.
constexpr double kSafePivot = 1e-5;

}  // namespace

std::optional<ScaledFactor> SafeFactorOf(const Eigen::MatrixXd& matrix) {
  ScaledFactor scaled;
  scaled.per_own = matrix.diagonal().cwiseSqrt().cwiseInverse();
  if (matrix.rows() == 0 || !scaled.per_own.allFinite()) return std::nullopt;
  scaled.factor = Cholesky(ScaledBothSides(scaled.per_own, matrix));
  const bool is_safe =
      scaled.factor.is_positive() && scaled.factor.Diagonal().minCoeff() > kSafePivot;
  if (!is_safe) return std::nullopt;
  return scaled;
}

SharedInformation::SharedInformation(const SharedLayout& layout,
                                     const Eigen::VectorXd& shared,
                                     Eigen::MatrixXd information,
                                     const Eigen::VectorXd& gradient)
    : matrix_(std::move(information)) {
  scale_ = (TypicalSizes(layout, shared).asDiagonal() * layout.basis).colwise().norm();
  const Eigen::Index n = matrix_.rows();
  if (n == 0) return;
  if (const auto scaled = SafeFactorOf(matrix_)) {
    rank_ = static_cast<int>(n);
    is_regular_ = true;
    covariance_ = ScaledBothSides(scaled->per_own, scaled->factor.Inverse());
    covariance_ = 0.5 * (covariance_ + covariance_.transpose()).eval();
  } else {
    const auto [values, vectors] = FindSpectrum();
    const double largest = values.maxCoeff();
    Eigen::VectorXd inverse = Eigen::VectorXd::Zero(n);
    for (Eigen::Index i = 0; i < n; ++i) {
      if (values[i] > kRankTolerance * largest) {
        inverse[i] = 1.0 / values[i];
        ++rank_;
      }
    }
    const Eigen::MatrixXd scaled_vectors = ScaledRows(scale_, vectors);
    covariance_ = TimesTranspose(scaled_vectors * inverse.asDiagonal(), scaled_vectors);
  }
  step_ = -TimesVector(covariance_, gradient);
}

SymmetricEigen SharedInformation::FindSpectrum() const {
  if (size() == 0) return {};
  return EigenOfSymmetric(ScaledBothSides(scale_, matrix_));
}

Eigen::ArrayXd VariancesOf(const SharedLayout& layout, const Eigen::MatrixXd& covariance) {
  // Zeros are skipped: most rows of the basis have one entry.
  Eigen::ArrayXd variances = Eigen::ArrayXd::Zero(layout.basis.rows());
  for (Eigen::Index row = 0; row < layout.basis.rows(); ++row) {
    const auto own = layout.basis.row(row);
    for (Eigen::Index i = 0; i < own.size(); ++i) {
      if (own[i] != 0.0) variances[row] += own[i] * own.dot(covariance.col(i));
    }
  }
  return variances;
}

double LargestInSigmas(const SharedLayout& layout,
                       const Eigen::MatrixXd& covariance,
                       const Eigen::MatrixXd& moves) {
  if (covariance.rows() == 0) return 0.0;
  const Eigen::ArrayXd variances = VariancesOf(layout, covariance);
  const Eigen::ArrayXd squares = Times(layout.basis, moves).rowwise().squaredNorm();
  return std::sqrt((variances > 0.0).select(squares / variances.max(1e-300), 0.0).maxCoeff());
}

}  // namespace truetriad
