// SPDX-License-Identifier: Apache-2.0
#include "problem/rows/field_row.h"

#include "problem/rows/attitude.h"
#include "truetriad/math/rotation.h"

namespace truetriad {

FieldRow::FieldRow(Triad triad, const SharedLayout& layout, PoseKind state, const Reading& reading)
    : Row(3),
      triad_(triad),
      state_(state),
      reading_(reading),
      triad_blocks_(layout, triad, reading.thermal) {
  AddFirstShared(triad_blocks_.blocks(), 1);
  AddShared({layout.reference, kReferenceSize});
  AddState(state == PoseKind::kDirection ? kDirectionSize : kAttitudeSize);
}

bool FieldRow::Evaluate(double const* const* parameters,
                        double* residuals,
                        double** jacobians) const {
  if (jacobians == nullptr) return (*this)(parameters, residuals);
  const std::size_t count = triad_blocks_.count();
  const double* state = parameters[count + 1];
  const TriadModel<double> model = triad_blocks_.ModelAt(parameters);
  const WorldVectorWithJacobian& world = WorldVectorAt(triad_, parameters[count]);
  const Eigen::Vector3d field = FieldInBody(world.vector, state);
  Eigen::Map<Eigen::Vector3d>{residuals} = model.RawFromTruth(field) - reading_.mean_raw;

  triad_blocks_.SetFieldJacobians(model, field, jacobians);
  const Eigen::Matrix3d by_field =
      model.Slope(model.sensitivity * field).asDiagonal() * model.sensitivity;
  double* const by_reference = jacobians[count];
  double* const by_state = jacobians[count + 1];
  using ReferenceJacobian = Eigen::Matrix<double, 3, kReferenceSize, Eigen::RowMajor>;
  if (state_ == PoseKind::kDirection) {
    const Eigen::Map<const Eigen::Vector3d> direction(state);
    if (by_reference != nullptr) {
      // Only the strength of the one field matters: d|v|/dp = v^T/|v| dv/dp.
      Eigen::Map<ReferenceJacobian> out(by_reference);
      out.noalias() =
          by_field * direction * (world.vector.normalized().transpose() * world.by_reference);
    }
    if (by_state != nullptr) {
      // Of a direction along the sphere; what is across it does not count.
      Eigen::Map<RowMajor33> out(by_state);
      out.noalias() = world.vector.norm() * by_field *
                      (Eigen::Matrix3d::Identity() - direction * direction.transpose());
    }
    return true;
  }
  const Eigen::Map<const Eigen::Quaterniond> world_from_body(state);
  const Eigen::Matrix3d body_from_world = world_from_body.conjugate().toRotationMatrix();
  const Eigen::Matrix3d by_vector = by_field * reading_.mean_turn;
  if (by_reference != nullptr) {
    Eigen::Map<ReferenceJacobian> out(by_reference);
    out.noalias() = by_vector * body_from_world * world.by_reference;
  }
  if (by_state != nullptr) {
    // (R Exp(d))^T v = x + [x]_x d with x = R^T v.
    Eigen::Map<RowMajor34> out(by_state);
    out.noalias() = by_vector * Skew(body_from_world * world.vector) * TangentFromQuaternion(state);
  }
  return true;
}

}  // namespace truetriad
