// SPDX-License-Identifier: Apache-2.0
#include "problem/pose_node.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

#include "truetriad/math/rotation.h"

namespace truetriad {
namespace {

// σ of a heading that only has to be some heading: any would do, but the further it is from that of
// the turns, the fewer digits the elimination keeps.
constexpr double kHeldHeadingRad = 1e-3;

}  // namespace

bool PoseNode::TellsHeading() const {
  return kind == PoseKind::kHeld || has_attitude_prior ||
         std::any_of(observations.begin(), observations.end(), [](const Observation& seen) {
           return seen.triad == Triad::kMagnetometer;
         });
}

TriadModel<double> PoseNode::ModelOfTriad(const SharedLayout& layout,
                                          const double* shared,
                                          Triad triad) const {
  return layout.ModelOf(
      triad, shared, layout.FactorsOf(triad, temperature_degc, temperature_rate_degcps));
}

Eigen::Matrix<double, 3, 2> TangentBasis(const Eigen::Vector3d& direction) {
  Eigen::Index smallest = 0;
  direction.cwiseAbs().minCoeff(&smallest);
  Eigen::Matrix<double, 3, 2> basis;
  basis.col(0) = direction.cross(Eigen::Vector3d::Unit(smallest)).normalized();
  basis.col(1) = direction.cross(basis.col(0));
  return basis;
}

Eigen::Matrix3d FaceAxes(int face) {
  const int axis = face / 2;
  Eigen::Matrix3d axes = Eigen::Matrix3d::Zero();
  axes(axis, 0) = face % 2 == 0 ? 1.0 : -1.0;
  axes((axis + 1) % 3, 1) = 1.0;
  axes((axis + 2) % 3, 2) = 1.0;
  return axes;
}

Eigen::Vector3d PoseNode::FieldInBody(const SharedLayout& layout,
                                      Triad triad,
                                      const Eigen::Ref<const ReferenceVector>& reference,
                                      const double* state_values) const {
  const bool is_gyroscope = triad == Triad::kGyroscope;
  if (is_gyroscope && !SeesEarthRate(layout)) return known_rate_radps;
  const Eigen::Vector3d world =
      is_gyroscope ? EarthRate(layout, reference) : WorldVector(triad, reference);
  if (kind == PoseKind::kDirection) {
    return world.norm() * Eigen::Map<const Eigen::Vector3d>(state_values);
  }
  const Eigen::Map<const Eigen::Quaterniond> world_from_body(state_values);
  return world_from_body.conjugate() * world;
}

void PoseNode::Evaluate(const SharedLayout& layout,
                        const double* shared,
                        const double* state_values,
                        PoseResidual12* residual,
                        PoseSharedJacobian* shared_jacobian,
                        PoseStateJacobian* tangent_jacobian) const {
  const int rows = row_count();
  residual->resize(rows);
  if (shared_jacobian != nullptr) shared_jacobian->setZero(rows, layout.size);
  if (tangent_jacobian != nullptr) tangent_jacobian->setZero(rows, tangent_size());
  const Eigen::Map<const ReferenceVector> reference(shared + layout.reference);
  const Eigen::Map<const Eigen::Vector3d> state_direction(state_values);
  const Eigen::Map<const Eigen::Quaterniond> world_from_body(state_values);
  Eigen::Matrix<double, 3, 2> tangent_basis = Eigen::Matrix<double, 3, 2>::Zero();
  if (kind == PoseKind::kDirection) tangent_basis = TangentBasis(state_direction);

  int row = 0;
  for (const Observation& observation : observations) {
    const ThermalFactors factors =
        layout.FactorsOf(observation.triad, temperature_degc, temperature_rate_degcps);
    const TriadModel<double> model = layout.ModelOf(observation.triad, shared, factors);
    const Eigen::Vector3d field = FieldInBody(layout, observation.triad, reference, state_values);
    residual->segment<3>(row) = model.RawFromTruth(field) - observation.mean_raw;
    const Eigen::Vector3d felt = model.sensitivity * field;
    const Eigen::Vector3d slope = model.Slope(felt);
    const Eigen::Matrix3d by_field = slope.asDiagonal() * model.sensitivity;
    const bool is_gyroscope = observation.triad == Triad::kGyroscope;
    const bool sees_earth_rate = is_gyroscope && SeesEarthRate(layout);
    if (shared_jacobian != nullptr) {
      Eigen::Matrix<double, 3, 9> by_sensitivity;
      for (int axis = 0; axis < 3; ++axis) {
        by_sensitivity.middleCols<3>(3 * axis) = (field[axis] * slope).asDiagonal();
      }
      layout.SetModelJacobian(observation.triad,
                              factors,
                              Eigen::Matrix3d::Identity(),
                              by_sensitivity,
                              shared_jacobian->middleRows<3>(row));
      if (const int at = layout.quadratic[observation.triad]; at >= 0) {
        shared_jacobian->block<3, 3>(row, at) = felt.cwiseAbs2().asDiagonal();
      }
      if (const int at = layout.asymmetry[observation.triad]; at >= 0) {
        shared_jacobian->block<3, 3>(row, at) = felt.cwiseAbs().asDiagonal();
      }
      const auto world_jacobian = sees_earth_rate
                                      ? EarthRateJacobian(layout, reference)
                                      : WorldVectorJacobian(observation.triad, reference);
      if (kind == PoseKind::kDirection) {
        // Only the strength of the one field matters: d|v|/dp = v^T/|v| dv/dp.
        const Eigen::Vector3d world = WorldVector(observation.triad, reference);
        shared_jacobian->block<3, kReferenceSize>(row, layout.reference) =
            by_field * state_direction * (world.normalized().transpose() * world_jacobian);
      } else {
        shared_jacobian->block<3, kReferenceSize>(row, layout.reference) =
            by_field * world_from_body.conjugate().toRotationMatrix() * world_jacobian;
      }
    }
    if (tangent_jacobian != nullptr && (!is_gyroscope || sees_earth_rate)) {
      if (kind == PoseKind::kDirection) {
        tangent_jacobian->middleRows<3>(row) =
            by_field * tangent_basis * WorldVector(observation.triad, reference).norm();
      } else if (kind == PoseKind::kRotation) {
        // (R Exp(d))^T v = x + [x]_x d with x = R^T v.
        tangent_jacobian->middleRows<3>(row) = by_field * Skew(field);
      }
    }
    if (is_gyroscope) {
      AddPullOfGravity(
          layout, shared, state_values, row, residual, shared_jacobian, tangent_jacobian);
    }
    row += 3;
  }

  if (has_attitude_prior) {
    const Eigen::Vector3d log =
        RotationLog(prior_world_from_body.conjugate() * Eigen::Quaterniond(world_from_body));
    residual->segment<3>(row) = log;
    if (tangent_jacobian != nullptr && kind == PoseKind::kRotation) {
      tangent_jacobian->middleRows<3>(row) = InverseRightJacobian(log);
    }
    row += 3;
  }

  if (holds_heading) {
    // R Exp(d) R_held^T = Exp(R d) R R_held^T; the inverse left Jacobian is the right one's
    // transpose.
    const Eigen::Quaterniond rotation(world_from_body);
    const Eigen::Vector3d log = RotationLog(rotation * held_world_from_body.conjugate());
    (*residual)[row] = log.z();
    if (tangent_jacobian != nullptr && kind == PoseKind::kRotation) {
      tangent_jacobian->row(row) =
          InverseRightJacobian(log).col(2).transpose() * rotation.toRotationMatrix();
    }
    ++row;
  }

  if (face >= 0) {
    const Eigen::Matrix<double, 3, 2> tangents = FaceAxes(face).rightCols<2>();
    const int tilt_at = layout.face_tilt[static_cast<std::size_t>(face)];
    const Eigen::Vector3d up = kind == PoseKind::kDirection
                                   ? Eigen::Vector3d(state_direction)
                                   : world_from_body.conjugate() * Eigen::Vector3d::UnitZ();
    residual->segment<2>(row) =
        tangents.transpose() * up - Eigen::Map<const Eigen::Vector2d>(shared + tilt_at);
    if (shared_jacobian != nullptr) {
      shared_jacobian->block<2, 2>(row, tilt_at) = -Eigen::Matrix2d::Identity();
    }
    if (tangent_jacobian != nullptr) {
      if (kind == PoseKind::kDirection) {
        tangent_jacobian->middleRows<2>(row) = tangents.transpose() * tangent_basis;
      } else if (kind == PoseKind::kRotation) {
        tangent_jacobian->middleRows<2>(row) = tangents.transpose() * Skew(up);
      }
    }
  }
}

void PoseNode::AddPullOfGravity(const SharedLayout& layout,
                                const double* shared,
                                const double* state_values,
                                int row,
                                PoseResidual12* residual,
                                PoseSharedJacobian* shared_jacobian,
                                PoseStateJacobian* tangent_jacobian) const {
  if (layout.g_sensitivity < 0) return;
  const Eigen::Map<const Eigen::Matrix3d> g_sensitivity(shared + layout.g_sensitivity);
  const Eigen::Map<const ReferenceVector> reference(shared + layout.reference);
  const bool rests = role == PoseRole::kRest;
  const Eigen::Vector3d force =
      rests ? FieldInBody(layout, Triad::kAccelerometer, reference, state_values)
            : known_force_mps2;
  residual->segment<3>(row) += g_sensitivity * force;
  if (shared_jacobian != nullptr) {
    for (int axis = 0; axis < 3; ++axis) {
      shared_jacobian->block<3, 3>(row, layout.g_sensitivity + 3 * axis)
          .diagonal()
          .setConstant(force[axis]);
    }
    if (rests) {
      shared_jacobian->block<3, 1>(row, layout.reference + kGravity) +=
          g_sensitivity * force / reference[kGravity];
      if (kind != PoseKind::kDirection) {
        const Eigen::Map<const Eigen::Quaterniond> world_from_body(state_values);
        shared_jacobian->block<3, 2>(row, layout.reference + kFixtureTilt) +=
            g_sensitivity * world_from_body.conjugate().toRotationMatrix() *
            WorldVectorJacobian(Triad::kAccelerometer, reference).middleCols<2>(kFixtureTilt);
      }
    }
  }
  if (tangent_jacobian == nullptr) return;
  if (kind == PoseKind::kDirection) {
    const Eigen::Map<const Eigen::Vector3d> direction(state_values);
    tangent_jacobian->middleRows<3>(row) +=
        reference[kGravity] * g_sensitivity * TangentBasis(direction);
  } else if (kind == PoseKind::kRotation) {
    tangent_jacobian->middleRows<3>(row) += g_sensitivity * Skew(force);
  }
}

std::array<double, 4> PoseNode::StateAfter(const Eigen::Ref<const Eigen::VectorXd>& tangent) const {
  if (kind == PoseKind::kDirection) {
    const Eigen::Map<const Eigen::Vector3d> direction(state.data());
    const Eigen::Vector3d moved =
        (direction + TangentBasis(direction) * tangent.head<2>()).normalized();
    return {moved.x(), moved.y(), moved.z(), 0.0};
  }
  if (kind == PoseKind::kRotation) {
    const Eigen::Quaterniond moved =
        (rotation() * RotationExp(Eigen::Vector3d(tangent.head<3>()))).normalized();
    return {moved.x(), moved.y(), moved.z(), moved.w()};
  }
  return state;
}

PoseRowMatrix PoseNode::Information() const {
  PoseRowMatrix information;
  information.setZero(row_count(), row_count());
  int row = 0;
  for (const Observation& observation : observations) {
    const Eigen::LLT<Eigen::Matrix3d> factor(observation.variance);
    information.block<3, 3>(row, row) =
        observation.weight * factor.solve(Eigen::Matrix3d::Identity());
    row += 3;
  }
  if (has_attitude_prior) {
    information.block<3, 3>(row, row).diagonal() = prior_sigma_rad.cwiseAbs2().cwiseInverse();
    row += 3;
  }
  if (holds_heading) {
    information(row, row) = 1.0 / (kHeldHeadingRad * kHeldHeadingRad);
    ++row;
  }
  if (face >= 0) {
    information.block<2, 2>(row, row).diagonal().setConstant(1.0 /
                                                             (seat_sigma_rad * seat_sigma_rad));
  }
  return information;
}

PoseRowMatrix PoseNode::SquareRootInformation() const {
  PoseRowMatrix root;
  root.setZero(row_count(), row_count());
  int row = 0;
  for (const Observation& observation : observations) {
    // V = L L^T / w, so sqrt(w) L^-1 whitens.
    const Eigen::LLT<Eigen::Matrix3d> factor(observation.variance / observation.weight);
    root.block<3, 3>(row, row) = factor.matrixL().solve(Eigen::Matrix3d::Identity());
    row += 3;
  }
  if (has_attitude_prior) {
    root.block<3, 3>(row, row).diagonal() = prior_sigma_rad.cwiseInverse();
    row += 3;
  }
  if (holds_heading) {
    root(row, row) = 1.0 / kHeldHeadingRad;
    ++row;
  }
  if (face >= 0) root.block<2, 2>(row, row).diagonal().setConstant(1.0 / seat_sigma_rad);
  return root;
}

}  // namespace truetriad
