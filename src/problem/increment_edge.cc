// SPDX-License-Identifier: Apache-2.0
#include "problem/increment_edge.h"

#include <Eigen/Cholesky>

#include "truetriad/math/rotation.h"

namespace truetriad {
namespace {

constexpr Triad kGyroscope = Triad::kGyroscope;

GyroModel ModelAt(const SharedLayout& layout, const double* shared, const ThermalFactors& factors) {
  GyroModel model{layout.ModelOf(kGyroscope, shared, factors)};
  if (layout.g_sensitivity >= 0) {
    model.g_sensitivity = Eigen::Map<const Eigen::Matrix3d>(shared + layout.g_sensitivity);
  }
  model.has_asymmetry = layout.asymmetry[kGyroscope] >= 0;
  return model;
}

}  // namespace

GyroModel IncrementEdge::ModelOf(const SharedLayout& layout, const double* shared) const {
  return ModelAt(
      layout, shared, layout.FactorsOf(kGyroscope, temperature_degc, temperature_rate_degcps));
}

std::vector<Eigen::Vector3d> IncrementEdge::ForcesOf(const SharedLayout& layout,
                                                     const double* shared) const {
  std::vector<Eigen::Vector3d> forces;
  if (accelerometer_raw.empty()) return forces;
  const TriadModel<double> accelerometer = layout.ModelOf(
      Triad::kAccelerometer,
      shared,
      layout.FactorsOf(Triad::kAccelerometer, temperature_degc, temperature_rate_degcps));
  const Eigen::Matrix3d correction = accelerometer.Correction();
  forces.reserve(accelerometer_raw.size());
  for (const Eigen::Vector3d& raw : accelerometer_raw) {
    forces.emplace_back(correction * accelerometer.Felt(raw - accelerometer.bias));
  }
  return forces;
}

void IncrementEdge::Integrate(const SharedLayout& layout, const double* shared) {
  at = ModelOf(layout, shared);
  const std::vector<Eigen::Vector3d> forces = ForcesOf(layout, shared);
  increment =
      IntegrateMove(GyroReadings{move.time_s, move.reading_raw, forces}, at, sigma_raw, sampling);
}

Eigen::Quaterniond IncrementEdge::RotationAt(const SharedLayout& layout,
                                             const double* shared) const {
  const std::vector<Eigen::Vector3d> forces = ForcesOf(layout, shared);
  return IntegrateRotation(
      {move.time_s, move.reading_raw, forces}, ModelOf(layout, shared), sampling);
}

Eigen::Vector3d IncrementEdge::EarthTurn(const SharedLayout& layout, const double* shared) const {
  if (stated_turn >= 0 || !layout.CountsEarthRate()) return Eigen::Vector3d::Zero();
  const Eigen::Map<const ReferenceVector> reference(shared + layout.reference);
  return increment.duration_s * EarthRate(layout, reference);
}

void IncrementEdge::Evaluate(const SharedLayout& layout,
                             const double* shared,
                             const double* first_state,
                             const double* second_state,
                             Eigen::Vector3d* residual,
                             PoseSharedJacobian* shared_jacobian,
                             Eigen::Matrix3d* first_jacobian,
                             Eigen::Matrix3d* second_jacobian) const {
  const ThermalFactors factors =
      layout.FactorsOf(kGyroscope, temperature_degc, temperature_rate_degcps);
  const GyroModel model = ModelAt(layout, shared, factors);
  const Eigen::Map<const Eigen::Quaterniond> first(first_state), second_in_its_world(second_state);
  const Eigen::Vector3d earth_turn = EarthTurn(layout, shared);
  const bool earth_turns = !earth_turn.isZero(0.0);
  // In the world of the first.
  Eigen::Quaterniond second = second_in_its_world;
  if (earth_turns) second = RotationExp(earth_turn) * second_in_its_world;
  const Eigen::Vector3d change =
      increment.by_bias * (model.triad.bias - at.triad.bias) +
      increment.by_sensitivity *
          Eigen::Matrix3d(model.triad.sensitivity - at.triad.sensitivity).reshaped() +
      increment.by_g_sensitivity *
          Eigen::Matrix3d(model.g_sensitivity - at.g_sensitivity).reshaped() +
      increment.by_asymmetry * (model.triad.asymmetry - at.triad.asymmetry);
  const Eigen::Quaterniond turned = increment.rotation * RotationExp(change);
  *residual = RotationLog(turned.conjugate() * first.conjugate() * second);

  const Eigen::Matrix3d from_right = InverseRightJacobian(*residual);
  if (second_jacobian != nullptr) *second_jacobian = from_right;
  if (first_jacobian != nullptr) {
    // (R Exp(d))^T Q = R^T Q Exp(-Q^T R d).
    *first_jacobian = -from_right * (second.conjugate() * first).toRotationMatrix();
  }
  if (shared_jacobian == nullptr) return;
  // Exp(-J_r(change) J d) from the left; the inverse left Jacobian is the right one's transpose.
  const Eigen::Matrix3d by_change = -from_right.transpose() * RightJacobian(change);
  shared_jacobian->setZero(3, layout.size);
  layout.SetModelJacobian(kGyroscope,
                          factors,
                          by_change * increment.by_bias,
                          by_change * increment.by_sensitivity,
                          *shared_jacobian);
  if (layout.g_sensitivity >= 0) {
    shared_jacobian->block<3, 9>(0, layout.g_sensitivity) = by_change * increment.by_g_sensitivity;
  }
  if (earth_turns) {
    // Exp(e + d) R = Exp(e) R Exp(R^T J_r(e) d).
    const Eigen::Map<const ReferenceVector> reference(shared + layout.reference);
    shared_jacobian->middleCols<kReferenceSize>(layout.reference) =
        from_right * second_in_its_world.toRotationMatrix().transpose() *
        RightJacobian(earth_turn) * increment.duration_s * EarthRateJacobian(layout, reference);
  }
  if (const int place = layout.asymmetry[kGyroscope]; place >= 0) {
    shared_jacobian->middleCols<3>(place) = by_change * increment.by_asymmetry;
  }
}

Eigen::Matrix3d IncrementEdge::Information() const {
  return weight * Eigen::LLT<Eigen::Matrix3d>(variance).solve(Eigen::Matrix3d::Identity());
}

Eigen::Matrix3d IncrementEdge::SquareRootInformation() const {
  const Eigen::LLT<Eigen::Matrix3d> factor(variance / weight);
  return factor.matrixL().solve(Eigen::Matrix3d::Identity());
}

}  // namespace truetriad
