// SPDX-License-Identifier: Apache-2.0
#include "math/dense/qr.h"

#include <algorithm>

namespace truetriad {

using Eigen::MatrixXd;
using Eigen::VectorXd;

LeastSquares::LeastSquares(const MatrixXd& design) : qr_(design) {}

LeastSquares::LeastSquares(const MatrixXd& design, double threshold)
    : qr_(design.rows(), design.cols()) {
  qr_.setThreshold(threshold);
  qr_.compute(design);
}

Eigen::Index LeastSquares::rank() const { return qr_.rank(); }

MatrixXd LeastSquares::Complement() const {
  const MatrixXd all = qr_.householderQ();
  return all.rightCols(all.cols() - qr_.rank());
}

MatrixXd LeastSquares::Solve(const MatrixXd& values) const { return qr_.solve(values); }

VectorXd LeastSquares::SolveVector(const VectorXd& values) const { return qr_.solve(values); }

Qr3 QrOf3(const Eigen::Matrix3d& A) {
  const Eigen::HouseholderQR<Eigen::Matrix3d> qr(A);
  return {qr.householderQ(), qr.matrixQR().triangularView<Eigen::Upper>()};
}

MatrixXd UpperTriangle(const MatrixXd& A) {
  const Eigen::HouseholderQR<MatrixXd> qr(A);
  return qr.matrixQR().topRows(std::min(A.rows(), A.cols())).triangularView<Eigen::Upper>();
}

MatrixXd InFrameOf(const MatrixXd& A, MatrixXd B) {
  const Eigen::HouseholderQR<MatrixXd> qr(A);
  B.applyOnTheLeft(qr.householderQ().adjoint());
  return B;
}

}  // namespace truetriad
