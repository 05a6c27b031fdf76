// SPDX-License-Identifier: Apache-2.0
#include "solve/shared_information.h"

#include <utility>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

namespace truetriad {
namespace {

// Eigenvalues of the scaled information below this share of the largest are rounding: the
// elimination squares the condition number, so half the digits of a double remain.
constexpr double kRankTolerance = 1e-14;

// A matrix with unit diagonal whose Cholesky pivots all stay above this is far from singular by the
// measure above.
constexpr double kSafePivot = 1e-5;

}  // namespace

std::optional<ScaledFactor> SafeFactorOf(const Eigen::MatrixXd& matrix) {
  ScaledFactor scaled;
  scaled.per_own = matrix.diagonal().cwiseSqrt().cwiseInverse();
  if (matrix.rows() == 0 || !scaled.per_own.allFinite()) return std::nullopt;
  scaled.factor.compute(scaled.per_own.asDiagonal() * matrix * scaled.per_own.asDiagonal());
  const bool is_safe = scaled.factor.info() == Eigen::Success &&
                       scaled.factor.matrixLLT().diagonal().minCoeff() > kSafePivot;
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
    covariance_ = scaled->per_own.asDiagonal() *
                  scaled->factor.solve(Eigen::MatrixXd::Identity(n, n)) *
                  scaled->per_own.asDiagonal();
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
    const Eigen::MatrixXd scaled_vectors = scale_.asDiagonal() * vectors;
    covariance_ = scaled_vectors * inverse.asDiagonal() * scaled_vectors.transpose();
  }
  step_ = -covariance_ * gradient;
}

SharedInformation::Spectrum SharedInformation::FindSpectrum() const {
  if (size() == 0) return {};
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(scale_.asDiagonal() * matrix_ *
                                                              scale_.asDiagonal());
  return {solver.eigenvalues(), solver.eigenvectors()};
}

}  // namespace truetriad
