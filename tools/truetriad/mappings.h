// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>
#include <vector>

namespace truetriad {

/// A file of configs/mappings, as the program was built with it.
struct ShippedMapping {
  std::string_view name;  ///< "euroc"
  std::string_view text;
};

/// In the order of their names.
const std::vector<ShippedMapping>& ShippedMappings();

}  // namespace truetriad
