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

// One physical statement as a Ceres cost function: the model minus a reading or a stated value, in
// the unit of that reading or value. A row has no weight of its own: WhitenedRow weights every row.
//
// Parameter blocks: those of shared_blocks(), then the states of at most two neighbouring poses. A
// state is an attitude, world <- body, as a quaternion x y z w, or, if only a direction is unknown,
// that direction in the body, x y z. Blocks of terms that the model lacks are left out.
//
// A derivative by a state is the derivative along the state's manifold times the derivative of the
// manifold's Minus. This is exact for every ceres::Manifold of the unit quaternions or of the
// sphere.
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
