// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "tools/convert/common/byte_stream.h"

namespace truetriad::convert {

/// What a .mat file of version 5 is filled by, one element a variable.
struct Elements5 {
  int whole = 0;  ///< Elements, from the first on, that are sound.
  enum class Rest { kNone, kDamaged, kTooManyCells } rest = Rest::kNone;  ///< What follows them.
};

constexpr std::size_t kHeader5 = 128;  ///< Its text, version and byte order.

/// Cells and elements of structs, in all variables together: the library takes 220 bytes for each,
/// of which eight zeros in the file, compressed to nothing, may be all.
constexpr int kMostCells = 250'000;

/// Walks through a file of version 5 before the library does, which believes what a file says of
/// itself: it fills up with zeros what is missing of a variable that is cut, and makes room for as
/// many cells or structs as one says to hold. An element is sound that is there to its end and has
/// the bytes for each of its cells, down to the innermost. `is_swapped`: the file is big-endian.
Elements5 ElementsOf5(ByteStream* file, bool is_swapped);

}  // namespace truetriad::convert
