// SPDX-License-Identifier: Apache-2.0
#include "verdict/time_blocks.h"

#include "verdict/checks/check.h"

namespace truetriad {

Findings CheckTimeBlocks(const SettledRun&, const SolvedRun& solved) {
  return FindingsOf(solved.unmodelled.blocks);
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
