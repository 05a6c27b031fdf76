// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include <ceres/cost_function.h>

namespace truetriad {

// A parameter block that many rows share: where it stands in the shared vector (SharedLayout).
struct SharedBlock {
  int offset = 0;
  int size = 0;
};

// One physical statement, as Ceres takes it: what the model says minus what was read or stated, in
// the unit of that. It is not weighted: WhitenedRow weighs any of them.
//
// Parameter blocks: the shared ones of shared_blocks(), then the state of each pose that it sees
// (one, or two neighbours): its attitude, world <- body, as a quaternion x y z w; or, of a pose of
// which only a direction is known, that direction in the body, x y z. What the model does not have
// is not in the list.
//
// Derivatives by a state are those along its manifold, times the manifold's own Minus: exact for
// every ceres::Manifold of the unit quaternions or of the sphere.
class Row : public ceres::CostFunction {
 public:
  const std::vector<SharedBlock>& shared_blocks() const { return shared_blocks_; }
  std::size_t state_count() const { return parameter_block_sizes().size() - shared_blocks_.size(); }

 protected:
  explicit Row(int rows) { set_num_residuals(rows); }

  // All shared blocks come before the first state.
  void AddShared(const SharedBlock& block);
  // The first of them, with room for as many `more` and for states and no more than that: a chain
  // has a row or three for each of many thousand poses.
  void AddFirstShared(const std::vector<SharedBlock>& blocks, std::size_t more);
  void AddState(int size) { mutable_parameter_block_sizes()->push_back(size); }

 private:
  std::vector<SharedBlock> shared_blocks_;
};

// A quaternion, and a unit vector.
inline constexpr int kAttitudeSize = 4;
inline constexpr int kDirectionSize = 3;

}  // namespace truetriad
