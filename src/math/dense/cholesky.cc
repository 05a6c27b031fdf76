// SPDX-License-Identifier: Apache-2.0
#include "math/dense/cholesky.h"

namespace truetriad {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::VectorXd;

Cholesky::Cholesky() = default;

Cholesky::Cholesky(const MatrixXd& A) : factor_(A) {}

bool Cholesky::is_positive() const { return factor_.info() == Eigen::Success; }

double Cholesky::ReciprocalCondition() const { return factor_.rcond(); }

MatrixXd Cholesky::Root() const { return factor_.matrixL(); }

VectorXd Cholesky::Diagonal() const { return factor_.matrixLLT().diagonal(); }

double Cholesky::LogDeterminant() const {
  return 2.0 * factor_.matrixLLT().diagonal().array().log().sum();
}

MatrixXd Cholesky::Solve(const MatrixXd& B) const { return factor_.solve(B); }

VectorXd Cholesky::SolveVector(const VectorXd& b) const { return factor_.solve(b); }

MatrixXd Cholesky::Inverse() const {
  return Solve(MatrixXd::Identity(factor_.rows(), factor_.cols()));
}

MatrixXd Cholesky::SolveLower(const MatrixXd& B) const { return factor_.matrixL().solve(B); }

VectorXd Cholesky::SolveLowerVector(const VectorXd& b) const { return factor_.matrixL().solve(b); }

VectorXd Cholesky::SolveUpperVector(const VectorXd& b) const { return factor_.matrixU().solve(b); }

PivotedCholesky::PivotedCholesky(const MatrixXd& A) : factor_(A) {}

MatrixXd PivotedCholesky::Solve(const MatrixXd& B) const { return factor_.solve(B); }

VectorXd PivotedCholesky::SolveVector(const VectorXd& b) const { return factor_.solve(b); }

MatrixXd PivotedCholesky::Inverse() const {
  return Solve(MatrixXd::Identity(factor_.rows(), factor_.cols()));
}

Matrix3d CholeskyRoot(const Matrix3d& A) { return Eigen::LLT<Matrix3d>(A).matrixL(); }

std::optional<Matrix3d> CholeskyRootOfPositive(const Matrix3d& A) {
  const Eigen::LLT<Matrix3d> factor(A);
  if (factor.info() != Eigen::Success) return std::nullopt;
  return Matrix3d(factor.matrixL());
}

Eigen::Vector3d SolveSymmetric3(const Matrix3d& A, const Eigen::Vector3d& b) {
  return A.ldlt().solve(b);
}

Eigen::Matrix<double, 3, 2> SolveSymmetric32(const Matrix3d& A,
                                             const Eigen::Matrix<double, 3, 2>& B) {
  return A.ldlt().solve(B);
}

Matrix3d InverseCholeskyRoot(const Matrix3d& A) {
  return Eigen::LLT<Matrix3d>(A).matrixL().solve(Matrix3d::Identity());
}

Matrix3d InverseCholeskyRootTransposed(const Matrix3d& A) {
  return Eigen::LLT<Matrix3d>(A).matrixU().solve(Matrix3d::Identity());
}

Matrix3d InverseOfPositive(const Matrix3d& A) {
  return Eigen::LLT<Matrix3d>(A).solve(Matrix3d::Identity());
}

}  // namespace truetriad
