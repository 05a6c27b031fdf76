// SPDX-License-Identifier: Apache-2.0
#include "math/dense/products.h"

namespace truetriad {

using Eigen::MatrixXd;
using Eigen::VectorXd;

MatrixXd Times(const ConstMatrixRef& A, const ConstMatrixRef& B) { return A * B; }

MatrixXd TransposeTimes(const ConstMatrixRef& A, const ConstMatrixRef& B) {
  return A.transpose() * B;
}

MatrixXd TransposeTimesRows(const ConstRowsRef& A, const ConstRowsRef& B) {
  return A.transpose() * B;
}

MatrixXd TimesTranspose(const ConstMatrixRef& A, const ConstMatrixRef& B) {
  return A * B.transpose();
}

VectorXd TimesVector(const ConstMatrixRef& A, const ConstVectorRef& v) { return A * v; }

VectorXd TransposeTimesVector(const ConstMatrixRef& A, const ConstVectorRef& v) {
  return A.transpose() * v;
}

MatrixXd Congruence(const ConstMatrixRef& J, const ConstMatrixRef& M) {
  return TimesTranspose(Times(J, M), J);
}

MatrixXd TransposedCongruence(const ConstMatrixRef& J, const ConstMatrixRef& M) {
  return Times(TransposeTimes(J, M), J);
}

double QuadraticForm(const ConstMatrixRef& M, const ConstVectorRef& v) {
  return v.dot(TimesVector(M, v));
}

MatrixXd ScaledBothSides(const ConstVectorRef& d, const ConstMatrixRef& M) {
  return d.asDiagonal() * M * d.asDiagonal();
}

MatrixXd ScaledRows(const ConstVectorRef& d, const ConstMatrixRef& M) { return d.asDiagonal() * M; }

}  // namespace truetriad
