// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "fleet/store.h"
#include "fleet/unit_run.h"
#include "truetriad/base/result.h"

namespace truetriad::fleet {

// Runs as text: a first line that says what it is, then LineOf(UnitRun) for each.

/// Version of the lines; a file of a later one is neither read nor written to.
inline constexpr int kJsonLinesVersion = 1;

/// {"format":"truetriad/runs/1","shards":8,"shard":2}
std::string HeaderLine(const StatedShards& shards);
/// Error (bad input): none of these files begins so, or a newer one.
Result<StatedShards> ReadHeaderLine(const std::string& path, std::string_view line);
/// `text`, which has no line end, is what a writer that was killed left of a header.
bool IsCutHeader(std::string_view text);

/// What the file says of its shards; nothing where it is empty. Errors as ReadHeaderLine.
Result<StatedShards> ReadJsonLinesHeader(const std::string& path);
/// `take`s every run; a last line that has no end, left by a writer that was killed, is passed
/// over. Error (bad input): the file and line that is no run, or of other shards than the header
/// says; and those of `take`.
Status ForEachLine(const std::string& path, const std::function<Status(UnitRun)>& take);

}  // namespace truetriad::fleet
