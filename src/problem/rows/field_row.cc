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
  AddFirstShared(triad_blocks_.blocks(), reading.turning == nullptr ? 1 : 3);
  AddShared({layout.reference, kReferenceSize});
  if (reading.turning != nullptr) {
    AddShared({layout.bias[Triad::kGyroscope], 3});
    AddShared({layout.sensitivity[Triad::kGyroscope], 9});
  }
  AddState(state == PoseKind::kDirection ? kDirectionSize : kAttitudeSize);
}

bool FieldRow::Evaluate(double const* const* parameters,
                        double* residuals,
                        double** jacobians) const {
  if (jacobians == nullptr) return (*this)(parameters, residuals);
  const std::size_t count = triad_blocks_.count();
  double const* const* const gyroscope = parameters + count + 1;
  const double* const state = StateOf(parameters);
  const TriadModel<double> model = triad_blocks_.ModelAt(parameters);
  const WorldVectorWithJacobian& world = WorldVectorAt(triad_, parameters[count]);
  const Eigen::Vector3d rate_change = RateChange(gyroscope);
  const Eigen::Vector3d field = FieldInBody(world.vector, rate_change, state);
  Eigen::Map<Eigen::Vector3d>{residuals} = model.RawFromTruth(field) - reading_.mean_raw;

  triad_blocks_.SetFieldJacobians(model, field, jacobians);
  const Eigen::Matrix3d by_field =
      model.Slope(model.sensitivity * field).asDiagonal() * model.sensitivity;
  double* const by_reference = jacobians[count];
  double* const by_state = jacobians[shared_blocks().size()];
  using ReferenceJacobian = Eigen::Matrix<double, 3, kReferenceSize, Eigen::RowMajor>;
  if (state_ == PoseKind::kDirection) {
    const Eigen::Map<const Eigen::Vector3d> direction(state);
    if (by_reference != nullptr) {
      // Only the field's strength |v| matters here: d|v|/dp = v^T/|v| dv/dp.
      Eigen::Map<ReferenceJacobian> out(by_reference);
      out.noalias() =
          by_field * direction * (world.vector.normalized().transpose() * world.by_reference);
    }
    if (by_state != nullptr) {
      // The derivative for changes along the sphere: the part normal to the sphere is removed.
      Eigen::Map<RowMajor33> out(by_state);
      out.noalias() = world.vector.norm() * by_field *
                      (Eigen::Matrix3d::Identity() - direction * direction.transpose());
    }
    return true;
  }
  const Eigen::Map<const Eigen::Quaterniond> world_from_body(state);
  const Eigen::Matrix3d body_from_world = world_from_body.conjugate().toRotationMatrix();
  const Eigen::Matrix3d by_vector = by_field * TurnAt(rate_change);
  if (by_reference != nullptr) {
    Eigen::Map<ReferenceJacobian> out(by_reference);
    out.noalias() = by_vector * body_from_world * world.by_reference;
  }
  if (by_state != nullptr) {
    // (R Exp(d))^T v = x + [x]_x d with x = R^T v.
    Eigen::Map<RowMajor34> out(by_state);
    out.noalias() = by_vector * Skew(body_from_world * world.vector) * TangentFromQuaternion(state);
  }
  if (reading_.turning != nullptr) {
    SetGyroscopeJacobians(
        by_field, body_from_world * world.vector, rate_change, gyroscope[1], jacobians + count + 1);
  }
  return true;
}

Eigen::Matrix3d FieldRow::TurnAt(const Eigen::Vector3d& rate_change) const {
  Eigen::Matrix3d turn = reading_.mean_turn;
  if (reading_.turning == nullptr) return turn;
  for (int axis = 0; axis < 3; ++axis) {
    turn.col(axis) += Followed<double>(Eigen::Vector3d::Unit(axis), rate_change);
  }
  return turn;
}

void FieldRow::SetGyroscopeJacobians(const Eigen::Matrix3d& by_field,
                                     const Eigen::Vector3d& in_body,
                                     const Eigen::Vector3d& rate_change,
                                     const double* sensitivity,
                                     double** jacobians) const {
  Eigen::Matrix3d by_rate;
  for (int axis = 0; axis < 3; ++axis) {
    by_rate.col(axis) = Followed<double>(in_body, Eigen::Vector3d::Unit(axis));
  }
  const Eigen::Matrix3d by_bias =
      -by_field * by_rate * Eigen::Map<const Eigen::Matrix3d>(sensitivity).inverse();
  if (jacobians[0] != nullptr) Eigen::Map<RowMajor33>{jacobians[0]} = by_bias;
  if (jacobians[1] == nullptr) return;
  const Eigen::Vector3d rate = reading_.turning->rate_radps + rate_change;
  Eigen::Map<Eigen::Matrix<double, 3, 9, Eigen::RowMajor>> out(jacobians[1]);
  for (int axis = 0; axis < 3; ++axis) out.middleCols<3>(3 * axis) = rate[axis] * by_bias;
}

}  // namespace truetriad
