// SPDX-License-Identifier: Apache-2.0
#include "verdict/turn_errors.h"

#include <cmath>

#include "math/dense/cholesky.h"
#include "math/dense/eigenvalues.h"
#include "math/dense/products.h"
#include "problem/start_values.h"
#include "start/start.h"
#include "truetriad/math/rotation.h"

namespace truetriad {
namespace {

constexpr Triad kGyroscope = Triad::kGyroscope;

// The vector that turns are compared with, as measured at a pose, in body axes; unset if the pose
// has no such reading or it is rejected.
std::optional<Eigen::Vector3d> MeasuredVector(const SharedLayout& layout,
                                              const Eigen::VectorXd& shared,
                                              const PoseNode& node) {
  const Triad triad = TurnedAgainst(layout);
  for (const Observation& observation : node.observations) {
    if (observation.triad != triad || observation.rejected) continue;
    return node.ModelOfTriad(layout, shared.data(), triad).TruthFromRaw(observation.mean_raw);
  }
  return std::nullopt;
}

// TurnError for `edge` with the rotation `turn`; the vectors are computed with the parameters
// `shared`. Unset if a reading is rejected. The earth's rotation during the turn is subtracted, in
// the attitude that the graph has before the turn.
std::optional<double> ErrorOf(const PoseGraph& graph,
                              const Eigen::VectorXd& shared,
                              const IncrementEdge& edge,
                              const Eigen::Quaterniond& turn) {
  const auto before = MeasuredVector(graph.layout, shared, graph.nodes[edge.from]);
  const auto after = MeasuredVector(graph.layout, shared, graph.nodes[edge.from + 1]);
  if (!before || !after) return std::nullopt;
  const Eigen::Vector3d earth_turn = edge.EarthTurn(graph.layout, shared.data());
  if (earth_turn.isZero(0.0)) return TurnError(turn, *before, *after);
  const Eigen::Quaterniond body_from_world = graph.nodes[edge.from].rotation().conjugate();
  return TurnError(RotationExp(body_from_world * -earth_turn) * turn, *before, *after);
}

// The shared parameters estimated without the factor `at`; unset if undetermined without it.
std::optional<Eigen::VectorXd> SharedWithout(std::size_t at,
                                             const Eigen::Matrix3d& variance,
                                             const PoseGraph& graph,
                                             const ReducedSystem& system) {
  // If the projector leaves less than this share of the observation's information in a direction,
  // residuals do not show the observation there. If elimination of the attitudes alone leaves over
  // twice as much, the parameters absorb the rest: they are undetermined without the observation.
  constexpr double kNothing = 1e-6;
  const Eigen::Index row = system.factors()[at].row;
  const Eigen::Matrix3d root = CholeskyRoot(variance);
  const Eigen::Matrix3d projector = root.transpose() * system.ProjectorBlock(at) * root;
  const Eigen::Matrix3d beside_attitudes = root.transpose() * system.D(at) * root;
  const Eigen::Vector3d projected = root.transpose() * system.projected().segment<3>(row);
  const SymmetricEigen3 solver = EigenOfSymmetric3(projector);
  Eigen::Vector3d deletion = Eigen::Vector3d::Zero();
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d direction = solver.vectors.col(axis);
    const double eigenvalue = solver.values[axis];
    if (eigenvalue > kNothing) {
      deletion += direction * (direction.dot(projected) / eigenvalue);
    } else if (direction.dot(beside_attitudes * direction) > 2.0 * kNothing) {
      return std::nullopt;
    }
  }
  const Eigen::VectorXd shift = TimesVector(
      system.covariance(), system.B().middleRows<3>(row).transpose() * (root * deletion));
  return graph.shared + TimesVector(graph.layout.basis, shift);
}

}  // namespace

Triad TurnedAgainst(const SharedLayout& layout) {
  return layout.Has(Triad::kAccelerometer) ? Triad::kAccelerometer : Triad::kMagnetometer;
}

double TurnError(const Eigen::Quaterniond& turn,
                 const Eigen::Vector3d& before,
                 const Eigen::Vector3d& after) {
  const Eigen::Vector3d predicted = turn.conjugate() * before;
  return std::atan2(predicted.cross(after).norm(), predicted.dot(after));
}

std::optional<TriadModel<double>> NominalGyroscope(const PoseSet& poses) {
  const StreamSummary* stream = poses.Find(kGyroscope);
  if (stream == nullptr || stream->unit.is_counts) return std::nullopt;
  return TriadModel<double>{Eigen::Matrix3d::Identity() / stream->unit.truth_per_raw,
                            MedianReading(poses, kGyroscope)};
}

TurnErrors FindTurnErrors(const PoseGraph& graph,
                          const ReducedSystem& system,
                          const PoseSet& poses) {
  TurnErrors errors;
  const std::optional<TriadModel<double>> nominal = NominalGyroscope(poses);
  bool is_determined = true;
  for (std::size_t i = 0; i < graph.increments.size(); ++i) {
    const IncrementEdge& edge = graph.increments[i];
    if (edge.rejected) continue;
    const auto in_sample = ErrorOf(graph, graph.shared, edge, edge.increment.rotation);
    if (!in_sample) continue;
    errors.in_sample.push_back(*in_sample);
    if (nominal) {
      const GyroReadings readings{edge.move.time_s, edge.move.reading_raw, {}};
      errors.nominal.push_back(*ErrorOf(
          graph, graph.shared, edge, IntegrateRotation(readings, {*nominal}, edge.sampling)));
    }
    const auto shared =
        SharedWithout(graph.nodes.size() + i, edge.variance / edge.weight, graph, system);
    is_determined = is_determined && shared;
    if (!is_determined) continue;
    errors.held_out.push_back(
        *ErrorOf(graph, *shared, edge, edge.RotationAt(graph.layout, shared->data())));
  }
  if (!is_determined) errors.held_out.clear();
  return errors;
}

}  // namespace truetriad
