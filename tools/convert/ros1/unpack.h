// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace truetriad::convert {

/// Unpacks the data of a chunk; false when it is damaged, then `unpacked` holds what came out
/// before. Never unpacks more than `size` bytes, the chunk's stated size. `compression`: none, bz2,
/// lz4.
bool Unpack(std::string_view compression,
            std::string_view packed,
            std::size_t size,
            std::string* unpacked);

}  // namespace truetriad::convert
