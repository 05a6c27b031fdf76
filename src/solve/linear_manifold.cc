// SPDX-License-Identifier: Apache-2.0
#include "solve/linear_manifold.h"

namespace truetriad {
namespace {

using RowMajorMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

}  // namespace

bool LinearManifold::Plus(const double* x, const double* delta, double* x_plus_delta) const {
  Eigen::Map<Eigen::VectorXd>(x_plus_delta, basis_.rows()) =
      Eigen::Map<const Eigen::VectorXd>(x, basis_.rows()) +
      basis_ * Eigen::Map<const Eigen::VectorXd>(delta, basis_.cols());
  return true;
}

bool LinearManifold::PlusJacobian(const double* /*x*/, double* jacobian) const {
  Eigen::Map<RowMajorMatrix>(jacobian, basis_.rows(), basis_.cols()) = basis_;
  return true;
}

bool LinearManifold::Minus(const double* y, const double* x, double* y_minus_x) const {
  Eigen::Map<Eigen::VectorXd>(y_minus_x, basis_.cols()) =
      basis_.transpose() * (Eigen::Map<const Eigen::VectorXd>(y, basis_.rows()) -
                            Eigen::Map<const Eigen::VectorXd>(x, basis_.rows()));
  return true;
}

bool LinearManifold::MinusJacobian(const double* /*x*/, double* jacobian) const {
  Eigen::Map<RowMajorMatrix>(jacobian, basis_.cols(), basis_.rows()) = basis_.transpose();
  return true;
}

}  // namespace truetriad
