// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
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

/// What the first line says of the store that the runs are, or were, in.
struct LinesHeader {
  StatedShards shards;
  std::string store = {};                   ///< Store::Identity.
  std::optional<RetestPolicy> policy = {};  ///< Store::StatedRetestPolicy.
};

/// {"format":"truetriad/runs","schema_version":1,"shards":8,"shard":2,"store":"…",
/// "retest_counts":"last"}
std::string HeaderLine(const LinesHeader& header);
/// Error (bad input): none of these files begins so, or it has another version.
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

/// A store in one text file (json_lines.h): each run is a line, appended whole and flushed to the
/// disk. For one writer at a time, so that it does on a network folder where shards write a file
/// each. What a writer that was killed left of a line the next one takes away. Runs can be added
/// and read, but no questions asked, nor dispositions or station checks added. `Add` does not look
/// whether the run is there: it is a new one. Errors as OpenStore; error (bad input): another
/// process is writing to it.
Result<std::unique_ptr<Store>> OpenJsonLines(const std::string& path, Access access);

/// The file that a URL names: jsonl:PATH, or NAME.jsonl. Unset: another kind of store.
std::optional<std::string> JsonLinesPath(const std::string& url);

}  // namespace truetriad::fleet
