// SPDX-License-Identifier: Apache-2.0
#include "problem/rows/row.h"

#include <glog/logging.h>

namespace truetriad {

void Row::AddShared(const SharedBlock& block) {
  CHECK_EQ(parameter_block_sizes().size(), shared_blocks_.size());
  shared_blocks_.push_back(block);
  mutable_parameter_block_sizes()->push_back(block.size);
}

}  // namespace truetriad
