// SPDX-License-Identifier: Apache-2.0
#include "verdict/settling.h"

#include <algorithm>
#include <cstddef>
#include <map>
#include <optional>
#include <string>

#include "math/distributions.h"
#include "model/mechanisms.h"
#include "solve/shared_information.h"
#include "truetriad/math/rotation.h"

namespace truetriad {
namespace {

// Turns that tell of it, and more than which are rows of a table or of a motion.
constexpr double kFewestTurns = 8.0;
constexpr std::size_t kMostTurns = 1000;

}  // namespace

void AddUnsettledTurns(const PoseSet& poses,
                       const PoseGraph& graph,
                       const ReducedSystem& system,
                       LeftOutTerms* terms) {
  if (graph.nodes.size() > kMostTurns || system.rank() < system.size()) return;
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
  if (count < kFewestTurns) return;
  const double mean = sum / count;
  const double scatter = std::max(variance, squares - count * mean * mean) / (count * count);
  LeftOutTerm term{Triad::kGyroscope, LeftOutKind::kSettling};
  term.p_value = 1.0 - ChiSquareCdf(mean * mean / scatter, 1.0);
  const bool is_shown = term.p_value < kLeftOutLevel && Acts(ActsAs(term));
  terms->tests.push_back(
      {Triad::kGyroscope, std::string(NameOf(term)), term.p_value, is_shown, std::nullopt});
  if (!is_shown) return;
  const Eigen::VectorXd moved = system.covariance() * by;
  term.effect_sigmas = LargestInSigmas(graph.layout, system.covariance(), mean * moved);
  terms->covariance += (mean * mean + scatter) * moved * moved.transpose();
  terms->found.push_back(term);
}

}  // namespace truetriad
