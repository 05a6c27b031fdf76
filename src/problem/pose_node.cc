// SPDX-License-Identifier: Apache-2.0
#include "problem/pose_node.h"

#include <algorithm>
#include <memory>

#include "problem/graph_rows.h"
#include "problem/rows/row_evaluation.h"

namespace truetriad {
bool PoseNode::TellsHeading() const {
  return kind == PoseKind::kHeld || has_attitude_prior ||
         (is_field_inclined &&
          std::any_of(observations.begin(), observations.end(), [](const Observation& seen) {
            return seen.triad == Triad::kMagnetometer;
          }));
}

TriadModel<double> PoseNode::ModelOfTriad(const SharedLayout& layout,
                                          const double* shared,
                                          Triad triad) const {
  return layout.ModelOf(
      triad, shared, layout.FactorsOf(triad, temperature_degc, temperature_rate_degcps, session));
}

Eigen::Vector3d PoseNode::FieldInBody(const SharedLayout& layout,
                                      Triad triad,
                                      const Eigen::Ref<const ReferenceVector>& reference,
                                      const double* state_values) const {
  const bool is_gyroscope = triad == Triad::kGyroscope;
  if (is_gyroscope && !is_axis_known) {
    return known_rate_radps.norm() * Eigen::Map<const Eigen::Vector3d>(state_values);
  }
  if (is_gyroscope && !SeesEarthRate(layout)) return known_rate_radps;
  const Eigen::Vector3d world =
      is_gyroscope ? EarthRate(layout.earth_rate_radps, reference) : WorldVector(triad, reference);
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
  residual->resize(row_count());
  if (shared_jacobian != nullptr) shared_jacobian->setZero(row_count(), layout.size);
  if (tangent_jacobian != nullptr) tangent_jacobian->setZero(row_count(), tangent_size());
  PlusJacobian plus;
  if (tangent_jacobian != nullptr) {
    PoseValues values{};
    std::copy_n(state_values, AmbientSize(kind), values.begin());
    plus = PlusJacobianOf(kind, values);
  }
  RowEvaluation evaluation;
  int at = 0;
  for (const std::unique_ptr<Row>& row : RowsOf(*this, layout)) {
    const bool wants_jacobians = shared_jacobian != nullptr || tangent_jacobian != nullptr;
    evaluation.Evaluate(*row, shared, {state_values, nullptr}, wants_jacobians);
    const int rows = row->num_residuals();
    residual->segment(at, rows) = evaluation.residual();
    if (shared_jacobian != nullptr) {
      for (std::size_t i = 0; i < row->shared_blocks().size(); ++i) {
        const SharedBlock& block = row->shared_blocks()[i];
        shared_jacobian->block(at, block.offset, rows, block.size) = evaluation.BySharedBlock(i);
      }
    }
    if (tangent_jacobian != nullptr && row->state_count() > 0) {
      tangent_jacobian->middleRows(at, rows) = evaluation.ByState(0) * plus;
    }
    at += rows;
  }
}

PoseRowMatrix PoseNode::SquareRootInformation() const {
  PoseRowMatrix root;
  root.setZero(row_count(), row_count());
  Eigen::Index at = 0;
  for (const RowRoot& of_row : RootsOf(*this)) {
    root.block(at, at, of_row.rows(), of_row.rows()) = of_row;
    at += of_row.rows();
  }
  return root;
}

PoseRowMatrix PoseNode::Information() const {
  PoseRowMatrix information;
  information.setZero(row_count(), row_count());
  Eigen::Index at = 0;
  for (const RowRoot& of_row : RootsOf(*this)) {
    const Eigen::Index rows = of_row.rows();
    information.block(at, at, rows, rows).noalias() = of_row.transpose().lazyProduct(of_row);
    at += rows;
  }
  return information;
}

}  // namespace truetriad
