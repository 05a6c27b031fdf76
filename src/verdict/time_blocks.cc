// SPDX-License-Identifier: Apache-2.0
#include "verdict/time_blocks.h"

#include <algorithm>
#include <cstddef>

#include "math/dense/cholesky.h"
#include "math/dense/eigenvalues.h"
#include "math/dense/products.h"
#include "math/distributions.h"
#include "model/mechanisms.h"
#include "solve/chain_elimination.h"

namespace truetriad {
namespace {

// Nodes of a stretch that tell of it.
constexpr std::size_t kFewestInBlock = 12;
// Chance that calls stretches of one kind different.
constexpr double kDifferentLevel = 1e-4;
// Of the whole's information about a direction: what a stretch has less of it does not tell.
constexpr double kToldShare = 1e-3;

// What one change is seen in, each as directions of the free coordinates: the reference, the bias
// of a triad, and of a vector sensor all gains at once, which a field of another strength looks
// like where the strength was stated.
std::vector<Eigen::MatrixXd> ChangesOf(const PoseGraph& graph) {
  const SharedLayout& layout = graph.layout;
  std::vector<Eigen::MatrixXd> changes;
  const auto add_block = [&](int at, int size) {
    const std::vector<Eigen::Index> columns = layout.ColumnsOf(at, size);
    const Eigen::MatrixXd all = Eigen::MatrixXd::Identity(layout.free_size(), layout.free_size());
    if (!columns.empty()) changes.emplace_back(all(Eigen::all, columns));
  };
  add_block(layout.reference, kReferenceSize);
  for (const Triad triad : kTriads) {
    if (!layout.Has(triad)) continue;
    add_block(layout.bias[triad], 3);
    if (triad == Triad::kGyroscope) continue;
    Eigen::VectorXd gains = Eigen::VectorXd::Zero(layout.size);
    gains.segment<9>(layout.sensitivity[triad]) = graph.sensitivity(triad).reshaped();
    const Eigen::VectorXd along = layout.basis.transpose() * gains;
    if (!along.isZero(0.0)) changes.emplace_back(along.normalized());
  }
  return changes;
}

// Chance that the stretches differ by so much along some directions, all else being as it is.
double ChanceAlong(const Eigen::MatrixXd& directions,
                   const std::vector<TimeBlock>& blocks,
                   const Cholesky& whole) {
  double chi2 = 0.0, dof = 0.0;
  for (const TimeBlock& block : blocks) {
    const Eigen::MatrixXd across = Times(block.information, directions);
    const Cholesky own(TransposeTimes(directions, across));
    if (!own.is_positive()) continue;
    const Eigen::VectorXd gradient = TransposeTimesVector(directions, block.gradient);
    chi2 += gradient.dot(own.SolveVector(gradient));
    const Eigen::MatrixXd half = whole.SolveLower(across);
    dof += static_cast<double>(directions.cols()) - own.Solve(TransposeTimes(half, half)).trace();
  }
  return dof >= 1.0 ? 1.0 - ChiSquareCdf(chi2, dof) : 1.0;
}

// One step between two stretches along some directions: how the solution would move for the
// stretches before it and for those after it.
struct Step {
  double p_value = 1.0;  // at the best of all places
  Eigen::VectorXd before, after;
};

// Score test of h = 0 before the step and h along `directions` after it: what h takes off χ² with
// all else free.
Step LikeliestStep(const Eigen::MatrixXd& directions,
                   const std::vector<TimeBlock>& blocks,
                   const Cholesky& whole) {
  const Eigen::Index n = directions.rows();
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(n, n);
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(n);
  Step best;
  double best_chi2 = 0.0;
  for (std::size_t b = blocks.size(); b-- > 1;) {
    information += blocks[b].information;
    gradient += blocks[b].gradient;
    const Eigen::MatrixXd across = Times(information, directions);
    const Eigen::MatrixXd gain = whole.Solve(across);
    const Eigen::MatrixXd told = TransposeTimes(directions, across) - TransposeTimes(across, gain);
    const Cholesky factor(0.5 * (told + told.transpose()));
    if (!factor.is_positive()) continue;
    const Eigen::VectorXd score = TransposeTimesVector(directions, gradient);
    const Eigen::VectorXd step = -factor.SolveVector(score);
    const double chi2 = -step.dot(score);
    if (!(chi2 > best_chi2)) continue;
    best_chi2 = chi2;
    best.before = -gain * step;
    best.after = best.before + directions * step;
  }
  const double chance = 1.0 - ChiSquareCdf(best_chi2, static_cast<double>(directions.cols()));
  best.p_value = std::min(1.0, static_cast<double>(blocks.size() - 1) * chance);
  return best;
}

// The nodes from `begin` to before `end` with the turns between them, without priors; where none of
// them tells its heading that of the first is held.
PoseGraph PartOf(const PoseGraph& graph, std::size_t begin, std::size_t end) {
  PoseGraph part;
  part.layout = graph.layout;
  part.shared = graph.shared;
  part.integrated_at = graph.integrated_at;
  const auto at = [&](std::size_t k) {
    return graph.nodes.begin() + static_cast<std::ptrdiff_t>(k);
  };
  part.nodes.assign(at(begin), at(end));
  for (const IncrementEdge& edge : graph.increments) {
    if (edge.from < begin || edge.from + 1 >= end) continue;
    part.increments.push_back(edge);
    part.increments.back().from -= begin;
  }
  const bool tells_heading = std::any_of(part.nodes.begin(),
                                         part.nodes.end(),
                                         [](const PoseNode& node) { return node.TellsHeading(); });
  if (!tells_heading && !part.increments.empty()) {
    part.nodes.front().holds_heading = true;
    part.nodes.front().held_world_from_body = part.nodes.front().rotation();
  }
  return part;
}

}  // namespace

std::vector<TimeBlock> BlocksOf(const ReducedSystem& system,
                                std::size_t count,
                                const std::function<std::size_t(std::size_t)>& group_of) {
  const auto n = static_cast<Eigen::Index>(system.size());
  std::vector<TimeBlock> blocks(count, {Eigen::MatrixXd::Zero(n, n), Eigen::VectorXd::Zero(n)});
  for (const auto& factor : system.factors()) {
    TimeBlock& block = blocks[group_of(factor.node)];
    const Eigen::MatrixXd J = system.J().middleRows(factor.row, factor.rows);
    block.information +=
        TransposeTimes(J, Eigen::MatrixXd(system.B().middleRows(factor.row, factor.rows)));
    block.gradient += J.transpose() * system.projected().segment(factor.row, factor.rows);
  }
  return blocks;
}

BlockScatter ScatterOf(const std::vector<TimeBlock>& blocks,
                       const Eigen::MatrixXd& information,
                       const PoseGraph& graph) {
  const Eigen::Index n = information.rows();
  BlockScatter scatter;
  scatter.covariance = Eigen::MatrixXd::Zero(n, n);
  const Cholesky whole(information);
  if (blocks.size() < 2 || n == 0 || !whole.is_positive()) return scatter;
  double chi2 = 0.0, dof = 0.0;
  Eigen::MatrixXd jackknife = Eigen::MatrixXd::Zero(n, n);
  for (const TimeBlock& block : blocks) {
    // In coordinates in which the whole's information is the identity.
    const Eigen::MatrixXd half = whole.SolveLower(block.information);
    const Eigen::MatrixXd told = whole.SolveLower(half.transpose());
    const SymmetricEigen spectrum = EigenOfSymmetric(0.5 * (told + told.transpose()));
    const Eigen::VectorXd gradient =
        TransposeTimesVector(spectrum.vectors, whole.SolveLowerVector(block.gradient));
    Eigen::VectorXd moved = Eigen::VectorXd::Zero(n);
    for (Eigen::Index i = 0; i < n; ++i) {
      const double share = std::clamp(spectrum.values[i], 0.0, 1.0);
      if (share < kToldShare) continue;
      // Of variance share (1 - share) where the readings follow the model.
      chi2 += gradient[i] * gradient[i] / share;
      dof += 1.0 - share;
      moved[i] = gradient[i] / std::max(1.0 - share, kToldShare);
    }
    const Eigen::VectorXd step = whole.SolveUpperVector(spectrum.vectors * moved);
    jackknife += step * step.transpose();
  }
  if (!(dof >= 1.0)) return scatter;
  scatter.ratio = chi2 / dof;
  scatter.p_value = 1.0 - ChiSquareCdf(chi2, dof);
  for (const Eigen::MatrixXd& change : ChangesOf(graph)) {
    scatter.p_value = std::min(scatter.p_value, ChanceAlong(change, blocks, whole));
    const Step step = LikeliestStep(change, blocks, whole);
    scatter.p_value = std::min(scatter.p_value, step.p_value);
    if (step.p_value > kDifferentLevel || !Acts(Mechanism::kStretchStep)) continue;
    scatter.covariance +=
        step.before * step.before.transpose() + step.after * step.after.transpose();
  }
  if (scatter.p_value > kDifferentLevel || !Acts(Mechanism::kStretches)) return scatter;
  const auto count = static_cast<double>(blocks.size());
  scatter.covariance += (count - 1.0) / count * jackknife;
  return scatter;
}

std::vector<TimeBlock> TimeBlocksOf(const PoseGraph& graph, const ReducedSystem& system) {
  const std::size_t nodes = graph.nodes.size();
  if (nodes < kTimeBlocks * kFewestInBlock) return {};
  std::vector<TimeBlock> blocks;
  for (std::size_t b = 0; b < kTimeBlocks && !graph.increments.empty(); ++b) {
    const PoseGraph part = PartOf(graph, b * nodes / kTimeBlocks, (b + 1) * nodes / kTimeBlocks);
    const ChainElimination solved = Linearised(part);
    blocks.push_back({solved.information(), solved.gradient()});
  }
  if (!blocks.empty()) return blocks;
  return BlocksOf(
      system, kTimeBlocks, [nodes](std::size_t node) { return node * kTimeBlocks / nodes; });
}

Findings FindingsOf(const BlockScatter& blocks) {
  if (blocks.covariance.isZero(0.0)) return {};
  return {Finding(FindingCode::kStretchesDiffer,
                  "stretches of the recording differ by more than noise explains: the field, the "
                  "surroundings or a sensor changed, or a sensor does what the model leaves out; σ "
                  "allow for it",
                  "record again, away from iron and from currents, after the unit has warmed up")
              .With("variance_ratio", blocks.ratio)
              .With("p_value", blocks.p_value)};
}

}  // namespace truetriad
