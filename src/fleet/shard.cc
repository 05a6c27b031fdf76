// SPDX-License-Identifier: Apache-2.0
#include "fleet/shard.h"

#include <charconv>

namespace truetriad::fleet {
namespace {

std::optional<int> WholeNumber(std::string_view text) {
  int number = 0;
  const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (failure != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return number;
}

}  // namespace

std::optional<Shard> ShardFromText(std::string_view text) {
  const std::size_t slash = text.find('/');
  if (slash == std::string_view::npos) return std::nullopt;
  const std::optional<int> index = WholeNumber(text.substr(0, slash));
  const std::optional<int> count = WholeNumber(text.substr(slash + 1));
  if (!index || !count || *index < 0 || *index >= *count || *count > kMostShards) {
    return std::nullopt;
  }
  return Shard{*index, *count};
}

std::string ShardText(const Shard& shard) {
  return shard.count == 1 ? "" : std::to_string(shard.index) + "/" + std::to_string(shard.count);
}

}  // namespace truetriad::fleet
