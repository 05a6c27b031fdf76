// SPDX-License-Identifier: Apache-2.0
#include "math/dense/lu.h"

namespace truetriad {

using Eigen::MatrixXd;
using Eigen::VectorXd;

MatrixXd InverseByLu(const MatrixXd& A) { return Eigen::FullPivLU<MatrixXd>(A).inverse(); }

VectorXd SolveByLu(const MatrixXd& A, const VectorXd& b) {
  return Eigen::FullPivLU<MatrixXd>(A).solve(b);
}

PivotedLu::PivotedLu(const MatrixXd& A) : factor_(A) {}

bool PivotedLu::is_invertible() const { return factor_.isInvertible(); }

MatrixXd PivotedLu::Solve(const MatrixXd& B) const { return factor_.solve(B); }

Eigen::Vector4d SolveUpper4(const Eigen::Matrix4d& R, const Eigen::Vector4d& b) {
  return R.triangularView<Eigen::Upper>().solve(b);
}

Eigen::Vector3d Solve3(const Eigen::Matrix3d& A, const Eigen::Vector3d& b) {
  return A.partialPivLu().solve(b);
}

}  // namespace truetriad
