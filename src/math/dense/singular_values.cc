// SPDX-License-Identifier: Apache-2.0
#include <Eigen/SVD>

#include "math/dense/eigenvalues.h"

namespace truetriad {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::VectorXd;

Svd3 SvdOf3(const Matrix3d& A) {
  const Eigen::JacobiSVD<Matrix3d> svd(A, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return {svd.matrixU(), svd.singularValues(), svd.matrixV()};
}

SvdSolution SolveBySvd(const MatrixXd& A, const VectorXd& b) {
  const Eigen::JacobiSVD<MatrixXd> svd(A, Eigen::ComputeThinU | Eigen::ComputeThinV);
  return {svd.singularValues(), svd.solve(b)};
}

VectorXd SingularValues(const MatrixXd& A) {
  return Eigen::JacobiSVD<MatrixXd>(A).singularValues();
}

}  // namespace truetriad
