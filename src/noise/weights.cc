// SPDX-License-Identifier: Apache-2.0
#include "noise/weights.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include "math/distributions.h"
#include "model/mechanisms.h"

namespace truetriad {
namespace {

// Mean change of the weights below which they have settled.
constexpr double kSettledWeight = 1e-3;

bool IsSamePose(const DeletionTest& a, const DeletionTest& b) {
  return a.component != NoiseComponent::kTurn && a.node == b.node;
}

// The weight of what was tested.
struct RobustWeight {
  double& weight;
  bool& rejected;
};

RobustWeight WeightOf(const DeletionTest& test, PoseGraph* graph) {
  if (test.component == NoiseComponent::kTurn) {
    IncrementEdge& edge = graph->increments[test.observation];
    return {edge.weight, edge.rejected};
  }
  Observation& observation = graph->nodes[test.node].observations[test.observation];
  return {observation.weight, observation.rejected};
}

// What the robust step makes of one test.
struct Judgement {
  double weight = 1.0;
  bool rejected = false;
};

// Poses and turns that disagree for the most part are not disturbed: what is off is the excess that
// they were judged with, which was guessed too small. All of them count until they have shown it.
void AdmitMajorities(const UnknownNoise& unknown,
                     const std::vector<DeletionTest>& tests,
                     const PoseGraph& graph,
                     std::vector<Judgement>* judgements) {
  for (const NoiseComponent component : unknown.components) {
    std::vector<Judgement*> judged;
    std::ptrdiff_t rejected = 0;
    for (std::size_t i = 0; i < tests.size(); ++i) {
      if (tests[i].component != component || IsStated(tests[i], graph)) continue;
      judged.push_back(&(*judgements)[i]);
      if (judged.back()->rejected) ++rejected;
    }
    if (2 * rejected <= std::ssize(judged) && !Contains(unknown.unjudged, component)) continue;
    if (!judged.empty() && !Acts(Mechanism::kMajorities)) continue;
    for (Judgement* judgement : judged) *judgement = {};
  }
}

}  // namespace

WeightChange UpdateWeights(const RobustOptions& robust,
                           const NoiseState& noise,
                           const UnknownNoise& unknown,
                           const ReducedSystem& system,
                           bool may_readmit,
                           PoseGraph* graph) {
  const std::vector<DeletionTest> tests = DeletionTests(*graph, system);
  const double level =
      kRejectionLevel / static_cast<double>(std::max<std::size_t>(tests.size(), 1));
  // A weight that starts at `scale` normal σ must start at the same probability for any rank.
  std::array<double, 4> huber_limit{};
  // A scale whose tail a double cannot hold is as good as no loss at all.
  const double inside = std::min(ChiSquareCdf(robust.scale * robust.scale, 1.0), 1.0 - 1e-12);
  for (int rank = 1; rank <= 3 && inside > 0.0; ++rank) {
    huber_limit[static_cast<std::size_t>(rank)] = std::sqrt(ChiSquareQuantile(inside, rank));
  }
  std::array<double, kNoiseComponents> dof{};
  dof.fill(std::numeric_limits<double>::infinity());
  for (const NoiseComponent component : noise.estimated) {
    if (noise.estimate.components.empty()) continue;
    const double found = ExcessDegreesOfFreedom(noise.estimate, *graph, component);
    dof[static_cast<std::size_t>(component)] = found > 1.0 ? found : 1.0;
  }

  std::vector<Judgement> judgements(tests.size());
  for (std::size_t first = 0; first < tests.size();) {
    // At one pose the triads share the blame for their disagreement: only the worst goes, and the
    // others are judged again without it. A turn stands by itself.
    const bool is_turn = tests[first].component == NoiseComponent::kTurn;
    std::size_t end = first;
    std::size_t worst = first;
    double worst_ratio = -1.0;
    bool has_rejected = false;
    for (; end < tests.size() && (is_turn ? end == first : IsSamePose(tests[end], tests[first]));
         ++end) {
      has_rejected = has_rejected || WeightOf(tests[end], graph).rejected;
      const double ratio = tests[end].rank > 0 ? tests[end].chi2 / tests[end].rank : 0.0;
      if (ratio > worst_ratio) {
        worst_ratio = ratio;
        worst = end;
      }
    }
    for (std::size_t i = first; i < end; ++i) {
      const RobustWeight now = WeightOf(tests[i], graph);
      Judgement& judgement = judgements[i];
      if (tests[i].rank > 0) {
        const double z = std::sqrt(tests[i].chi2);
        const double limit = huber_limit[static_cast<std::size_t>(tests[i].rank)];
        if (z > limit && Acts(Mechanism::kHuber)) judgement.weight = limit / z;
        const double nu = dof[static_cast<std::size_t>(tests[i].component)];
        const double p = std::isfinite(nu)
                             ? 1.0 - FisherCdf(tests[i].chi2 / tests[i].rank, tests[i].rank, nu)
                             : 1.0 - ChiSquareCdf(tests[i].chi2, tests[i].rank);
        judgement.rejected = p < level && (now.rejected || (!has_rejected && i == worst)) &&
                             Acts(Mechanism::kOutliers);
      } else {
        judgement.rejected = now.rejected;
      }
      judgement.rejected = judgement.rejected || (now.rejected && !may_readmit);
      if (judgement.rejected) judgement.weight = kRejectedWeight;
    }
    first = end;
  }
  AdmitMajorities(unknown, tests, *graph, &judgements);

  bool changed = false;
  double moved = 0.0;
  for (std::size_t i = 0; i < tests.size(); ++i) {
    const RobustWeight now = WeightOf(tests[i], graph);
    changed = changed || judgements[i].rejected != now.rejected;
    moved += std::abs(judgements[i].weight - now.weight);
    now.rejected = judgements[i].rejected;
    now.weight = judgements[i].weight;
  }
  return {changed || moved > 0.0,
          changed || moved > kSettledWeight * static_cast<double>(tests.size())};
}

}  // namespace truetriad
