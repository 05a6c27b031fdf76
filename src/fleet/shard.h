// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace truetriad::fleet {

/// One part of several of a fleet's units, each calibrated by a run of its own.
struct Shard {
  int index = 0;  ///< From 0.
  int count = 1;  ///< At most kMostShards.
};
inline constexpr int kMostShards = 1'000'000;

/// "2/8"; unset: it is no such text, or the index is not below the count.
std::optional<Shard> ShardFromText(std::string_view text);
/// The same the other way; empty: it is the only one.
std::string ShardText(const Shard& shard);

}  // namespace truetriad::fleet
