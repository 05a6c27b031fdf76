// SPDX-License-Identifier: Apache-2.0
#include "problem/increment_edge.h"

#include <memory>

#include "math/dense/cholesky.h"
#include "problem/graph_rows.h"
#include "problem/rows/row_evaluation.h"

namespace truetriad {
namespace {

constexpr Triad kGyroscope = Triad::kGyroscope;

GyroModel ModelAt(const SharedLayout& layout, const double* shared, const ThermalFactors& factors) {
  GyroModel model{layout.ModelOf(kGyroscope, shared, factors)};
  if (layout.g_sensitivity >= 0) {
    model.g_sensitivity = Eigen::Map<const Eigen::Matrix3d>(shared + layout.g_sensitivity);
  }
  model.is_bent = !layout.axis_terms[kGyroscope].empty();
  return model;
}

}  // namespace

GyroModel IncrementEdge::ModelOf(const SharedLayout& layout, const double* shared) const {
  return ModelAt(layout,
                 shared,
                 layout.FactorsOf(kGyroscope, temperature_degc, temperature_rate_degcps, session));
}

std::vector<Eigen::Vector3d> IncrementEdge::ForcesOf(const SharedLayout& layout,
                                                     const double* shared) const {
  std::vector<Eigen::Vector3d> forces;
  if (accelerometer_raw.empty()) return forces;
  const TriadModel<double> accelerometer = layout.ModelOf(
      Triad::kAccelerometer,
      shared,
      layout.FactorsOf(Triad::kAccelerometer, temperature_degc, temperature_rate_degcps, session));
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
  return increment.duration_s * EarthRate(layout.earth_rate_radps, reference);
}

void IncrementEdge::Evaluate(const SharedLayout& layout,
                             const double* shared,
                             const double* first_state,
                             const double* second_state,
                             Eigen::Vector3d* residual,
                             PoseSharedJacobian* shared_jacobian,
                             Eigen::Matrix3d* first_jacobian,
                             Eigen::Matrix3d* second_jacobian) const {
  const std::unique_ptr<Row> row = RowOf(*this, layout);
  RowEvaluation evaluation;
  const bool wants_jacobians = shared_jacobian != nullptr || first_jacobian != nullptr;
  evaluation.Evaluate(*row, shared, {first_state, second_state}, wants_jacobians);
  *residual = evaluation.residual();
  if (shared_jacobian != nullptr) {
    shared_jacobian->setZero(3, layout.size);
    for (std::size_t i = 0; i < row->shared_blocks().size(); ++i) {
      const SharedBlock& block = row->shared_blocks()[i];
      shared_jacobian->middleCols(block.offset, block.size) = evaluation.BySharedBlock(i);
    }
  }
  const auto by_tangent = [&](std::size_t i, const double* state) -> Eigen::Matrix3d {
    const PoseValues values{state[0], state[1], state[2], state[3]};
    return evaluation.ByState(i) * PlusJacobianOf(PoseKind::kRotation, values);
  };
  if (first_jacobian != nullptr) *first_jacobian = by_tangent(0, first_state);
  if (second_jacobian != nullptr) *second_jacobian = by_tangent(1, second_state);
}

Eigen::Vector3d IncrementEdge::Residual(const SharedLayout& layout,
                                        const double* shared,
                                        const double* first_state,
                                        const double* second_state) const {
  Eigen::Vector3d residual;
  Evaluate(layout, shared, first_state, second_state, &residual, nullptr, nullptr, nullptr);
  return residual;
}

Eigen::Matrix3d IncrementEdge::Information() const { return weight * InverseOfPositive(variance); }

Eigen::Matrix3d IncrementEdge::SquareRootInformation() const { return RootOf(variance, weight); }

}  // namespace truetriad
