// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>

#include <Eigen/Core>
#include <ceres/manifold.h>

namespace truetriad {

// Parameters that are restricted to a linear subspace: x + basis * delta. The row of a held entry
// in `basis` is zero; entries that are tied to each other share a column.
class LinearManifold final : public ceres::Manifold {
 public:
  // The columns of `basis` must be orthonormal.
  explicit LinearManifold(Eigen::MatrixXd basis) : basis_(std::move(basis)) {}
  int AmbientSize() const override { return static_cast<int>(basis_.rows()); }
  int TangentSize() const override { return static_cast<int>(basis_.cols()); }
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override;
  bool PlusJacobian(const double* x, double* jacobian) const override;
  bool Minus(const double* y, const double* x, double* y_minus_x) const override;
  bool MinusJacobian(const double* x, double* jacobian) const override;

 private:
  Eigen::MatrixXd basis_;
};

}  // namespace truetriad
