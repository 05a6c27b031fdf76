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

// If the mean change of the weights is below this, 0.1 % of a full weight, they have settled.
constexpr double kSettledWeight = 1e-3;

bool IsSamePose(const DeletionTest& a, const DeletionTest& b) {
  return a.component != NoiseComponent::kTurn && a.node == b.node;
}

// References to the weight and the rejection of the tested observation or turn.
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

// The result of the robust step for one test.
struct Judgement {
  double weight = 1.0;
  bool rejected = false;
};

// If most observations of a component are rejected, they are not disturbed, but their excess was
// guessed too small. All of them are then accepted until this excess is estimated.
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

// |z| above which an observation loses weight, indexed by the rank of its test. The probability of
// a larger |z| is the same for each rank.
std::array<double, 4> HuberLimits(double scale) {
  std::array<double, 4> limits{};
  // A scale above 7.1 acts like 7.1, since the tail is then lost in the rounding of 1 - tail.
  const double inside = std::min(ChiSquareCdf(scale * scale, 1.0), 1.0 - 1e-12);
  for (int rank = 1; rank <= 3 && inside > 0.0; ++rank) {
    limits[static_cast<std::size_t>(rank)] = std::sqrt(ChiSquareQuantile(inside, rank));
  }
  return limits;
}

// The degrees of freedom of each noise component; infinite if its noise is known.
std::array<double, kNoiseComponents> DofOf(const NoiseState& noise, const PoseGraph& graph) {
  std::array<double, kNoiseComponents> dof{};
  dof.fill(std::numeric_limits<double>::infinity());
  for (const NoiseComponent component : noise.estimated) {
    if (noise.estimate.components.empty()) continue;
    const double found = ExcessDegreesOfFreedom(noise.estimate, graph, component);
    dof[static_cast<std::size_t>(component)] = found > 1.0 ? found : 1.0;
  }
  return dof;
}

// The index after the last test of one pose or turn, and the index of the worst of these tests.
struct TestsOfOne {
  std::size_t end = 0, worst = 0;
  bool has_rejected = false;
};

// The tests from `first` on that belong to the same pose. A turn has only one test.
TestsOfOne TestsFrom(std::size_t first, const std::vector<DeletionTest>& tests, PoseGraph* graph) {
  const bool is_turn = tests[first].component == NoiseComponent::kTurn;
  TestsOfOne found{first, first, false};
  double worst_ratio = -1.0;
  for (std::size_t& end = found.end;
       end < tests.size() && (is_turn ? end == first : IsSamePose(tests[end], tests[first]));
       ++end) {
    found.has_rejected = found.has_rejected || WeightOf(tests[end], graph).rejected;
    const double ratio = tests[end].rank > 0 ? tests[end].chi2 / tests[end].rank : 0.0;
    if (ratio <= worst_ratio) continue;
    worst_ratio = ratio;
    found.worst = end;
  }
  return found;
}

// The probability that a test is at least as large by chance. `dof`: the degrees of freedom of the
// noise.
double ChanceOf(const DeletionTest& test, double dof) {
  return std::isfinite(dof) ? 1.0 - FisherCdf(test.chi2 / test.rank, test.rank, dof)
                            : 1.0 - ChiSquareCdf(test.chi2, test.rank);
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
  const std::array<double, 4> huber_limit = HuberLimits(robust.scale);
  const std::array<double, kNoiseComponents> dof = DofOf(noise, *graph);
  std::vector<Judgement> judgements(tests.size());
  for (std::size_t first = 0; first < tests.size();) {
    // A disagreement at one pose raises the tests of all its triads: only the worst triad is
    // rejected, and the others are tested again without it.
    const TestsOfOne of_one = TestsFrom(first, tests, graph);
    for (std::size_t i = first; i < of_one.end; ++i) {
      const RobustWeight now = WeightOf(tests[i], graph);
      Judgement& judgement = judgements[i];
      judgement.rejected = now.rejected;
      if (tests[i].rank > 0) {
        const double z = std::sqrt(tests[i].chi2);
        const double limit = huber_limit[static_cast<std::size_t>(tests[i].rank)];
        if (z > limit && Acts(Mechanism::kHuber)) judgement.weight = limit / z;
        const double p = ChanceOf(tests[i], dof[static_cast<std::size_t>(tests[i].component)]);
        judgement.rejected = p < level &&
                             (now.rejected || (!of_one.has_rejected && i == of_one.worst)) &&
                             Acts(Mechanism::kOutliers);
      }
      judgement.rejected = judgement.rejected || (now.rejected && !may_readmit);
      if (judgement.rejected) judgement.weight = kRejectedWeight;
    }
    first = of_one.end;
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
