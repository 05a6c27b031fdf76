// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/LU>

namespace truetriad {

// Eigen's LU factors with full pivoting, compiled once.

/// A^-1; meaningless if A is singular.
Eigen::MatrixXd InverseByLu(const Eigen::MatrixXd& A);

/// A solution of A x = b.
Eigen::VectorXd SolveByLu(const Eigen::MatrixXd& A, const Eigen::VectorXd& b);

/// The LU factors of a matrix, to solve several systems with it.
class PivotedLu {
 public:
  explicit PivotedLu(const Eigen::MatrixXd& A);
  bool is_invertible() const;
  Eigen::MatrixXd Solve(const Eigen::MatrixXd& B) const;

 private:
  Eigen::FullPivLU<Eigen::MatrixXd> factor_;
};

/// R^-1 b of an upper triangle; entries below the diagonal are not read.
Eigen::Vector4d SolveUpper4(const Eigen::Matrix4d& R, const Eigen::Vector4d& b);

/// A^-1 b, with partial pivoting.
Eigen::Vector3d Solve3(const Eigen::Matrix3d& A, const Eigen::Vector3d& b);

}  // namespace truetriad
