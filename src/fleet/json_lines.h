// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
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
// decided about it in lines behind its own; checks of stations anywhere. A last line says how many
// of each are above it: without it something is missing. What is added later ends with another one.

/// Version of the lines; a file of a later one is neither read nor written to.
inline constexpr int kJsonLinesVersion = 3;

/// What the first line says of the store that the runs are, or were, in.
struct LinesHeader {
  StatedShards shards;
  std::string store = {};                   ///< Store::Identity.
  std::optional<RetestPolicy> policy = {};  ///< Store::StatedRetestPolicy.
};

/// {"format":"truetriad/runs/3","shards":8,"shard":2,"store":"…","retest_counts":"last"}
std::string HeaderLine(const LinesHeader& header);
/// Error (bad input): none of these files begins so, or a newer one.
Result<LinesHeader> ReadHeaderLine(const std::string& path, std::string_view line);
/// `text`, which has no line end, is what a writer that was killed left of a header.
bool IsCutHeader(std::string_view text);

/// {"disposition":{…}} and {"station_check":{…}}.
std::string LineOf(const Disposition& disposition);
std::string LineOf(const StationCheck& check);

/// How many lines of each kind a file has.
struct LineCounts {
  std::size_t runs = 0, dispositions = 0, station_checks = 0;

  bool operator==(const LineCounts&) const = default;
};
/// {"end":{"runs":2,"dispositions":0,"station_checks":0}}
std::string EndLine(const LineCounts& above);

/// What a file has besides its runs.
struct LinesRead {
  Decisions decisions;
  LineCounts counts;
  bool is_ended = false;  ///< Its last line is an EndLine.
};

/// What the file's first line says; nothing where it is empty. Errors as ReadHeaderLine.
Result<LinesHeader> ReadJsonLinesHeader(const std::string& path);
/// `take`s every run, and notes what was decided; a last line that has no end, left by a writer
/// that was killed, is passed over. Error (bad input): the file and line that is no run or
/// decision, of other shards than the header says, or an end that counts other lines than are above
/// it; and those of `take`.
Status ForEachLine(const std::string& path,
                   const std::function<Status(UnitRun)>& take,
                   LinesRead* read = nullptr);

}  // namespace truetriad::fleet
