// SPDX-License-Identifier: Apache-2.0
#include "verdict/quality.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>

#include "math/dense/products.h"
#include "math/distributions.h"
#include "noise/variance_components.h"
#include "problem/parameters.h"
#include "solve/chain_elimination.h"
#include "solve/reduced_system.h"
#include "solve/solve_graph.h"

namespace truetriad {

namespace {

// Residual of one observation, true unit, in the body frame of the solution.
PoseResidual ResidualOf(const PoseGraph& graph,
                        const PresentedSolution& solution,
                        const PoseSet& poses,
                        const PoseNode& node,
                        const Observation& observation) {
  const ReferenceVector reference = graph.reference();
  const Triad triad = observation.triad;
  const auto seen_by = [&](Triad of) -> Eigen::Vector3d {
    return node.FieldInBody(graph.layout, of, reference, node.state.data());
  };
  const Eigen::Matrix3d to_solution = solution.rotation.transpose();
  const Eigen::Vector3d field = to_solution * seen_by(triad);
  Eigen::Vector3d reading = observation.mean_raw;
  if (triad == Triad::kGyroscope && solution.g_sensitivity) {
    const Eigen::Vector3d force =
        node.role == PoseRole::kRest ? seen_by(Triad::kAccelerometer) : node.known_force_mps2;
    reading -= *solution.g_sensitivity * (to_solution * force);
  }
  const Eigen::Vector3d corrected = solution.ModelAt(triad, node).TruthFromRaw(reading);
  const double strength = WorldVector(triad, reference).norm();
  const StreamSummary* stream = poses.Find(triad);
  PoseResidual residual;
  residual.pose = node.number;
  residual.triad = triad;
  residual.residual = corrected - field;
  residual.direction = field.normalized();
  residual.norm_error =
      triad == Triad::kGyroscope ? residual.residual.norm() : corrected.norm() - strength;
  residual.norm_error_before =
      stream == nullptr || stream->unit.is_counts
          ? std::numeric_limits<double>::quiet_NaN()
          : observation.mean_raw.norm() * stream->unit.truth_per_raw - strength;
  return residual;
}

// Length errors of all readings, and their directions.
struct LengthErrors {
  PerTriad<RootMeanSquare> after, before;
  PerTriad<std::vector<Eigen::Vector3d>> directions;

  void Add(const PoseResidual& residual) {
    after[residual.triad].Add(residual.norm_error);
    if (std::isfinite(residual.norm_error_before)) {
      before[residual.triad].Add(residual.norm_error_before);
    }
    directions[residual.triad].push_back(residual.direction);
  }
};

}  // namespace

void FillPoseQuality(const PoseGraph& graph,
                     const PresentedSolution& solution,
                     const std::vector<DeletionTest>& tests,
                     const TurnErrors& turns,
                     const PoseSet& poses,
                     Quality* quality) {
  LengthErrors errors;
  for (const DeletionTest& test : tests) {
    if (test.component == NoiseComponent::kTurn) continue;
    const PoseNode& node = graph.nodes[test.node];
    const Observation& observation = node.observations[test.observation];
    PoseResidual residual = ResidualOf(graph, solution, poses, node, observation);
    residual.normalized = test.rank > 0 ? std::sqrt(test.chi2 / test.rank) : 0.0;
    residual.weight = observation.rejected ? 0.0 : observation.weight;
    quality->rests.pose_residuals.push_back(residual);
    if (!observation.rejected && residual.triad != Triad::kGyroscope) errors.Add(residual);
  }
  for (const PoseNode& node : graph.nodes) {
    if (node.role != PoseRole::kMoment) continue;
    for (const Observation& seen : node.observations) {
      errors.Add(ResidualOf(graph, solution, poses, node, seen));
    }
  }
  for (const double angle : turns.in_sample) errors.after[Triad::kGyroscope].Add(angle);
  for (const double angle : turns.nominal) errors.before[Triad::kGyroscope].Add(angle);
  for (const Triad triad : kTriads) {
    quality->residual_rms[triad] = errors.after[triad].value();
    quality->residual_rms_before[triad] = errors.before[triad].value();
    if (errors.directions[triad].empty()) continue;
    quality->coverage.push_back(DirectionCoverage(triad, errors.directions[triad]));
  }
}

namespace {

// For each fold, the information of all other poses. A fold is every n-th pose, from one of the
// first n poses on. Poses are independent here: the fold's information is subtracted from the
// total.
std::vector<SharedInformation> WithoutFolds(const PoseGraph& graph,
                                            const ReducedSystem& system,
                                            int folds) {
  const auto count = static_cast<std::size_t>(folds);
  // Information and gradient of each fold.
  const auto n = static_cast<Eigen::Index>(system.size());
  std::vector<Eigen::MatrixXd> information(count, Eigen::MatrixXd::Zero(n, n));
  std::vector<Eigen::VectorXd> gradient(count, Eigen::VectorXd::Zero(n));
  for (const auto& factor : system.factors()) {
    const std::size_t fold = factor.node % count;
    const Eigen::MatrixXd J = system.J().middleRows(factor.row, factor.rows);
    const Eigen::MatrixXd B = system.B().middleRows(factor.row, factor.rows);
    information[fold] += TransposeTimes(J, B);
    gradient[fold] += J.transpose() * system.projected().segment(factor.row, factor.rows);
  }
  std::vector<SharedInformation> left;
  for (std::size_t fold = 0; fold < count; ++fold) {
    // The gradient at the system's solution, one Gauss-Newton step from the linearisation.
    left.emplace_back(graph.layout,
                      graph.shared,
                      system.information() - information[fold],
                      system.gradient() - gradient[fold] + information[fold] * system.step());
  }
  return left;
}

// For each fold, the information of all other poses, if turns link the poses. A pose that is left
// out stays in the graph, with readings of negligible weight; no turn is integrated again.
std::vector<SharedInformation> WithoutFolds(const PoseGraph& graph, int folds) {
  std::vector<SharedInformation> left;
  for (int fold = 0; fold < folds; ++fold) {
    PoseGraph part = graph;
    for (auto k = static_cast<std::size_t>(fold); k < part.nodes.size();
         k += static_cast<std::size_t>(folds)) {
      for (Observation& observation : part.nodes[k].observations) {
        observation.weight = kRejectedWeight;
      }
    }
    const ChainElimination chain = Linearised(part);
    left.emplace_back(graph.layout, graph.shared, chain.information(), chain.gradient());
  }
  return left;
}

}  // namespace

std::optional<HeldOut> CrossValidate(const PoseGraph& graph,
                                     const ReducedSystem& system,
                                     const TurnErrors& turns,
                                     int folds) {
  if (folds < 2 || graph.nodes.size() < 2 * static_cast<std::size_t>(folds)) return std::nullopt;
  if (!graph.layout.Has(Triad::kAccelerometer) && !graph.layout.Has(Triad::kMagnetometer)) {
    return std::nullopt;
  }
  HeldOut result;
  result.folds = folds;
  PerTriad<RootMeanSquare> errors;
  PerTriad<RootMeanSquare> seen;
  const std::vector<SharedInformation> parts =
      graph.increments.empty() ? WithoutFolds(graph, system, folds) : WithoutFolds(graph, folds);
  PoseGraph part;
  part.layout = graph.layout;
  for (int fold = 0; fold < folds; ++fold) {
    const SharedInformation& left = parts[static_cast<std::size_t>(fold)];
    if (left.rank() < graph.layout.free_size()) return std::nullopt;
    part.shared = graph.shared + graph.layout.basis * left.step();
    for (std::size_t k = 0; k < graph.nodes.size(); ++k) {
      for (const Observation& observation : graph.nodes[k].observations) {
        if (observation.rejected) continue;
        const Triad triad = observation.triad;
        if (triad == Triad::kGyroscope) continue;  // at rest its readings have no length to predict
        const double error = NormError(part.ModelAt(triad, graph.nodes[k]),
                                       observation.mean_raw,
                                       WorldVector(triad, part.reference()).norm());
        if (static_cast<int>(k) % folds == fold) errors[triad].Add(error);
        if (fold > 0) continue;
        seen[triad].Add(NormError(graph.ModelAt(triad, graph.nodes[k]),
                                  observation.mean_raw,
                                  WorldVector(triad, graph.reference()).norm()));
      }
    }
  }
  if (!turns.held_out.empty()) {
    for (const double angle : turns.held_out) errors[Triad::kGyroscope].Add(angle);
    for (const double angle : turns.in_sample) seen[Triad::kGyroscope].Add(angle);
    result.turns =
        HeldOutTurns{turns.held_out, Median(turns.held_out), Median(turns.in_sample), std::nullopt};
    if (!turns.nominal.empty()) result.turns->nominal_median_rad = Median(turns.nominal);
  }
  for (const Triad triad : kTriads) {
    result.rms[triad] = errors[triad].value();
    result.in_sample_rms[triad] = seen[triad].value();
  }
  return result;
}

std::vector<HeldOutGroup> GroupsOfPosesAndTurns(const PoseGraph& graph, int folds) {
  const auto is_enough = [folds](std::size_t count) {
    return count >= 2 * static_cast<std::size_t>(folds);
  };
  std::vector<HeldOutGroup> groups;
  if (folds < 2 || !is_enough(graph.nodes.size())) return groups;
  const auto step = static_cast<std::size_t>(folds);
  for (std::size_t fold = 0; fold < step; ++fold) {
    HeldOutGroup& group = groups.emplace_back();
    for (std::size_t k = fold; k < graph.nodes.size(); k += step) group.nodes.push_back(k);
  }
  for (std::size_t fold = 0; fold < step && is_enough(graph.increments.size()); ++fold) {
    HeldOutGroup& group = groups.emplace_back();
    for (std::size_t i = fold; i < graph.increments.size(); i += step) {
      group.increments.push_back(i);
    }
  }
  return groups;
}

std::optional<double> HeldOutError(const PoseGraph& graph,
                                   const std::vector<HeldOutGroup>& groups) {
  RootMeanSquare error;
  for (const HeldOutGroup& group : groups) {
    PoseGraph part = graph;
    for (const std::size_t k : group.nodes) {
      for (Observation& seen : part.nodes[k].observations) seen.weight = kRejectedWeight;
    }
    for (const std::size_t i : group.increments) part.increments[i].weight = kRejectedWeight;
    SolveGraph(&part, kRoundTolerance);
    if (ReducedSystem(part).rank() < part.layout.free_size()) return std::nullopt;
    for (const std::size_t k : group.nodes) {
      PoseResidual12 residual;
      part.nodes[k].Evaluate(
          part.layout, part.shared.data(), part.nodes[k].state.data(), &residual, nullptr, nullptr);
      residual = graph.nodes[k].SquareRootInformation() * residual;
      Eigen::Index row = 0;
      for (const Observation& seen : graph.nodes[k].observations) {
        for (int axis = 0; axis < 3 && !seen.rejected; ++axis) error.Add(residual[row + axis]);
        row += 3;
      }
    }
    for (const std::size_t i : group.increments) {
      const IncrementEdge& edge = graph.increments[i];
      if (edge.rejected) continue;
      const Eigen::Vector3d residual =
          edge.SquareRootInformation() *
          part.increments[i].Residual(part.layout,
                                      part.shared.data(),
                                      part.nodes[edge.from].state.data(),
                                      part.nodes[edge.from + 1].state.data());
      for (const double value : residual) error.Add(value);
    }
  }
  return error.value();
}

}  // namespace truetriad
