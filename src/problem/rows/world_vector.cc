// SPDX-License-Identifier: Apache-2.0
#include "problem/rows/world_vector.h"

#include <limits>

namespace truetriad {

const WorldVectorWithJacobian& WorldVectorAt(Triad triad, const double* reference) {
  struct Kept {
    ReferenceVector at = ReferenceVector::Constant(std::numeric_limits<double>::quiet_NaN());
    WorldVectorWithJacobian world;
  };
  static thread_local PerTriad<Kept> kept_of_triads;
  Kept& kept = kept_of_triads[triad];
  const Eigen::Map<const ReferenceVector> at(reference);
  if (kept.at != at) {
    kept.at = at;
    kept.world.vector = WorldVector(triad, at);
    kept.world.by_reference = WorldVectorJacobian(triad, at);
  }
  return kept.world;
}

}  // namespace truetriad
