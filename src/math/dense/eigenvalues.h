// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

namespace truetriad {

// Eigen's eigenvalues and singular values, compiled once.

/// A = V diag(values) V^T of a symmetric matrix (the lower triangle is read); values ascend.
struct SymmetricEigen {
  Eigen::VectorXd values;
  Eigen::MatrixXd vectors;
};
SymmetricEigen EigenOfSymmetric(const Eigen::MatrixXd& A);

struct SymmetricEigen3 {
  Eigen::Vector3d values;
  Eigen::Matrix3d vectors;
};
SymmetricEigen3 EigenOfSymmetric3(const Eigen::Matrix3d& A);

/// A^-1/2 of a symmetric positive definite matrix.
Eigen::Matrix3d InverseSquareRoot3(const Eigen::Matrix3d& A);

/// Those eigenvectors of a matrix that are real, in the order in which they are found.
using Vector6d = Eigen::Matrix<double, 6, 1>;
std::vector<Vector6d> RealEigenvectors(const Eigen::Matrix<double, 6, 6>& A);

/// A = U diag(values) V^T; values descend.
struct Svd3 {
  Eigen::Matrix3d U;
  Eigen::Vector3d values;
  Eigen::Matrix3d V;
};
Svd3 SvdOf3(const Eigen::Matrix3d& A);

/// The singular values of A, and the shortest x that minimises |A x - b|.
struct SvdSolution {
  Eigen::VectorXd values;
  Eigen::VectorXd x;
};
SvdSolution SolveBySvd(const Eigen::MatrixXd& A, const Eigen::VectorXd& b);
Eigen::VectorXd SingularValues(const Eigen::MatrixXd& A);

}  // namespace truetriad
