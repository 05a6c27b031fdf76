// SPDX-License-Identifier: Apache-2.0
#include "math/dense/eigenvalues.h"

#include <Eigen/Eigenvalues>

namespace truetriad {

using Eigen::Matrix3d;
using Eigen::MatrixXd;

SymmetricEigen EigenOfSymmetric(const MatrixXd& A) {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(A);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

SymmetricEigen3 EigenOfSymmetric3(const Matrix3d& A) {
  const Eigen::SelfAdjointEigenSolver<Matrix3d> solver(A);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

Matrix3d InverseSquareRoot3(const Matrix3d& A) {
  return Eigen::SelfAdjointEigenSolver<Matrix3d>(A).operatorInverseSqrt();
}

std::vector<Vector6d> RealEigenvectors(const Eigen::Matrix<double, 6, 6>& A) {
  const Eigen::EigenSolver<Eigen::Matrix<double, 6, 6>> solver(A);
  std::vector<Vector6d> vectors;
  if (solver.info() != Eigen::Success) return vectors;
  const auto all = solver.eigenvectors();
  for (int i = 0; i < 6; ++i) {
    if (all.col(i).imag().norm() == 0.0) vectors.emplace_back(all.col(i).real());
  }
  return vectors;
}

}  // namespace truetriad
