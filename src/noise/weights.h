// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <vector>

#include "noise/deletion.h"
#include "noise/noise_settling.h"

namespace truetriad {

// Share of false alarms, over all poses and sensors of a run, at which a pose is left out.
constexpr double kRejectionLevel = 0.01;

// A turn of a known angle: what was stated of it, not the excess, is most of its noise.
inline bool IsStated(const DeletionTest& test, const PoseGraph& graph) {
  return test.component == NoiseComponent::kTurn &&
         graph.increments[test.observation].stated_turn >= 0;
}

// Which components of the noise were to be estimated, and those of them where that leaves nothing
// to tell a disturbed observation by.
struct UnknownNoise {
  std::vector<NoiseComponent> components;
  std::vector<NoiseComponent> unjudged;
};

inline bool Contains(const std::vector<NoiseComponent>& components, NoiseComponent component) {
  return std::find(components.begin(), components.end(), component) != components.end();
}

struct WeightChange {
  bool any = false;
  bool notable = false;  // of the rejected set or of the weights
};

// Huber weights from the deletion tests; observations whose test cannot be chance are rejected.
// `may_readmit`: a rejected observation whose test has become good again returns.
WeightChange UpdateWeights(const RobustOptions& robust,
                           const NoiseState& noise,
                           const UnknownNoise& unknown,
                           const ReducedSystem& system,
                           bool may_readmit,
                           PoseGraph* graph);

}  // namespace truetriad
