// SPDX-License-Identifier: Apache-2.0
#include "estimation/shared_information.h"

#include <utility>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

namespace truetriad {
namespace {

// Eigenvalues of the scaled information below this share of the largest are rounding: the
// elimination squares the condition number, so half the digits of a double remain.
constexpr double kRankTolerance = 1e-14;

// A matrix with unit diagonal whose Cholesky pivots all stay above this is far from singular by the
// measure above: eigenvalues need not be looked at.
constexpr double kSafePivot = 1e-5;

}  // namespace

SharedInformation::SharedInformation(const SharedLayout& layout,
                                     const Eigen::VectorXd& shared,
                                     Eigen::MatrixXd information,
                                     const Eigen::VectorXd& gradient)
    : matrix_(std::move(information)) {
  scale_ = (TypicalSizes(layout, shared).asDiagonal() * layout.basis).colwise().norm();
  const Eigen::Index n = matrix_.rows();
  if (n == 0) return;
  // In units of each coordinate's own σ if it were the only one.
  const Eigen::VectorXd own = matrix_.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::LLT<Eigen::MatrixXd> factor(own.asDiagonal() * matrix_ * own.asDiagonal());
  if (own.allFinite() && factor.info() == Eigen::Success &&
      factor.matrixLLT().diagonal().minCoeff() > kSafePivot) {
    rank_ = static_cast<int>(n);
    covariance_ =
        own.asDiagonal() * factor.solve(Eigen::MatrixXd::Identity(n, n)) * own.asDiagonal();
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
