// SPDX-License-Identifier: Apache-2.0
#include "verdict/checks/held_gyroscope.h"

#include <cmath>

#include "base/messages.h"
#include "math/distributions.h"
#include "problem/graph_builder.h"
#include "problem/start_values.h"
#include "truetriad/base/triad.h"
#include "verdict/checks/check.h"
#include "verdict/turn_errors.h"

namespace truetriad {
namespace {

// Largest median error of the turns. An accelerometer's start values cause errors of a few
// hundredths of a radian; a gyroscope's gain error of a tenth causes 0.1 rad per radian of turn.
constexpr double kMostMissedRad = 0.1;
// Fewer turns are no basis for a median.
constexpr std::size_t kFewTurns = 3;
// A larger scatter of turns, 1.1 degrees, is reported: handling and settling cause tenths of a
// degree.
constexpr double kOddScatterRad = 0.02;

bool IsHeld(const TriadOptions& gyroscope) {
  return gyroscope.enabled && (gyroscope.fixed_sensitivity || gyroscope.fixed_bias);
}

std::optional<Eigen::Vector3d> VectorAt(const PoseGraph& graph, const PoseNode& node) {
  const Triad triad = TurnedAgainst(graph.layout);
  for (const Observation& seen : node.observations) {
    if (seen.triad != triad) continue;
    return graph.ModelAt(triad, node).TruthFromRaw(seen.mean_raw);
  }
  return std::nullopt;
}

}  // namespace

std::optional<Finding> WhyHeldGyroscopeIsWrong(const PoseSet& poses,
                                               const StartValues& start,
                                               const std::vector<PoseNode>& nodes,
                                               const CalibrateOptions& options) {
  if (!IsHeld(options.triads[Triad::kGyroscope]) || options.HasGyroscopeAlone()) {
    return std::nullopt;
  }
  PoseGraph graph;
  graph.nodes = nodes;
  LayOutParameters(options, start, &graph);
  BuildIncrements(poses, start, &graph);
  std::vector<double> missed_rad;
  for (const IncrementEdge& edge : graph.increments) {
    if (edge.stated_turn >= 0) continue;
    const auto before = VectorAt(graph, graph.nodes[edge.from]);
    const auto after = VectorAt(graph, graph.nodes[edge.from + 1]);
    if (before && after) missed_rad.push_back(TurnError(edge.increment.rotation, *before, *after));
  }
  if (missed_rad.size() < kFewTurns) return std::nullopt;
  const std::size_t count = missed_rad.size();
  const double median_rad = Median(std::move(missed_rad));
  if (!(median_rad > kMostMissedRad)) return std::nullopt;
  return Finding(FindingCode::kHeldGyroscope,
                 "gyroscope: with the parameters held by `fixed:`, predicted " +
                     std::string(options.TurnsAgainstField() ? "field" : "gravity") +
                     " at the next rest has an error of " +
                     Format("%.0f deg (median of ", kDegPerRad * median_rad) +
                     std::to_string(count) +
                     " turns): the held parameters are of another device or other axes, or not in "
                     "the log's unit",
                 "correct them, or have them estimated")
      .As(Severity::kRefusal)
      .About(Triad::kGyroscope)
      .With("error", median_rad, "rad")
      .With("turns", static_cast<double>(count));
}

// Finds smaller errors of a held gyroscope by the excess noise of the turns.
Findings CheckHeldGyroscope(const SettledRun& run, const SolvedRun& solved) {
  const auto& gyroscope = solved.stated.sensors[Triad::kGyroscope];
  if (!gyroscope || !IsHeld(run.options.triads[Triad::kGyroscope])) return {};
  const double excess_rad = std::sqrt(solved.noise_before.excess[NoiseComponent::kTurn]);
  if (!(excess_rad > kOddScatterRad)) return {};
  return {Finding(FindingCode::kHeldGyroscope,
                  Format("gyroscope: the turns differ by %.1f deg", kDegPerRad * excess_rad) +
                      " (1 σ) from those that the parameters held by `fixed:` predict, far more "
                      "than their noise",
                  "have them estimated")
              .About(Triad::kGyroscope)
              .With("scatter", excess_rad, "rad")};
}

}  // namespace truetriad
