// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string_view>
#include <utility>

namespace truetriad {

/// The names of an enum's values in files: one table per enum, searched by value and by name.
template <typename Value, std::size_t N>
struct NamedValues {
  std::pair<Value, std::string_view> entries[N];

  constexpr std::string_view Name(Value value) const {
    for (const auto& [entry, name] : entries) {
      if (entry == value) return name;
    }
    return "";
  }

  constexpr std::optional<Value> Find(std::string_view wanted) const {
    for (const auto& [entry, name] : entries) {
      if (name == wanted) return entry;
    }
    return std::nullopt;
  }
};

}  // namespace truetriad
