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

// Runs as text: a first line that says what it is, then for each run LineOf(UnitRun), and what was
// decided about it in lines behind its own; checks of stations anywhere.

/// Version of the lines; a file of a later one is neither read nor written to.
inline constexpr int kJsonLinesVersion = 2;

/// What the first line says of the store that the runs are, or were, in.
struct LinesHeader {
  StatedShards shards;
  std::string store = {};                   ///< Store::Identity.
  std::optional<RetestPolicy> policy = {};  ///< Store::StatedRetestPolicy.
};

/// {"format":"truetriad/runs/2","shards":8,"shard":2,"store":"…","retest_counts":"last"}
std::string HeaderLine(const LinesHeader& header);
/// Error (bad input): none of these files begins so, or a newer one.
Result<LinesHeader> ReadHeaderLine(const std::string& path, std::string_view line);
/// `text`, which has no line end, is what a writer that was killed left of a header.
bool IsCutHeader(std::string_view text);

/// {"disposition":{…}} and {"station_check":{…}}.
std::string LineOf(const Disposition& disposition);
std::string LineOf(const StationCheck& check);

/// What the file's first line says; nothing where it is empty. Errors as ReadHeaderLine.
Result<LinesHeader> ReadJsonLinesHeader(const std::string& path);
/// `take`s every run, and notes what was decided; a last line that has no end, left by a writer
/// that was killed, is passed over. Error (bad input): the file and line that is no run or
/// decision, or of other shards than the header says; and those of `take`.
Status ForEachLine(const std::string& path,
                   const std::function<Status(UnitRun)>& take,
                   Decisions* decisions = nullptr);

}  // namespace truetriad::fleet
