// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/QR>

namespace truetriad {

// Eigen's QR factors of matrices of run-time size, compiled once.

/// Least squares for design * x = values by QR with column pivoting.
class LeastSquares {
 public:
  explicit LeastSquares(const Eigen::MatrixXd& design);
  /// Pivots smaller than `threshold` times the largest pivot count as zero.
  LeastSquares(const Eigen::MatrixXd& design, double threshold);

  Eigen::Index rank() const;
  /// An orthonormal basis of the complement of the design's columns.
  Eigen::MatrixXd Complement() const;
  Eigen::MatrixXd Solve(const Eigen::MatrixXd& values) const;
  Eigen::VectorXd SolveVector(const Eigen::VectorXd& values) const;

 private:
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr_;
};

/// A = Q R.
struct Qr3 {
  Eigen::Matrix3d Q, R;
};
Qr3 QrOf3(const Eigen::Matrix3d& A);

/// R of A = Q R, without the rows that are zero.
Eigen::MatrixXd UpperTriangle(const Eigen::MatrixXd& A);

/// Q^T B with the square Q of A = Q R: A can explain only its first A.cols() rows.
Eigen::MatrixXd InFrameOf(const Eigen::MatrixXd& A, Eigen::MatrixXd B);

}  // namespace truetriad
