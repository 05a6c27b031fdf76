// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <vector>

#include "noise/deletion.h"
#include "noise/noise_settling.h"

namespace truetriad {

// Probability, over all poses and sensors of a run, that some undisturbed observation is rejected.
constexpr double kRejectionLevel = 0.01;

// Whether the test belongs to a turn of stated angle. Its noise is mostly the uncertainty of the
// stated angle.
inline bool IsStated(const DeletionTest& test, const PoseGraph& graph) {
  return test.component == NoiseComponent::kTurn &&
         graph.increments[test.observation].stated_turn >= 0;
}

// `components`: the noise components that are to be estimated. `unjudged`: those of them whose
// noise is undetermined, so that disturbed observations cannot be recognised.
struct UnknownNoise {
  std::vector<NoiseComponent> components;
  std::vector<NoiseComponent> unjudged;
};

inline bool Contains(const std::vector<NoiseComponent>& components, NoiseComponent component) {
  return std::find(components.begin(), components.end(), component) != components.end();
}

struct WeightChange {
  bool any = false;
  bool notable = false;  // the rejected set changed, or weights have not settled
};

// Sets Huber weights by the deletion tests, and rejects observations whose test is too unlikely.
// `may_readmit`: rejected observations are accepted again if their test is good now.
WeightChange UpdateWeights(const RobustOptions& robust,
                           const NoiseState& noise,
                           const UnknownNoise& unknown,
                           const ReducedSystem& system,
                           bool may_readmit,
                           PoseGraph* graph);

}  // namespace truetriad
