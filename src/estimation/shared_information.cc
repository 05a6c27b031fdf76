// SPDX-License-Identifier: Apache-2.0
#include "estimation/shared_information.h"

#include <utility>

#include <Eigen/Eigenvalues>

namespace truetriad {
namespace {

// Eigenvalues of the scaled information below this share of the largest are rounding: the
// elimination squares the condition number, so half the digits of a double remain.
constexpr double kRankTolerance = 1e-14;

}  // namespace

SharedInformation::SharedInformation(const SharedLayout& layout,
                                     const Eigen::VectorXd& shared,
                                     Eigen::MatrixXd information,
                                     const Eigen::VectorXd& gradient)
    : matrix_(std::move(information)) {
  scale_ = (TypicalSizes(layout, shared).asDiagonal() * layout.basis).colwise().norm();
  if (matrix_.rows() == 0) return;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(scale_.asDiagonal() * matrix_ *
                                                              scale_.asDiagonal());
  eigenvalues_ = solver.eigenvalues();
  eigenvectors_ = solver.eigenvectors();
  const double largest = eigenvalues_.size() > 0 ? eigenvalues_.maxCoeff() : 0.0;
  Eigen::VectorXd inverse = Eigen::VectorXd::Zero(eigenvalues_.size());
  for (Eigen::Index i = 0; i < inverse.size(); ++i) {
    if (eigenvalues_[i] > kRankTolerance * largest) {
      inverse[i] = 1.0 / eigenvalues_[i];
      ++rank_;
    }
  }
  const Eigen::MatrixXd scaled_vectors = scale_.asDiagonal() * eigenvectors_;
  covariance_ = scaled_vectors * inverse.asDiagonal() * scaled_vectors.transpose();
  step_ = -covariance_ * gradient;
}

}  // namespace truetriad
