// SPDX-License-Identifier: Apache-2.0
#include "problem/rows/known_speed_row.h"

#include "problem/rows/attitude.h"

namespace truetriad {

bool KnownSpeedRow::Evaluate(double const* const* parameters,
                             double* residuals,
                             double** jacobians) const {
  (*this)(parameters, residuals);
  if (jacobians == nullptr) return true;
  const TriadModel<double> model = triad_blocks().ModelAt(parameters);
  const Eigen::Map<const Eigen::Vector3d> axis(parameters[shared_count()]);
  const Eigen::Vector3d rate = speed_radps_ * axis;
  SetSharedJacobians(model, rate, jacobians);
  if (double* by_axis = jacobians[shared_count()]; by_axis != nullptr) {
    const Eigen::Vector3d slope = model.Slope(model.sensitivity * rate);
    // The derivative for changes along the sphere: the part normal to the sphere is removed.
    Eigen::Map<RowMajor33>{by_axis} = speed_radps_ * slope.asDiagonal() * model.sensitivity *
                                      (Eigen::Matrix3d::Identity() - axis * axis.transpose());
  }
  return true;
}

}  // namespace truetriad
