// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

namespace truetriad {

// Products of matrices of run-time size as plain functions: Eigen's are templates that every file
// would compile anew, which takes most of its compile time. Blocks are passed without a copy; other
// expressions are evaluated first. Products of fixed size stay with Eigen.

using ConstMatrixRef = Eigen::Ref<const Eigen::MatrixXd>;
using ConstVectorRef = Eigen::Ref<const Eigen::VectorXd>;
using ConstRowsRef =
    Eigen::Ref<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>;

/// A B.
Eigen::MatrixXd Times(const ConstMatrixRef& A, const ConstMatrixRef& B);

/// A^T B.
Eigen::MatrixXd TransposeTimes(const ConstMatrixRef& A, const ConstMatrixRef& B);

/// A^T B of matrices that are stored row by row.
Eigen::MatrixXd TransposeTimesRows(const ConstRowsRef& A, const ConstRowsRef& B);

/// A B^T.
Eigen::MatrixXd TimesTranspose(const ConstMatrixRef& A, const ConstMatrixRef& B);

/// A v.
Eigen::VectorXd TimesVector(const ConstMatrixRef& A, const ConstVectorRef& v);

/// A^T v.
Eigen::VectorXd TransposeTimesVector(const ConstMatrixRef& A, const ConstVectorRef& v);

/// J M J^T.
Eigen::MatrixXd Congruence(const ConstMatrixRef& J, const ConstMatrixRef& M);

/// J^T M J.
Eigen::MatrixXd TransposedCongruence(const ConstMatrixRef& J, const ConstMatrixRef& M);

/// v^T M v.
double QuadraticForm(const ConstMatrixRef& M, const ConstVectorRef& v);

/// diag(d) M diag(d).
Eigen::MatrixXd ScaledBothSides(const ConstVectorRef& d, const ConstMatrixRef& M);

/// diag(d) M.
Eigen::MatrixXd ScaledRows(const ConstVectorRef& d, const ConstMatrixRef& M);

}  // namespace truetriad
