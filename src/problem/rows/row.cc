// SPDX-License-Identifier: Apache-2.0
#include "problem/rows/row.h"

#include <glog/logging.h>

namespace truetriad {

void Row::AddShared(const SharedBlock& block) {
  CHECK_EQ(parameter_block_sizes().size(), shared_blocks_.size());
  shared_blocks_.push_back(block);
  mutable_parameter_block_sizes()->push_back(block.size);
}

void Row::AddFirstShared(const std::vector<SharedBlock>& blocks, std::size_t more) {
  // The most states are those of a turn: the attitudes at its begin and its end.
  constexpr std::size_t kMostStates = 2;
  shared_blocks_.reserve(blocks.size() + more);
  mutable_parameter_block_sizes()->reserve(blocks.size() + more + kMostStates);
  for (const SharedBlock& block : blocks) AddShared(block);
}

}  // namespace truetriad
