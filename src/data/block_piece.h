// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "truetriad/data/sample_source.h"

namespace truetriad {

// Readings number [begin, end) of a block; columns that it lacks stay empty.
inline SampleBlock PieceOf(const SampleBlock& block, std::size_t begin, std::size_t end) {
  const auto part = [&](const auto& span) {
    return span.empty() ? span : span.subspan(begin, end - begin);
  };
  SampleBlock piece = block;
  piece.time_ns = part(block.time_ns);
  piece.x = part(block.x), piece.y = part(block.y), piece.z = part(block.z);
  piece.temperature_degc = part(block.temperature_degc);
  piece.pose = part(block.pose);
  piece.row = part(block.row);
  piece.ambient_degc = part(block.ambient_degc);
  return piece;
}

}  // namespace truetriad
