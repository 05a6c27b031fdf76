// SPDX-License-Identifier: Apache-2.0
#include "problem/rows/gyroscope_row.h"

#include <algorithm>

#include "problem/rows/attitude.h"
#include "truetriad/math/rotation.h"

namespace truetriad {
namespace {

using ReferenceJacobian = Eigen::Matrix<double, 3, kReferenceSize, Eigen::RowMajor>;

}  // namespace

GyroscopeRow::GyroscopeRow(const SharedLayout& layout,
                           PoseKind state,
                           const ThermalFactors& factors,
                           const Eigen::Vector3d& mean_raw)
    : Row(3),
      state_(state),
      mean_raw_(mean_raw),
      earth_rate_radps_(layout.earth_rate_radps),
      has_g_sensitivity_(layout.g_sensitivity >= 0),
      triad_blocks_(layout, Triad::kGyroscope, factors) {
  AddFirstShared(triad_blocks_.blocks(), 2);
  if (has_g_sensitivity_) AddShared({layout.g_sensitivity, 9});
  if (!sees_world()) return;
  AddShared({layout.reference, kReferenceSize});
  AddState(state == PoseKind::kDirection ? kDirectionSize : kAttitudeSize);
}

bool GyroscopeRow::Evaluate(double const* const* parameters,
                            double* residuals,
                            double** jacobians) const {
  (*this)(parameters, residuals);
  if (jacobians == nullptr) return true;
  const TriadModel<double> model = triad_blocks_.ModelAt(parameters);
  std::size_t at = triad_blocks_.count();
  const double* g_sensitivity = has_g_sensitivity_ ? parameters[at] : nullptr;
  double* by_g_sensitivity = has_g_sensitivity_ ? jacobians[at++] : nullptr;
  const double* reference = nullptr;
  const double* state = nullptr;
  double* by_reference = nullptr;
  double* by_state = nullptr;
  Eigen::Vector3d rate = Eigen::Vector3d::Zero();
  if (sees_world()) {
    reference = parameters[at];
    state = parameters[at + 1];
    by_reference = jacobians[at];
    by_state = jacobians[at + 1];
    if (by_reference != nullptr) std::fill_n(by_reference, 3 * kReferenceSize, 0.0);
    const int state_size = state_ == PoseKind::kDirection ? kDirectionSize : kAttitudeSize;
    if (by_state != nullptr) std::fill_n(by_state, 3 * state_size, 0.0);
    if (counts_earth_rate()) rate = InBody(EarthRateOf(earth_rate_radps_, reference), state);
  }
  triad_blocks_.SetFieldJacobians(model, rate, jacobians);
  if (counts_earth_rate()) {
    const Eigen::Vector3d slope = model.Slope(model.sensitivity * rate);
    AddEarthRateJacobians(
        reference, state, slope.asDiagonal() * model.sensitivity, by_reference, by_state);
  }
  if (has_g_sensitivity_) {
    AddPullJacobians(g_sensitivity, reference, state, by_g_sensitivity, by_reference, by_state);
  }
  return true;
}

void GyroscopeRow::AddEarthRateJacobians(const double* reference,
                                         const double* state,
                                         const Eigen::Matrix3d& by_rate,
                                         double* by_reference,
                                         double* by_state) const {
  const Eigen::Map<const ReferenceVector> at(reference);
  const Eigen::Matrix3d body_from_world =
      Eigen::Map<const Eigen::Quaterniond>(state).conjugate().toRotationMatrix();
  if (by_reference != nullptr) {
    Eigen::Map<ReferenceJacobian>{by_reference} +=
        by_rate * body_from_world * EarthRateJacobian(earth_rate_radps_, at);
  }
  if (by_state != nullptr) {
    const Eigen::Vector3d rate = body_from_world * EarthRate(earth_rate_radps_, at);
    Eigen::Map<RowMajor34>{by_state} += by_rate * Skew(rate) * TangentFromQuaternion(state);
  }
}

void GyroscopeRow::AddPullJacobians(const double* g_sensitivity,
                                    const double* reference,
                                    const double* state,
                                    double* by_g_sensitivity,
                                    double* by_reference,
                                    double* by_state) const {
  const WorldVectorWithJacobian& world = WorldVectorAt(Triad::kAccelerometer, reference);
  const Eigen::Vector3d force = InBody(world.vector, state);
  const Eigen::Map<const Eigen::Matrix3d> G(g_sensitivity);
  if (by_g_sensitivity != nullptr) SetMatrixTimesVector(force, by_g_sensitivity);
  if (state_ == PoseKind::kDirection) {
    const Eigen::Map<const Eigen::Vector3d> direction(state);
    if (by_reference != nullptr) {
      Eigen::Map<ReferenceJacobian>{by_reference} +=
          G * direction * (world.vector.normalized().transpose() * world.by_reference);
    }
    if (by_state != nullptr) {
      Eigen::Map<RowMajor33>{by_state} +=
          world.vector.norm() * G *
          (Eigen::Matrix3d::Identity() - direction * direction.transpose());
    }
    return;
  }
  if (by_reference != nullptr) {
    const Eigen::Map<const Eigen::Quaterniond> world_from_body(state);
    Eigen::Map<ReferenceJacobian>{by_reference} +=
        G * world_from_body.conjugate().toRotationMatrix() * world.by_reference;
  }
  if (by_state != nullptr) {
    Eigen::Map<RowMajor34>{by_state} += G * Skew(force) * TangentFromQuaternion(state);
  }
}

}  // namespace truetriad
