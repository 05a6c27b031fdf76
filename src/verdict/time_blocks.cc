// SPDX-License-Identifier: Apache-2.0
#include "verdict/time_blocks.h"

#include <algorithm>
#include <cstddef>

#include "math/dense/cholesky.h"
#include "math/dense/eigenvalues.h"
#include "math/dense/products.h"
#include "math/distributions.h"

namespace truetriad {
namespace {

// Nodes of a stretch that tell of it.
constexpr std::size_t kFewestInBlock = 12;
// Chance that calls stretches of one kind different.
constexpr double kDifferentLevel = 1e-4;
// Of the whole's information about a direction: what a stretch has less of it does not tell.
constexpr double kToldShare = 1e-3;

std::vector<std::vector<Eigen::Index>> GroupsOf(const SharedLayout& layout) {
  std::vector<std::vector<Eigen::Index>> groups = {
      layout.ColumnsOf(layout.reference, kReferenceSize)};
  for (const Triad triad : kTriads) {
    if (layout.Has(triad)) groups.push_back(layout.ColumnsOf(layout.bias[triad], 3));
  }
  std::erase_if(groups, [](const auto& group) { return group.empty(); });
  return groups;
}

// Chance that the stretches differ by so much in some coordinates, all others being as they are.
double ChanceIn(const std::vector<Eigen::Index>& group,
                const std::vector<TimeBlock>& blocks,
                const Cholesky& whole) {
  double chi2 = 0.0, dof = 0.0;
  for (const TimeBlock& block : blocks) {
    const Cholesky own(block.information(group, group));
    if (!own.is_positive()) continue;
    const Eigen::VectorXd gradient = block.gradient(group);
    chi2 += gradient.dot(own.SolveVector(gradient));
    const Eigen::MatrixXd half = whole.SolveLower(block.information(Eigen::all, group));
    dof += static_cast<double>(group.size()) - own.Solve(TransposeTimes(half, half)).trace();
  }
  return dof >= 1.0 ? 1.0 - ChiSquareCdf(chi2, dof) : 1.0;
}

}  // namespace

std::vector<TimeBlock> TimeBlocksOf(const ReducedSystem& system) {
  const std::size_t count = system.factors().size();
  if (count < kTimeBlocks * kFewestInBlock) return {};
  const auto n = static_cast<Eigen::Index>(system.size());
  std::size_t nodes = 0;
  for (const auto& factor : system.factors()) nodes = std::max(nodes, factor.node + 1);
  std::vector<TimeBlock> blocks(kTimeBlocks,
                                {Eigen::MatrixXd::Zero(n, n), Eigen::VectorXd::Zero(n)});
  for (const auto& factor : system.factors()) {
    TimeBlock& block = blocks[factor.node * kTimeBlocks / nodes];
    const Eigen::MatrixXd J = system.J().middleRows(factor.row, factor.rows());
    block.information +=
        TransposeTimes(J, Eigen::MatrixXd(system.B().middleRows(factor.row, factor.rows())));
    block.gradient += J.transpose() * system.projected().segment(factor.row, factor.rows());
  }
  return blocks;
}

BlockScatter ScatterOf(const std::vector<TimeBlock>& blocks,
                       const Eigen::MatrixXd& information,
                       const SharedLayout& layout) {
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
  for (const std::vector<Eigen::Index>& group : GroupsOf(layout)) {
    scatter.p_value = std::min(scatter.p_value, ChanceIn(group, blocks, whole));
  }
  if (scatter.p_value > kDifferentLevel) return scatter;
  const auto count = static_cast<double>(blocks.size());
  scatter.covariance = (count - 1.0) / count * jackknife;
  return scatter;
}

}  // namespace truetriad
