// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include <ceres/cost_function.h>

namespace truetriad {

// A parameter block that many rows share, by its place in the shared vector (SharedLayout).
struct SharedBlock {
  int offset = 0;
  int size = 0;
};

// One physical statement as a Ceres cost function: model minus reading or stated value, in the
// latter's unit. A row has no weight of its own: WhitenedRow weights every row.
//
// Parameter blocks: the shared ones of shared_blocks(), then the state of each of its poses (one,
// or two neighbours): its attitude, world <- body, as a quaternion x y z w; or, if only a direction
// is known, that direction in the body, x y z. Blocks of terms that the model lacks are left out.
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
  // Adds the first shared blocks and reserves memory for exactly `more` further ones and two
  // states, since a chain has up to three rows for each of many thousand poses.
  void AddFirstShared(const std::vector<SharedBlock>& blocks, std::size_t more);
  void AddState(int size) { mutable_parameter_block_sizes()->push_back(size); }

 private:
  std::vector<SharedBlock> shared_blocks_;
};

// Entries of a quaternion.
inline constexpr int kAttitudeSize = 4;
// Entries of a unit vector.
inline constexpr int kDirectionSize = 3;

}  // namespace truetriad
