// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include <Eigen/Cholesky>
#include <Eigen/Core>

namespace truetriad {

// Eigen's Cholesky factors of matrices of run-time size, compiled once.

/// A = L L^T of a symmetric positive definite matrix, of which the lower triangle is read.
class Cholesky {
 public:
  Cholesky();
  explicit Cholesky(const Eigen::MatrixXd& A);

  /// Whether A is positive definite; the functions below are meant only for such an A.
  bool is_positive() const;
  /// Estimate of 1 / (|A| |A^-1|) in the 1-norm.
  double ReciprocalCondition() const;
  /// L.
  Eigen::MatrixXd Root() const;
  /// Diagonal of L.
  Eigen::VectorXd Diagonal() const;
  double LogDeterminant() const;

  /// A^-1 B.
  Eigen::MatrixXd Solve(const Eigen::MatrixXd& B) const;
  Eigen::VectorXd SolveVector(const Eigen::VectorXd& b) const;
  Eigen::MatrixXd Inverse() const;
  /// L^-1 B.
  Eigen::MatrixXd SolveLower(const Eigen::MatrixXd& B) const;
  Eigen::VectorXd SolveLowerVector(const Eigen::VectorXd& b) const;
  /// L^-T b.
  Eigen::VectorXd SolveUpperVector(const Eigen::VectorXd& b) const;

 private:
  Eigen::LLT<Eigen::MatrixXd> factor_;
};

/// A = P^T L D L^T P, which also exists for semidefinite matrices.
class PivotedCholesky {
 public:
  explicit PivotedCholesky(const Eigen::MatrixXd& A);
  Eigen::MatrixXd Solve(const Eigen::MatrixXd& B) const;
  Eigen::VectorXd SolveVector(const Eigen::VectorXd& b) const;
  Eigen::MatrixXd Inverse() const;

 private:
  Eigen::LDLT<Eigen::MatrixXd> factor_;
};

/// L of A = L L^T; meaningless if A is not positive definite.
Eigen::Matrix3d CholeskyRoot(const Eigen::Matrix3d& A);

/// L if A is positive definite, else nullopt.
std::optional<Eigen::Matrix3d> CholeskyRootOfPositive(const Eigen::Matrix3d& A);

/// L^-1.
Eigen::Matrix3d InverseCholeskyRoot(const Eigen::Matrix3d& A);

/// L^-T.
Eigen::Matrix3d InverseCholeskyRootTransposed(const Eigen::Matrix3d& A);

/// A^-1 b by the pivoted factor.
Eigen::Vector3d SolveSymmetric3(const Eigen::Matrix3d& A, const Eigen::Vector3d& b);

Eigen::Matrix<double, 3, 2> SolveSymmetric32(const Eigen::Matrix3d& A,
                                             const Eigen::Matrix<double, 3, 2>& B);

/// A^-1, computed from the Cholesky factor of A.
Eigen::Matrix3d InverseOfPositive(const Eigen::Matrix3d& A);

}  // namespace truetriad
