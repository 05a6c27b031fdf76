// SPDX-License-Identifier: Apache-2.0
#include "verdict/settling.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>

#include "math/distributions.h"
#include "truetriad/math/rotation.h"
#include "verdict/observability.h"

namespace truetriad {
namespace {

// Poses or turns that tell of it, and more than which are rows of a table or of a motion.
constexpr int kFewestSettled = 8;
constexpr std::size_t kMostSettled = 1000;
// Of what h would be known to if all else were known: less is not seen apart from the rest.
constexpr double kSettlingSeen = 1e-6;

struct SettlingColumn {
  StackedRows derivative;  // of all rows by h
  int count = 0;           // places where it is not zero
};

SettlingColumn ColumnOfPoses(const PoseGraph& graph, const ReducedSystem& system, Triad triad) {
  SettlingColumn column{StackedRows::Zero(system.residual().size(), 1)};
  const Observation* before = nullptr;
  for (std::size_t k = 0; k < graph.nodes.size(); ++k) {
    const std::vector<Observation>& seen = graph.nodes[k].observations;
    for (std::size_t i = 0; i < seen.size(); ++i) {
      if (seen[i].triad != triad) continue;
      if (before != nullptr && !seen[i].rejected && graph.nodes[k].role == PoseRole::kRest) {
        column.derivative.block<3, 1>(system.factors()[k].row + 3 * static_cast<Eigen::Index>(i),
                                      0) = before->mean_raw - seen[i].mean_raw;
        ++column.count;
      }
      before = &seen[i];
    }
  }
  return column;
}

}  // namespace

std::optional<Settling> FindSettling(const PoseGraph& graph,
                                     const ReducedSystem& system,
                                     const OwnResiduals& own,
                                     Triad triad) {
  if (graph.nodes.size() > kMostSettled) return std::nullopt;
  const SettlingColumn column = ColumnOfPoses(graph, system, triad);
  if (column.count < kFewestSettled) return std::nullopt;
  const Eigen::VectorXd z = column.derivative.col(0);
  const Eigen::VectorXd shared = system.B().transpose() * z;
  const Eigen::VectorXd by = system.covariance() * shared;
  const double full = z.dot(system.Project(column.derivative).col(0));
  const double information = full - shared.dot(by);
  if (!(information > kSettlingSeen * full)) return std::nullopt;
  const double gradient = z.dot(system.projected());
  Settling settling;
  settling.p_value = own.ChanceOf(gradient * gradient / information, 1);
  settling.moved = -gradient / information * by;
  settling.covariance = by * by.transpose() / information;
  settling.effect_sigmas = LargestInSigmas(graph, system.covariance(), settling.moved);
  settling.kappa = LargestInSigmas(graph, system.covariance(), by / std::sqrt(information));
  return settling;
}

std::optional<Settling> FindUnsettledTurns(const PoseSet& poses,
                                           const PoseGraph& graph,
                                           const ReducedSystem& system) {
  if (graph.nodes.size() > kMostSettled) return std::nullopt;
  std::map<int, const TriadPose*> rests;
  for (const StaticPose& pose : poses.poses) {
    const auto& seen = pose.triads[Triad::kGyroscope];
    if (seen && !seen->quarter_sigma_raw_s.isZero(0.0)) rests[pose.number] = &*seen;
  }
  const auto rest_of = [&](std::size_t node) {
    const auto at = rests.find(graph.nodes[node].number);
    return at == rests.end() ? nullptr : at->second;
  };
  Eigen::VectorXd by = Eigen::VectorXd::Zero(system.size());
  double count = 0.0, sum = 0.0, squares = 0.0, variance = 0.0;
  for (std::size_t i = 0; i < graph.increments.size(); ++i) {
    const IncrementEdge& edge = graph.increments[i];
    if (edge.rejected || edge.stated_turn >= 0) continue;
    const TriadPose* before = rest_of(edge.from);
    const TriadPose* after = rest_of(edge.from + 1);
    const Eigen::Vector3d turn = RotationLog(edge.increment.rotation);
    if (before == nullptr || after == nullptr || !(turn.norm() > 0.0)) continue;
    const Eigen::Vector3d axis = turn.normalized();
    const Eigen::Vector3d in_raw = edge.at.triad.Correction().transpose() * axis;
    const double angle = in_raw.dot(before->last_quarter_raw_s + after->first_quarter_raw_s);
    count += 1.0, sum += angle, squares += angle * angle;
    variance += in_raw.cwiseProduct(before->quarter_sigma_raw_s).squaredNorm() +
                in_raw.cwiseProduct(after->quarter_sigma_raw_s).squaredNorm();
    by += system.B().middleRows<3>(system.factors()[graph.nodes.size() + i].row).transpose() * axis;
  }
  if (count < kFewestSettled) return std::nullopt;
  const double mean = sum / count;
  const double scatter = std::max(variance, squares - count * mean * mean) / (count * count);
  Settling settling;
  settling.p_value = 1.0 - ChiSquareCdf(mean * mean / scatter, 1.0);
  settling.moved = mean * (system.covariance() * by);
  settling.covariance = scatter / (mean * mean) * settling.moved * settling.moved.transpose();
  settling.effect_sigmas = LargestInSigmas(graph, system.covariance(), settling.moved);
  return settling;
}

}  // namespace truetriad
