// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "fleet/store.h"
#include "fleet/unit_run.h"
#include "truetriad/base/result.h"

namespace truetriad::fleet {

// Runs as text: a first line that says what it is, then for each run LineOf(UnitRun), and what was
// decided about it in lines behind its own; checks of stations anywhere. A last line says how many
// of each are above it: without it something is missing. What is added later ends with another one.

/// What the first line says of the store that the runs are, or were, in:
/// {"format":"truetriad/runs","schema_version":1,"shards":8,"shard":2,"store":"…",
/// "retest_counts":"last"}
std::string HeaderLine(const StoreHeader& header);

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
  StoreHeader header;  ///< Of 0 shards: there is none yet.
  Decisions decisions;
  LineCounts counts;
  bool is_ended = false;   ///< Its last line is an EndLine.
  std::int64_t bytes = 0;  ///< Of whole lines.
};

/// What the first line of a file says; unset: it is no file of runs, or of another version.
std::optional<StoreHeader> HeaderOf(const std::string& path);

/// `take`s every run of a file; a last line that has no end, left by a writer that was killed, is
/// passed over. Error (bad input): the file cannot be read or is none of these, the file and line
/// that is no run or decision, of other shards than the header says, or an end that counts other
/// lines than are above it; and those of `take`.
Result<LinesRead> ForEachLine(const std::string& path, const std::function<Status(UnitRun)>& take);

/// A file of runs that one process at a time writes. Each line is appended whole and flushed to the
/// disk, so that it does on a network folder where shards write a file each.
class RunLines {
 public:
  /// Opens the file, or makes it, and `take`s the runs that are there. What a writer that was
  /// killed left of a line is taken away. Errors as ForEachLine; error (bad input): it cannot be
  /// written, or another process is writing to it.
  static Result<std::unique_ptr<RunLines>> Open(const std::string& path,
                                                const std::function<Status(UnitRun)>& take);
  ~RunLines();
  RunLines(const RunLines&) = delete;
  RunLines& operator=(const RunLines&) = delete;

  /// What the first line says, and what says whether there is one.
  const StoreHeader& header() const { return read_.header; }
  bool HasBegun() const { return read_.header.shards.count > 0; }
  Status Begin(const StoreHeader& header);
  Status Add(const UnitRun& run);
  /// Writes the EndLine, where lines have come since the last.
  Status End();

 private:
  explicit RunLines(std::string path) : path_(std::move(path)) {}
  Status Lock();
  /// On the disk when it returns; where that fails, nothing of it is there.
  Status Append(std::string_view text);
  Error Failure() const;

  std::string path_;
  int descriptor_ = -1;
  LinesRead read_;
  bool is_cut_ = false;  ///< More than whole lines is there.
};

/// Error (bad input): a file of runs answers no questions.
Error NoQuestions(const std::string& path);

/// The file that a URL names: jsonl:PATH, or NAME.jsonl. Unset: another kind of store.
std::optional<std::string> JsonLinesPath(const std::string& url);

}  // namespace truetriad::fleet
